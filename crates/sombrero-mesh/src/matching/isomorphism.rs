//! Every way to number one connected mesh as another of the same connectivity.

use super::connectivity::{Connectivity, turned};
use super::flood::Assignment;
use super::signature::{self, Lookalikes};

/// The walks over the mesh, besides successful ones, after which a search ends.
const WALKS: usize = 16;

/// Finds every numbering of the vertices of one connected mesh as those of another, at most `most` of them: for each
/// vertex of the first mesh the vertex of the second that it is.
///
/// Faces are corner indices below the vertex counts. A numbering lays each face of the second mesh on a face of the first, the
/// same way round in all of them or, in a mirror image, the other way round in all. Where faces of the first leave a vertex
/// without a face, its entry is `None`. Of meshes that do not hang together through edges that two faces share in opposite
/// directions nothing is found. A grid has as many numberings as places; who needs one of them reads [`match_connectivity`].
///
/// Time is O(n log n) for the first and O(n) for each further one; memory is O(n).
///
/// ```
/// use sombrero_mesh::isomorphisms;
///
/// // A tetrahedron turns in twelve ways, and has twelve mirror images.
/// let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
/// assert_eq!(isomorphisms(&faces, 4, &faces, 4, 100).len(), 24);
/// assert_eq!(isomorphisms(&faces, 4, &faces[..3], 4, 100).len(), 0);
/// ```
///
/// [`match_connectivity`]: crate::match_connectivity
pub fn isomorphisms(
    first: &[[u32; 3]],
    first_vertices: usize,
    second: &[[u32; 3]],
    second_vertices: usize,
    most: usize,
) -> Vec<Vec<Option<u32>>> {
    let a = Connectivity::new(first, first_vertices);
    let b = Connectivity::new(second, second_vertices);
    if a.face_count() != b.face_count() || a.face_count() == 0 {
        return Vec::new();
    }
    let in_a = signature::levels(&a);
    let mut found = Vec::new();
    for b in [b.mirrored(), b].iter().rev() {
        let in_b = signature::levels(b);
        let (Some(in_a), Some(in_b)) = (in_a.last(), in_b.last()) else { continue };
        laid(&a, b, &Lookalikes::new(in_a, in_b), most, &mut found);
    }
    found
}

/// Lays the rarest face of `b` on all faces of `a` that look like it.
fn laid(
    a: &Connectivity,
    b: &Connectivity,
    lookalikes: &Lookalikes,
    most: usize,
    found: &mut Vec<Vec<Option<u32>>>,
) {
    let faces = 0..b.face_count() as u32;
    // A face that is nowhere shows that there is nothing to find.
    let Some(seed) = faces.min_by_key(|&face| (lookalikes.count(face), face)) else { return };
    let mut assignment = Assignment::new(a, b);
    let mut walked = 0;
    for side in lookalikes.of(seed).flat_map(|face| [0, 1, 2].map(|k| turned(3 * face, k))) {
        if found.len() >= most || walked > WALKS * b.face_count() {
            return;
        }
        let (placement, steps) = assignment.flood(a, b, (seed, side), true);
        match placement.filter(|p| p.is_isomorphism() && p.faces.len() == b.face_count()) {
            Some(placement) => {
                let mut of_first = vec![None; a.valence.len()];
                placement.vertices.iter().for_each(|&(in_b, in_a)| of_first[in_a as usize] = Some(in_b));
                found.push(of_first);
            }
            None => walked += steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    /// Vertex v becomes `a` v + `b`, modulo their number, and faces come in the opposite order.
    fn renumbered(triangles: &[[u32; 3]], count: usize, shift: usize) -> Vec<[u32; 3]> {
        let other = |v: u32| ((count - 1 - v as usize) + shift) % count;
        triangles.iter().rev().map(|&[a, b, c]| [b, c, a].map(|v| other(v) as u32)).collect()
    }

    proptest! {
        #[test]
        fn the_right_numbering_is_among_those_of_a_renumbered_mesh(shift in 0usize..1000, flip: bool) {
            for soup in [shapes::sphere(2), shapes::bust(6), shapes::part(3)] {
                let count = soup.points.len();
                let mut other = renumbered(&soup.triangles, count, shift);
                if flip {
                    other.iter_mut().for_each(|corners| corners.swap(0, 1));
                }
                let right: Vec<_> = (0..count).map(|v| Some(((count - 1 - v + shift) % count) as u32)).collect();
                let found = isomorphisms(&soup.triangles, count, &other, count, 500);
                prop_assert!(found.contains(&right));
                // Each is a numbering: every vertex once, and faces on faces.
                for numbering in &found {
                    let mut seen: Vec<u32> = numbering.iter().flatten().copied().collect();
                    seen.sort_unstable();
                    seen.dedup();
                    prop_assert_eq!(seen.len(), count);
                }
            }
        }
    }

    #[test]
    fn a_geodesic_sphere_turns_like_the_icosahedron() {
        let sphere = shapes::sphere(3);
        let count = sphere.points.len();
        assert_eq!(isomorphisms(&sphere.triangles, count, &sphere.triangles, count, 500).len(), 120);
        assert_eq!(isomorphisms(&sphere.triangles, count, &sphere.triangles, count, 7).len(), 7);
    }

    #[test]
    fn other_connectivity_and_nothing_have_no_numbering() {
        let (sphere, bumpy) = (shapes::sphere(2), shapes::bumpy_sphere(300));
        let [a, b] = [&sphere, &bumpy].map(|s| s.points.len());
        assert!(isomorphisms(&sphere.triangles, a, &bumpy.triangles, b, 9).is_empty());
        assert!(isomorphisms(&[], 0, &[], 0, 9).is_empty());
        assert!(isomorphisms(&[[0, 0, 9]], 1, &[[0, 1, 2]], 3, 9).is_empty());
    }
}
