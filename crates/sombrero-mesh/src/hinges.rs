//! Edges that exactly two faces meet at, with what lies on both sides.

use crate::sides::{Sides, apex, ends};

/// An edge with the two faces beside it, which run along it in opposite directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Hinge {
    /// The edge's ends, ascending; the first face runs from the first to the second where the faces agree.
    pub ends: [u32; 2],
    /// The faces' other corners.
    pub opposite: [u32; 2],
    /// The faces.
    pub faces: [u32; 2],
}

/// The hinges of `triangles`, by (smaller end, larger end): edges that have exactly two faces. O(n) for meshes of bounded
/// valence.
///
/// ```
/// let hinges = sombrero_mesh::hinges(4, &[[0, 1, 2], [0, 2, 3]]);
/// assert_eq!((hinges.len(), hinges[0].ends), (1, [0, 2]));
/// assert_eq!((hinges[0].faces, hinges[0].opposite), ([1, 0], [3, 1]));
/// ```
///
/// # Panics
/// When a corner is not below `vertex_count`.
pub fn hinges(vertex_count: usize, triangles: &[[u32; 3]]) -> Vec<Hinge> {
    let grouped = Sides::group(vertex_count, triangles);
    let pairs = grouped.groups().filter(|group| group.len() == 2);
    let hinge = |pair: &[u32]| {
        let [one, other] = [pair[0] as usize, pair[1] as usize];
        let (tail, tip) = ends(triangles, one);
        let [first, second] = if tail < tip { [one, other] } else { [other, one] };
        Hinge {
            ends: [tail.min(tip), tail.max(tip)],
            opposite: [apex(triangles, first), apex(triangles, second)],
            faces: [(first / 3) as u32, (second / 3) as u32],
        }
    };
    pairs.map(hinge).collect()
}
