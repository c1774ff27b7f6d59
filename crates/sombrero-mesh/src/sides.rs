//! The sides of triangles, grouped by the edge that they lie on.
//!
//! Side `3 f + k` runs from corner `k` of face `f` to its next corner. Grouping is a counting sort by
//! the smaller vertex and a sort within each bucket: O(n) for meshes of bounded valence.

/// Sides ordered by (smaller vertex, larger vertex, side).
pub(crate) struct Sides {
    order: Vec<u32>,
    starts: Vec<u32>,
}

impl Sides {
    /// Groups the sides of `triangles`, whose corners are all below `vertex_count`.
    pub(crate) fn group(vertex_count: usize, triangles: &[[u32; 3]]) -> Self {
        let mut bucket = vec![0u32; vertex_count + 1];
        for side in 0..3 * triangles.len() {
            bucket[smaller(triangles, side) + 1] += 1;
        }
        for v in 0..vertex_count {
            bucket[v + 1] += bucket[v];
        }
        let mut fill = bucket.clone();
        let mut keyed = vec![0u64; 3 * triangles.len()];
        for side in 0..keyed.len() {
            let slot = &mut fill[smaller(triangles, side)];
            keyed[*slot as usize] = (larger(triangles, side) as u64) << 32 | side as u64;
            *slot += 1;
        }
        let mut starts = Vec::with_capacity(keyed.len() / 2 + 1);
        for v in 0..vertex_count {
            let (begin, end) = (bucket[v] as usize, bucket[v + 1] as usize);
            keyed[begin..end].sort_unstable();
            for i in begin..end {
                if i == begin || keyed[i] >> 32 != keyed[i - 1] >> 32 {
                    starts.push(i as u32);
                }
            }
        }
        starts.push(keyed.len() as u32);
        Self { order: keyed.into_iter().map(|key| key as u32).collect(), starts }
    }

    /// One slice of sides for each edge, ordered by (smaller vertex, larger vertex).
    pub(crate) fn groups(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|w| &self.order[w[0] as usize..w[1] as usize])
    }

    /// Marks faces whose three corners an earlier face has too: two sides on one edge with the same apex. These
    /// must be the sides of `triangles`.
    pub(crate) fn doubled_faces(&self, triangles: &[[u32; 3]]) -> Vec<bool> {
        let mut doubled = vec![false; triangles.len()];
        let mut apices: Vec<(u32, u32)> = Vec::new();
        for group in self.groups().filter(|group| group.len() > 1) {
            apices.clear();
            apices.extend(group.iter().map(|&side| (apex(triangles, side as usize), side / 3)));
            apices.sort_unstable();
            for pair in apices.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
                doubled[pair[1].1 as usize] = true;
            }
        }
        doubled
    }

    /// How many edges there are.
    pub(crate) fn edge_count(&self) -> usize {
        self.starts.len() - 1
    }
}

/// The sides of `triangles` that share their edge with no other side: `3 f + k` is the side of face f from its corner k to
/// the next one. O(n) for meshes of bounded valence, where n counts vertices up to the largest that is named.
pub fn lone_sides(triangles: &[[u32; 3]]) -> Vec<usize> {
    let vertices = triangles.iter().flatten().max().map_or(0, |&v| v as usize + 1);
    let sides = Sides::group(vertices, triangles);
    let lone = sides.groups().filter(|group| group.len() == 1);
    lone.map(|group| group[0] as usize).collect()
}

/// The vertices that a side runs from and to.
#[inline]
pub(crate) fn ends(triangles: &[[u32; 3]], side: usize) -> (u32, u32) {
    let corners = &triangles[side / 3];
    (corners[side % 3], corners[(side + 1) % 3])
}

/// The corner opposite to a side.
#[inline]
pub(crate) fn apex(triangles: &[[u32; 3]], side: usize) -> u32 {
    triangles[side / 3][(side + 2) % 3]
}

fn smaller(triangles: &[[u32; 3]], side: usize) -> usize {
    let (a, b) = ends(triangles, side);
    a.min(b) as usize
}

fn larger(triangles: &[[u32; 3]], side: usize) -> usize {
    let (a, b) = ends(triangles, side);
    a.max(b) as usize
}
