//! Places on a suspect with the original's points that they belong to.

use nalgebra::{Point3, Similarity3};
use sombrero_mesh::Soup;
use sombrero_registration::similarity_of_pairs;

/// Found points that have a face, each (on the suspect, on the original).
pub(crate) struct Pairs(Vec<(Point3<f64>, Point3<f64>)>);

impl Pairs {
    /// Those of the places `found`, one for each of the original's points, that are known.
    pub(crate) fn new(original: &Soup, found: &[Option<Point3<f64>>]) -> Self {
        let seen = found.iter().zip(&original.points).zip(original.used()).filter(|(_, used)| *used);
        Self(seen.filter_map(|((p, q), _)| p.map(|p| (p, *q))).collect())
    }

    /// The similarity that brings the found points nearest to the original's.
    pub(crate) fn similarity(&self) -> Option<Similarity3<f64>> {
        similarity_of_pairs(&self.0)
    }

    /// Root mean square distance of the found points, in this pose, from the original's, in model units.
    pub(crate) fn rms(&self, pose: &Similarity3<f64>) -> f64 {
        let squares: f64 = self.0.iter().map(|(p, q)| (pose * p - q).norm_squared()).sum();
        (squares / self.0.len().max(1) as f64).sqrt()
    }
}
