//! Landmarks of the original, prepared once.

use rayon::prelude::*;
use sombrero_landmarks::{Cloud, Features, Landmark, SurfacePoint, ladder};

use crate::starts::looks::Looks;
use crate::surface::sample::{Sample, samples};
use crate::surface::shape::Shape;

/// Landmarks of the reference.
const COUNT: usize = 1_500;
/// Samples that stand for a surface.
const SAMPLES: usize = 6_000;
/// Largest radius of a description, in units of the diagonal.
pub(crate) const LARGEST: f64 = 0.17;

/// What the search for poses needs of the original.
#[derive(Debug, Clone)]
pub(crate) struct Landmarks {
    pub(crate) landmarks: Vec<Landmark>,
    /// Area of the surface, in squares of its diagonal.
    pub(crate) area: f64,
    looks: Looks,
}

impl Landmarks {
    pub(crate) fn new(shape: &Shape) -> Self {
        let cloud = cloud(shape, 1.0);
        let radii = ladder(LARGEST, 0, 0);
        let landmarks: Vec<_> =
            samples(shape, COUNT).par_iter().map(|s| cloud.landmark(s.point, &radii)).collect();
        // One radius, so one view each.
        let features: Vec<_> = landmarks.iter().flat_map(|l| &l.views).map(|v| v.features).collect();
        Self { landmarks, area: shape.moments.area, looks: Looks::new(&features) }
    }

    /// The `most` landmarks that look most like one with these features, the most alike first.
    pub(crate) fn alike(&self, features: &Features, most: usize) -> Vec<usize> {
        self.looks.nearest(features, most)
    }
}

/// The surface as the descriptions see it; `orientation` is -1 for one whose normals are to be turned.
pub(crate) fn cloud(shape: &Shape, orientation: f64) -> Cloud {
    let turned =
        |s: Sample| SurfacePoint { point: s.point, normal: s.with_unit_normal().normal * orientation };
    Cloud::new(samples(shape, SAMPLES).into_iter().map(turned).collect(), shape.moments.area)
}
