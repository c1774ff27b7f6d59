//! The maps that ICP may choose from: similarities and affine maps.

use nalgebra::Similarity3;

use crate::affine_map::AffineMap;
use crate::pairs::Pair;
use crate::{affine_step, step};

/// A family of maps with a Gauss-Newton step of the point-to-plane distance.
pub(crate) trait Motion: Copy + Send + Sync {
    /// A similarity as a member of the family.
    fn of(similarity: &Similarity3<f64>) -> Self;

    /// As a map of points and normals.
    fn map(&self) -> AffineMap;

    /// The change that weighted pairs ask for.
    fn step(pairs: &[Pair], weights: &[f64]) -> Self;

    /// First `first`, then this.
    fn after(&self, first: &Self) -> Self;
}

impl Motion for Similarity3<f64> {
    fn of(similarity: &Similarity3<f64>) -> Self {
        *similarity
    }

    fn map(&self) -> AffineMap {
        AffineMap::from(self)
    }

    fn step(pairs: &[Pair], weights: &[f64]) -> Self {
        step::step(pairs, weights)
    }

    fn after(&self, first: &Self) -> Self {
        self * first
    }
}

impl Motion for AffineMap {
    fn of(similarity: &Similarity3<f64>) -> Self {
        Self::from(similarity)
    }

    fn map(&self) -> AffineMap {
        *self
    }

    fn step(pairs: &[Pair], weights: &[f64]) -> Self {
        affine_step::step(pairs, weights)
    }

    fn after(&self, first: &Self) -> Self {
        Self::new(self.linear * first.linear, self.linear * first.shift + self.shift)
    }
}
