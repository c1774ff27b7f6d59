//! The edges of triangles, numbered by (smaller end, larger end).

use sombrero_mesh::Soup;

/// Which edge each side of a triangle lies on.
pub(crate) struct Edges {
    /// The smaller and the larger end of each edge, ascending.
    pub(crate) ends: Vec<[u32; 2]>,
    /// The edge of side `3 f + k`, which runs from corner `k` of face `f` to its next corner.
    pub(crate) of_side: Vec<u32>,
    /// How many sides lie on each edge.
    pub(crate) sides: Vec<u32>,
}

impl Edges {
    /// Numbers the edges of faces that have three different corners each.
    pub(crate) fn of(triangles: &[[u32; 3]]) -> Self {
        let mut keyed: Vec<([u32; 2], u32)> = triangles.iter().flat_map(sides).zip(0..).collect();
        keyed.sort_unstable();
        let mut edges = Self { ends: Vec::new(), of_side: vec![0; keyed.len()], sides: Vec::new() };
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            let number = edges.ends.len() as u32;
            edges.ends.push(group[0].0);
            edges.sides.push(group.len() as u32);
            group.iter().for_each(|&(_, side)| edges.of_side[side as usize] = number);
        }
        edges
    }

    /// How many edges there are.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }
}

/// The sides of a face as (smaller end, larger end).
fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)])
}

/// The faces whose corners are three different vertices of the soup.
pub(crate) fn whole_faces(soup: &Soup) -> Vec<[u32; 3]> {
    let known = |&v: &u32| (v as usize) < soup.points.len();
    let whole = |&[a, b, c]: &[u32; 3]| [a, b, c].iter().all(known) && a != b && b != c && c != a;
    soup.triangles.iter().copied().filter(whole).collect()
}
