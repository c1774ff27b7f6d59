//! The edges of triangles, numbered by (smaller end, larger end).

use crate::sides::{Sides, ends};

/// Which edge each side of a triangle lies on; edges may have any number of sides.
///
/// Side `3 f + k` runs from corner `k` of face `f` to its next corner.
///
/// ```
/// use sombrero_mesh::Edges;
///
/// let edges = Edges::new(4, &[[0, 1, 2], [0, 2, 3]]);
/// assert_eq!(edges.ends, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
/// assert_eq!(edges.of_side, [0, 3, 1, 1, 4, 2]);
/// assert_eq!(edges.sides, [1, 2, 1, 1, 1]);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Edges {
    /// The smaller and the larger end of each edge, ascending.
    pub ends: Vec<[u32; 2]>,
    /// The edge of each side.
    pub of_side: Vec<u32>,
    /// The number of sides on each edge: 1 along a rim, 2 inside a manifold.
    pub sides: Vec<u32>,
}

impl Edges {
    /// Numbers the edges of `triangles`, in O(n) for meshes of bounded valence.
    ///
    /// # Panics
    /// When a corner is not below `vertex_count`.
    pub fn new(vertex_count: usize, triangles: &[[u32; 3]]) -> Self {
        let grouped = Sides::group(vertex_count, triangles);
        let mut edges = Self { ends: Vec::new(), of_side: vec![0; 3 * triangles.len()], sides: Vec::new() };
        for (edge, group) in (0u32..).zip(grouped.groups()) {
            let (tail, tip) = ends(triangles, group[0] as usize);
            edges.ends.push([tail.min(tip), tail.max(tip)]);
            edges.sides.push(group.len() as u32);
            group.iter().for_each(|&side| edges.of_side[side as usize] = edge);
        }
        edges
    }

    /// How many edges there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no edge.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}
