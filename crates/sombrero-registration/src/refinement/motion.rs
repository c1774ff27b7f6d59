//! The maps that ICP may choose from: similarities and affine maps.

use nalgebra::{Affine3, Similarity3};

use crate::refinement::affine_map::AffineMap;
use crate::refinement::pairs::Pair;
use crate::refinement::{affine_step, similarity_step};
use crate::surface::frame;
use crate::surface::shape::Shape;

/// A family of maps with a Gauss-Newton step of the point-to-plane distance.
pub(crate) trait Motion: Copy + Send + Sync {
    /// A map of the family between model frames, as a caller gets it.
    type Model;

    /// A similarity as a member of the family.
    fn of(similarity: &Similarity3<f64>) -> Self;

    /// This as a map of points and normals.
    fn map(&self) -> AffineMap;

    /// The change that weighted pairs ask for.
    fn step(pairs: &[Pair], weights: &[f64]) -> Self;

    /// First `first`, then this.
    fn after(&self, first: &Self) -> Self;

    /// The map in model units, between the model frames; `None` when the sizes are too far apart for the numbers.
    fn to_model(&self, reference: &Shape, suspect: &Shape) -> Option<Self::Model>;
}

impl Motion for Similarity3<f64> {
    type Model = Self;

    fn of(similarity: &Similarity3<f64>) -> Self {
        *similarity
    }

    fn map(&self) -> AffineMap {
        AffineMap::from(self)
    }

    fn step(pairs: &[Pair], weights: &[f64]) -> Self {
        similarity_step::step(pairs, weights)
    }

    fn after(&self, first: &Self) -> Self {
        self * first
    }

    fn to_model(&self, reference: &Shape, suspect: &Shape) -> Option<Self> {
        frame::to_model(reference, suspect, self)
    }
}

impl Motion for AffineMap {
    type Model = Affine3<f64>;

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
        Self::after(self, first)
    }

    fn to_model(&self, reference: &Shape, suspect: &Shape) -> Option<Affine3<f64>> {
        frame::affine_to_model(reference, suspect, &self.linear, &self.shift)
    }
}
