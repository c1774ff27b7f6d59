//! The test that every copy passes before it is handed out: is the mark in it, and would it survive a little noise, and a
//! little noise and simplification?

use super::error::EmbedError;
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero_basis::Basis;
use sombrero_extraction::Whole;
use sombrero_progressive::simplify;
use sombrero_search::Model;
use sombrero_spatial::{Surface, sample_ball};
use sombrero_stats::{WatermarkTestOptions, watermark_test};
use sombrero_watermark::{EPSILONS, Key};

/// The paper's attack C: noise of this amplitude, in largest sides of the part that it falls on, hides no usual mark.
const TEST_NOISE: f64 = 0.002;

/// The noise that comes with simplification to half.
const LIGHT_NOISE: f64 = 0.001;

/// Larger models bear simplification better than noise, and it takes longer than all else.
const MOST_SIMPLIFIED: usize = 100_000;

/// Strengths are tried in steps of this factor.
const STEP: f64 = 1.25;

/// What is known of an original before its first copy is tested: what the least squares read, for ε = 1, from unmarked
/// originals to which something was done. They are linear: what they read from a copy is that and the mark.
#[derive(Debug)]
pub(super) struct SelfTest {
    whole: Whole,
    /// With noise of [`TEST_NOISE`].
    noise: Vec<Option<f64>>,
    /// With noise of [`LIGHT_NOISE`] and half of the faces; `None` for a large model.
    halved: Option<Vec<Option<f64>>>,
}

/// log10 p of the paper's test on a copy.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tested {
    /// On the stored positions as they are.
    pub(super) log10_p: f64,
    /// After noise.
    pub(super) after_noise: f64,
    /// After a little noise and simplification to half.
    pub(super) halved: Option<f64>,
    /// The smallest ε, in steps, at which the worse of the last two would be what was asked for; `None` beyond all that can
    /// be asked for.
    pub(super) enough: Option<f64>,
}

impl SelfTest {
    /// `coarser` is [`coarser`] of the model.
    pub(super) fn new(
        model: &Model,
        basis: &Basis,
        coarser: Option<Vec<Option<Vector3<f64>>>>,
    ) -> Result<Self, EmbedError> {
        let points = &model.soup().points;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let noise: Vec<Vector3<f64>> =
            model.part_sides().into_iter().map(|side| sample_ball(&mut rng) * (TEST_NOISE * side)).collect();
        let moved = |by: &dyn Fn(usize) -> Option<Vector3<f64>>| -> Vec<Option<Point3<f64>>> {
            points.iter().enumerate().map(|(i, p)| Some(p + by(i)?)).collect()
        };
        let noisy = moved(&|i| Some(noise[i]));
        let halved = coarser.map(|shift| moved(&|i| Some(shift[i]? + noise[i] * (LIGHT_NOISE / TEST_NOISE))));
        let suspects: Vec<&[_]> =
            [Some(&noisy), halved.as_ref()].into_iter().flatten().map(|s| &s[..]).collect();
        let whole = Whole::new(basis);
        let read = whole.extract(basis, 1.0, points, &suspects)?;
        let mut read = read.into_iter().map(|found| found.coefficients);
        Ok(Self { noise: read.next().unwrap_or_default(), halved: read.next(), whole })
    }

    /// The test of the stored positions of a copy; `wanted` is the log10 p that `enough` would give.
    pub(super) fn of_copy(
        &self,
        model: &Model,
        basis: &Basis,
        key: &Key,
        stored: &[Point3<f64>],
        wanted: f64,
    ) -> Result<Tested, EmbedError> {
        let found: Vec<Option<Point3<f64>>> =
            model.points_from_stored(stored).into_iter().map(Some).collect();
        let epsilon = key.parameters.epsilon;
        let clean = self.whole.extract(basis, epsilon, &model.soup().points, &[&found])?;
        let clean = clean.into_iter().next().map(|clean| clean.coefficients).unwrap_or_default();
        // Lengths agree by construction; a test that cannot be made is no evidence.
        let log10_p = |found: &[Option<f64>]| {
            let test = watermark_test(&key.watermark, found, &WatermarkTestOptions::default());
            test.map_or(0.0, |test| test.log10_p())
        };
        let after = |done: &[Option<f64>], epsilon: f64| {
            let both: Vec<Option<f64>> =
                clean.iter().zip(done).map(|(w, n)| Some((*w)? + (*n)? / epsilon)).collect();
            log10_p(&both)
        };
        let weakest = |epsilon: f64| {
            let halved = self.halved.as_ref().map_or(f64::NEG_INFINITY, |halved| after(halved, epsilon));
            after(&self.noise, epsilon).max(halved)
        };
        let steps = std::iter::successors(Some(epsilon), |epsilon| Some(epsilon * STEP));
        let possible = steps.take_while(|epsilon| epsilon <= EPSILONS.end());
        Ok(Tested {
            log10_p: log10_p(&clean),
            after_noise: after(&self.noise, epsilon),
            halved: self.halved.as_ref().map(|halved| after(halved, epsilon)),
            enough: possible.into_iter().find(|&epsilon| weakest(epsilon) <= wanted),
        })
    }
}

/// From each point to the surface that simplification to half of the faces leaves; `None` for a large model, or when nothing
/// is left.
pub(super) fn coarser(model: &Model) -> Option<Vec<Option<Vector3<f64>>>> {
    let soup = model.soup();
    if soup.triangles.len() > MOST_SIMPLIFIED {
        return None;
    }
    let half = simplify(soup, 0.5);
    if half.triangles.is_empty() {
        return None;
    }
    let closest = Surface::new(&half.points, &half.triangles).closest_many(&soup.points);
    Some(closest.into_iter().zip(&soup.points).map(|(c, p)| Some(c?.point - p)).collect())
}
