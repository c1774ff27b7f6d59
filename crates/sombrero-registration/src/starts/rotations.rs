//! Rotations about a point that bring samples onto a surface: a look at all of them.
//!
//! They are tried at the points of a super-Fibonacci spiral (Alexa 2022, `alexa2022`): with s = i + 1/2,
//!
//! ```text
//! q = (√(s/n) sin α, √(s/n) cos α, √(1 - s/n) sin β, √(1 - s/n) cos β),   α = 2π s / √2,  β = 2π s / ψ,
//! ```
//!
//! where ψ = 1.5337… solves ψ⁴ = ψ + 4, which leaves no rotation farther than about 14 degrees from one tried.

use std::f64::consts::{SQRT_2, TAU};

use nalgebra::{Point3, Quaternion, Similarity3, UnitQuaternion};
use rayon::prelude::*;

use crate::refinement::motion::Motion;
use crate::starts::ranking::{distinct, ranked};
use crate::starts::rough;
use crate::surface::lookup::Lookup;
use crate::surface::sample::Sample;

/// Rotations that are tried.
const COUNT: usize = 4_000;
const PSI: f64 = 1.533_751_168_755_204_3;
/// Samples in a first look, and distance up to which they support a rotation.
const LOOKS: usize = 96;
const TOLERANCE: f64 = 0.06;
/// Poses closer than this on average are one: before the rough ICP and after it.
const SAME: [f64; 2] = [0.05, 0.02];
/// Rotations that get a rough ICP at most, and support before it relative to that asked for after it.
const ROUGH: usize = 200;
const BEFORE: f64 = 0.5;
/// Distance up to which a sample supports a pose after it.
const FINAL_TOLERANCE: f64 = 0.03;

/// The poses near a rotation about `centre` that put the most samples onto the surface, best first; at most
/// `most`, with a support (0 to 1) of at least `least`.
pub(crate) fn poses(
    lookup: &Lookup,
    samples: &[Sample],
    centre: &Point3<f64>,
    least: f64,
    most: usize,
) -> Vec<Similarity3<f64>> {
    let about =
        |i| Similarity3::from_isometry(nalgebra::Isometry3::rotation_wrt_point(rotation(i), *centre), 1.0);
    let all = (0..COUNT).map(about).collect();
    let looks = &samples[..samples.len().min(LOOKS)];
    let support = |pose: &Similarity3<f64>| rough::agreement(lookup, looks, &pose.map(), TOLERANCE);
    let mut found = ranked(all, support);
    found.retain(|r| r.support >= BEFORE * least);
    let found = distinct(&found, looks, SAME[0], ROUGH);
    let found: Vec<_> = found.par_iter().map(|r| rough::icp(lookup, samples, &r.pose)).collect();
    let support = |pose: &Similarity3<f64>| rough::agreement(lookup, samples, &pose.map(), FINAL_TOLERANCE);
    let found = distinct(&ranked(found, support), looks, SAME[1], most);
    found.into_iter().filter(|r| r.support >= least).map(|r| r.pose).collect()
}

fn rotation(i: usize) -> UnitQuaternion<f64> {
    let s = i as f64 + 0.5;
    let t = s / COUNT as f64;
    let (r, rest) = (t.sqrt(), (1.0 - t).sqrt());
    let (alpha, beta) = (TAU * s / SQRT_2, TAU * s / PSI);
    let q = Quaternion::new(r * alpha.sin(), r * alpha.cos(), rest * beta.sin(), rest * beta.cos());
    UnitQuaternion::from_quaternion(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rotation_is_far() {
        // Any other sequence of rotations will do as a probe.
        for i in 0..500 {
            let t = |step: f64| (0.3 + f64::from(i) * step).fract() - 0.5;
            let q = Quaternion::new(t(0.8567), t(0.7338), t(0.6287), t(0.5385));
            let probe = UnitQuaternion::from_quaternion(q);
            let nearest = (0..COUNT).map(|i| rotation(i).angle_to(&probe)).fold(f64::INFINITY, f64::min);
            assert!(nearest.to_degrees() < 15.0, "{}", nearest.to_degrees());
        }
    }
}
