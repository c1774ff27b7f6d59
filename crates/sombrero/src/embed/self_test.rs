//! The test that every copy passes before it is handed out: is the mark in it, and would it survive a little noise?

use super::error::EmbedError;
use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero_basis::Basis;
use sombrero_extraction::extract;
use sombrero_search::Model;
use sombrero_spatial::sample_ball;
use sombrero_stats::{WatermarkTestOptions, watermark_test};
use sombrero_watermark::Key;

/// The paper's attack C: noise of this amplitude, in largest sides of the part that it falls on, hides no usual mark.
const TEST_NOISE: f64 = 0.002;

/// What is known of an original before its first copy is tested.
#[derive(Debug)]
pub(super) struct SelfTest {
    /// What the least squares read from an unmarked original with noise of [`TEST_NOISE`], for ε = 1.
    noise: Vec<Option<f64>>,
}

impl SelfTest {
    pub(super) fn new(model: &Model, basis: &Basis) -> Result<Self, EmbedError> {
        let points = &model.soup().points;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let noise = |(p, side): (&Point3<f64>, f64)| Some(p + sample_ball(&mut rng) * (TEST_NOISE * side));
        let noisy: Vec<_> = points.iter().zip(model.part_sides()).map(noise).collect();
        Ok(Self { noise: extract(basis, 1.0, points, &noisy)?.coefficients })
    }

    /// log10 p of the paper's test on the stored positions of a copy, as they are and after noise. Least squares are
    /// linear: what they read from the noisy copy is what they read from both.
    pub(super) fn log10_p(
        &self,
        model: &Model,
        basis: &Basis,
        key: &Key,
        stored: &[Point3<f64>],
    ) -> Result<[f64; 2], EmbedError> {
        let found: Vec<Option<Point3<f64>>> =
            model.points_from_stored(stored).into_iter().map(Some).collect();
        let epsilon = key.parameters.epsilon;
        let clean = extract(basis, epsilon, &model.soup().points, &found)?.coefficients;
        let noisy: Vec<Option<f64>> =
            clean.iter().zip(&self.noise).map(|(w, n)| Some((*w)? + (*n)? / epsilon)).collect();
        // Lengths agree by construction; a test that cannot be made is no evidence.
        let log10_p = |found: &[Option<f64>]| {
            let test = watermark_test(&key.watermark, found, &WatermarkTestOptions::default());
            test.map_or(0.0, |test| test.log10_p())
        };
        Ok([log10_p(&clean), log10_p(&noisy)])
    }
}
