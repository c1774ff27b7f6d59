//! The neighbours of each vertex, one list behind the other.

/// The vertices that each vertex has a face in common with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rings {
    /// Where each vertex's neighbours start in `all`.
    starts: Vec<usize>,
    all: Vec<u32>,
}

impl Rings {
    /// The rings of `vertices` vertices. Faces with indices out of range are passed over. O(n log n).
    ///
    /// ```
    /// let rings = sombrero_mesh::Rings::new(4, &[[0, 1, 2], [0, 2, 3]]);
    /// assert_eq!(rings.of(0), [1, 2, 3]);
    /// assert_eq!(rings.of(1), [0, 2]);
    /// ```
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mut pairs: Vec<(u32, u32)> = triangles
            .iter()
            .filter(|corners| corners.iter().all(|&v| (v as usize) < vertices))
            .flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)])
            .filter(|(a, b)| a != b)
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; vertices + 1];
        pairs.iter().for_each(|&(v, _)| starts[v as usize + 1] += 1);
        (0..vertices).for_each(|v| starts[v + 1] += starts[v]);
        Self { starts, all: pairs.into_iter().map(|(_, w)| w).collect() }
    }

    /// The neighbours of a vertex, ascending.
    ///
    /// # Panics
    /// When there is no such vertex.
    pub fn of(&self, vertex: u32) -> &[u32] {
        &self.all[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }

    /// How many vertices there are.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
