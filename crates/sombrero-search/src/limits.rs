//! Limits that several routes share.

/// The number of poses, and of matchings of vertices, that are tried at most: a cube has as many.
pub(crate) const MOST_POSES: usize = 24;

/// The root mean square distance, in largest sides of the original, below which a suspect's vertices do correspond, so
/// that surfaces need not be compared.
pub(crate) const CORRESPONDS: f64 = 0.01;

/// Matchings of vertices are told apart by what a similarity leaves of them: by this factor, and this many largest sides.
pub(crate) const TOLD_APART: (f64, f64) = (1.5, 5e-4);
