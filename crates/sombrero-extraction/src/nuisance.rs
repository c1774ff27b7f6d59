//! What an attacker did to the shape beside hiding the mark: displacement fields that are solved for together with
//! the coefficients, so that they are not mistaken for noise or for the mark.
//!
//! A nuisance is a linear combination N β of known fields over the original's vertices: one family of smooth deformations
//! of space (`deformation.rs`), and modes that follow from the original's own shape ([`Modes`]).
//!
//! **Adding a nuisance**, say an offset along the normals, takes
//!
//! 1. a file with a function from the original to its fields, one vector for each vertex and
//!    field, scaled such that 1 of it is much;
//! 2. a row of [`Modes`] (its variant, its place in `ALL`, its function in `fields`).
//!
//! The search tries it with a row of `sombrero-search/src/nuisances.rs`. Every row counts: p is multiplied by their number.
//!
//! Fields must follow from the original alone. Whatever they take away from w* they take away from its precision too.

use crate::deformation::Deformation;
use nalgebra::Vector3;
use sombrero_mesh::{Soup, smoothing_modes};

/// A family of fields that follow from the original's shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Modes {
    /// What smoothing filters do to the original: 4 columns.
    Smoothing,
}

impl Modes {
    /// All families, in the order of their declaration.
    pub const ALL: [Self; 1] = [Self::Smoothing];

    /// The fields, one vector for each vertex of `original`.
    pub(crate) fn fields(self, original: &Soup) -> Vec<Vec<Vector3<f64>>> {
        match self {
            Self::Smoothing => smoothing_modes(original),
        }
    }
}

/// A set of fields that is solved for beside the coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Nuisance {
    /// Smooth deformations of space.
    pub deformation: Deformation,
    /// Fields that follow from the original's shape: `&[Modes::Smoothing]` where the suspect may have been smoothed.
    pub modes: &'static [Modes],
}
