//! What else may have been done to the shape.

use sombrero_extraction::{Deformation, Nuisance};

/// What is solved for beside the coefficients, by name, simplest first.
pub(crate) const NUISANCES: [(&str, Nuisance); 4] = [
    ("similarity", Nuisance { deformation: Deformation::Similarity, smoothing: false }),
    ("similarity, smoothing", Nuisance { deformation: Deformation::Similarity, smoothing: true }),
    ("affine, smoothing", Nuisance { deformation: Deformation::Affine, smoothing: true }),
    ("free form, smoothing", Nuisance { deformation: Deformation::Lattice, smoothing: true }),
];
