//! Landmarks of the original, prepared once.

use rayon::prelude::*;

use crate::starts::landmark::{Cloud, Features, Landmark, RUNG, SPAN};
use crate::surface::sample::samples;
use crate::surface::shape::Shape;

/// Landmarks of the reference.
const COUNT: usize = 1_500;
/// Largest radius of a description, in units of the diagonal.
const LARGEST: f64 = 0.17;
/// What a feature varies at least, so that one that is the same everywhere does not decide.
const LEAST_DEVIATION: f32 = 0.02;

/// What the search for poses needs of the original.
#[derive(Debug, Clone)]
pub(crate) struct Landmarks {
    pub(crate) landmarks: Vec<Landmark>,
    /// Area of the surface, in squares of its diagonal.
    pub(crate) area: f64,
    /// One over the standard deviation of each feature.
    pub(crate) weights: Features,
}

impl Landmarks {
    pub(crate) fn new(shape: &Shape) -> Self {
        let cloud = Cloud::new(shape, 1.0);
        let radii = ladder(0, 0);
        let landmarks: Vec<_> =
            samples(shape, COUNT).par_iter().map(|s| cloud.landmark(s.point, &radii)).collect();
        let weights = weights(&landmarks);
        Self { landmarks, area: shape.moments.area, weights }
    }
}

/// The radii of a description, and some more of the ladder below and above.
pub(crate) fn ladder(below: usize, above: usize) -> Vec<f64> {
    let rungs = 0..SPAN + 1 + below + above;
    rungs.map(|rung| LARGEST * RUNG.powi(rung as i32 - (SPAN + below) as i32)).collect()
}

fn weights(landmarks: &[Landmark]) -> Features {
    let features = || landmarks.iter().flat_map(|l| &l.views).map(|v| v.features);
    let count = features().count().max(1) as f32;
    std::array::from_fn(|k| {
        let mean = features().map(|f| f[k]).sum::<f32>() / count;
        let variance = features().map(|f| (f[k] - mean).powi(2)).sum::<f32>() / count;
        1.0 / variance.sqrt().max(LEAST_DEVIATION)
    })
}
