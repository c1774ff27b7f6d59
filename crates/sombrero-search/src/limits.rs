//! Limits that several routes share.

/// The number of poses, and of matchings of vertices with all that is solved for, that are tried at most: a cube has as many.
pub(crate) const MOST_POSES: usize = 24;

/// The number of matchings of vertices that are tried at most: an icosahedron has sixty, a cylinder of 120 segments 240. Of meshes with
/// many vertices, which take longer, fewer: as many as have so many vertices together.
const MOST_MATCHINGS: usize = 240;
const MOST_MATCHED_VERTICES: usize = 1 << 20;

/// [`MOST_MATCHINGS`] of so many vertices.
pub(crate) fn most_matchings(vertices: usize) -> usize {
    (MOST_MATCHED_VERTICES / vertices.max(1)).clamp(MOST_POSES, MOST_MATCHINGS)
}

/// The root mean square distance, in largest sides of the original, below which a suspect's vertices do correspond, so
/// that surfaces need not be compared.
pub(crate) const CORRESPONDS: f64 = 0.01;

/// Matchings of vertices are told apart by what a similarity leaves of them: by this factor, and this many largest sides.
pub(crate) const TOLD_APART: (f64, f64) = (1.5, 5e-4);
