//! Global topology: components, boundary loops, Euler characteristic, genus.

use crate::{HalfedgeId, Mesh, VertexId};

/// The connected component of each vertex, and how many components there are.
///
/// Components are numbered by their smallest vertex. The slice has [`Mesh::vertex_bound`] entries;
/// entries of removed vertices are `u32::MAX`.
pub fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut component = vec![u32::MAX; mesh.vertex_bound()];
    let mut count = 0;
    let mut stack: Vec<VertexId> = Vec::new();
    for seed in mesh.vertices() {
        if component[seed.index()] != u32::MAX {
            continue;
        }
        component[seed.index()] = count;
        stack.push(seed);
        while let Some(v) = stack.pop() {
            for w in mesh.vertices_around_vertex(v) {
                if component[w.index()] == u32::MAX {
                    component[w.index()] = count;
                    stack.push(w);
                }
            }
        }
        count += 1;
    }
    (component, count as usize)
}

/// One boundary halfedge of each boundary loop, the one of smallest index, in index order.
/// [`Mesh::halfedges_along`] walks the rest of its loop.
pub fn boundary_loops(mesh: &Mesh) -> Vec<HalfedgeId> {
    let mut seen = vec![false; mesh.halfedge_bound()];
    let mut loops = Vec::new();
    for h in mesh.halfedges().filter(|&h| mesh.face(h).is_none()) {
        if seen[h.index()] {
            continue;
        }
        loops.push(h);
        mesh.halfedges_along(h).for_each(|h| seen[h.index()] = true);
    }
    loops
}

/// Vertices - edges + faces.
pub fn euler_characteristic(mesh: &Mesh) -> i64 {
    mesh.vertex_count() as i64 - mesh.edge_count() as i64 + mesh.face_count() as i64
}

/// The genus of a mesh of one component, its holes capped; `None` for more components or no face.
///
/// 2 - 2 g = V - E + F + (number of boundary loops).
pub fn genus(mesh: &Mesh) -> Option<usize> {
    let (_, count) = components(mesh);
    let capped = euler_characteristic(mesh) + boundary_loops(mesh).len() as i64;
    (count == 1).then(|| usize::try_from((2 - capped) / 2).ok()).flatten()
}
