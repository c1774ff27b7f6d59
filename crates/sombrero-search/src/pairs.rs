//! Places on a suspect with the original's points that they belong to.

use crate::placement::Placement;
use nalgebra::Point3;
use sombrero_mesh::{BoundingBox, Soup};
use sombrero_registration::similarity_of_pairs;

/// A mirror image has to fit better by this factor: what fits both ways was not mirrored.
const FAR_BETTER: f64 = 0.5;

/// Found points that have a face, each (on the suspect, on the original).
pub(crate) struct Pairs(Vec<(Point3<f64>, Point3<f64>)>);

impl Pairs {
    /// Those of the places `found`, one for each of the original's points, that are known.
    pub(crate) fn new(original: &Soup, found: &[Option<Point3<f64>>]) -> Self {
        let seen = found.iter().zip(&original.points).zip(original.used()).filter(|(_, used)| *used);
        Self(seen.filter_map(|((p, q), _)| p.map(|p| (p, *q))).collect())
    }

    /// The similarity that brings the found points nearest to the original's, after a reflection where that fits far better.
    pub(crate) fn placement(&self) -> Option<Placement> {
        let fitted = |mirrored: bool| {
            let pairs = self.0.iter().map(|(p, q)| (if mirrored { Placement::reflected(p) } else { *p }, *q));
            let placement =
                Placement { similarity: similarity_of_pairs(&pairs.collect::<Vec<_>>())?, mirrored };
            Some((self.rms(&placement), placement))
        };
        match (fitted(false), fitted(true)) {
            (Some(upright), Some(mirrored)) if mirrored.0 < FAR_BETTER * upright.0 => Some(mirrored.1),
            (Some(upright), _) => Some(upright.1),
            (None, mirrored) => mirrored.map(|fit| fit.1),
        }
    }

    /// The largest side of the original's points that were found; 0 of none.
    pub(crate) fn side(&self) -> f64 {
        BoundingBox::of(self.0.iter().map(|pair| &pair.1)).map_or(0.0, |bounds| bounds.largest_side())
    }

    /// Root mean square distance of the found points, placed so, from the original's, in model units.
    pub(crate) fn rms(&self, placement: &Placement) -> f64 {
        (self.sum_of_squares(placement) / self.0.len().max(1) as f64).sqrt()
    }

    /// Sum of the squared distances of the found points, placed so, from the original's.
    pub(crate) fn sum_of_squares(&self, placement: &Placement) -> f64 {
        self.0.iter().map(|(p, q)| (placement.of(p) - q).norm_squared()).sum()
    }
}

impl FromIterator<(Point3<f64>, Point3<f64>)> for Pairs {
    fn from_iter<I: IntoIterator<Item = (Point3<f64>, Point3<f64>)>>(pairs: I) -> Self {
        Self(pairs.into_iter().collect())
    }
}
