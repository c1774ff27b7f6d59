//! What else may have been done to the shape.

use sombrero_extraction::{Deformation, Modes, Nuisance};

/// The first of [`NUISANCES`] that a suspect is told by that shows nothing of the original: those of next to no cost.
pub(crate) const QUICK: usize = 2;

/// What is solved for beside the coefficients, by name, simplest first.
pub(crate) const NUISANCES: [(&str, Nuisance); 4] = [
    ("similarity", Nuisance { deformation: Deformation::Similarity, modes: &[] }),
    ("similarity, smoothing", Nuisance { deformation: Deformation::Similarity, modes: &[Modes::Smoothing] }),
    ("affine, smoothing", Nuisance { deformation: Deformation::Affine, modes: &[Modes::Smoothing] }),
    ("free form, smoothing", Nuisance { deformation: Deformation::Lattice, modes: &[Modes::Smoothing] }),
];

/// What is solved for where none of them helped: warps that are finer.
pub(crate) const WARP: [(&str, Nuisance); 1] =
    [("warp, smoothing", Nuisance { deformation: Deformation::Warp, modes: &[Modes::Smoothing] })];
