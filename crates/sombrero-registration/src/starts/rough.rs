//! Judging and refining poses by look-ups: not exact, but a thousand times cheaper than true closest points.

use crate::refinement::affine_map::AffineMap;
use crate::refinement::motion::Motion;
use crate::refinement::pairs::Pair;
use crate::surface::lookup::Lookup;
use crate::surface::sample::Sample;

/// Cosine of the largest angle between normals that agree, 60 degrees.
const ALIKE: f64 = 0.5;
/// Steps, and the distances up to which pairs count in the first and in the last of them.
const STEPS: usize = 14;
const REACHES: [f64; 2] = [0.1, 0.03];
/// The same of some more steps.
const LAST_STEPS: usize = 8;
const LAST_REACHES: [f64; 2] = [0.03, 0.02];
/// A point farther than this from its nearest sample is not above the surface there: samples and cells are half as far apart.
const ABOVE: f64 = 0.04;

/// Mean over the samples, whose normals have length 1, of
///
/// ```text
/// max(0, 1 - (d / τ)²)   where the normals agree, else 0.
/// ```
pub(crate) fn agreement(lookup: &Lookup, samples: &[Sample], map: &AffineMap, tolerance: f64) -> f64 {
    let limit = tolerance * tolerance;
    let one = |sample: &Sample| {
        let p = map.point(&sample.point);
        let Some(near) = lookup.nearest(&p) else { return 0.0 };
        let squared = (near.point - p).norm_squared();
        let normal = map.normal(&sample.normal);
        let agree = squared < limit && normal.dot(&near.normal) > ALIKE * normal.norm();
        if agree { 1.0 - squared / limit } else { 0.0 }
    };
    samples.iter().map(one).sum::<f64>() / samples.len().max(1) as f64
}

/// A few steps of point-to-plane ICP on the pairs within a shrinking reach.
pub(crate) fn icp<M: Motion>(lookup: &Lookup, samples: &[Sample], start: &M) -> M {
    steps(lookup, samples, start, STEPS, REACHES)
}

/// Some more steps, on pairs that are nearer.
pub(crate) fn settled<M: Motion>(lookup: &Lookup, samples: &[Sample], start: &M) -> M {
    steps(lookup, samples, start, LAST_STEPS, LAST_REACHES)
}

/// How far a sample, whose normal has length 1, lies from the tangent plane at its nearest one; `None` where the normals do not
/// agree or there is none near.
pub(crate) fn height(lookup: &Lookup, sample: &Sample, map: &AffineMap) -> Option<f64> {
    let p = map.point(&sample.point);
    let near = lookup.nearest(&p)?;
    let (apart, normal) = (p - near.point, map.normal(&sample.normal));
    let agree = apart.norm_squared() < ABOVE * ABOVE && normal.dot(&near.normal) > ALIKE * normal.norm();
    agree.then(|| apart.dot(&near.face_normal).abs())
}

fn steps<M: Motion>(lookup: &Lookup, samples: &[Sample], start: &M, steps: usize, reaches: [f64; 2]) -> M {
    let mut pose = *start;
    let shrink = (reaches[1] / reaches[0]).powf(1.0 / (steps - 1) as f64);
    for number in 0..steps {
        let reach = reaches[0] * shrink.powi(number as i32);
        let (pairs, weights) = pairs(lookup, samples, &pose.map(), reach);
        pose = M::step(&pairs, &weights).after(&pose);
    }
    pose
}

/// Pairs within reach whose normals agree, and weights that fall to zero at the reach.
fn pairs(lookup: &Lookup, samples: &[Sample], map: &AffineMap, reach: f64) -> (Vec<Pair>, Vec<f64>) {
    let mut pairs = Vec::with_capacity(samples.len());
    let mut weights = Vec::with_capacity(samples.len());
    for sample in samples {
        let p = map.point(&sample.point);
        let Some(near) = lookup.nearest(&p) else { continue };
        let distance = (near.point - p).norm();
        let normal = map.normal(&sample.normal);
        if distance < reach && normal.dot(&near.normal) > ALIKE * normal.norm() {
            let (q, normal) = (near.point, near.face_normal);
            pairs.push(Pair { p, q, normal, distance, on_boundary: false, compatible: true });
            weights.push((1.0 - (distance / reach).powi(2)).powi(2));
        }
    }
    (pairs, weights)
}
