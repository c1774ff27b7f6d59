//! Every way to number one connected mesh as another of the same connectivity.

use super::connectivity::{Connectivity, turned};
use super::flood::Assignment;
use super::signature::{self, Lookalikes};

/// A search for a first numbering ends after so many walks over the mesh, one for others after so many more steps.
const WALKS: usize = 16;
const STEPS_TO_OTHERS: usize = 1 << 25;

/// Shows `visit` every numbering of the vertices of one connected mesh as those of another: for each vertex of the first mesh the
/// vertex of the second that it is. Whether all were seen: a search ends after walks over some 33 million faces.
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
/// let mut found = Vec::new();
/// assert!(isomorphisms(&faces, 4, &faces, 4, &mut |numbering| found.push(numbering.to_vec())));
/// assert_eq!(found.len(), 24);
/// ```
///
/// [`match_connectivity`]: crate::match_connectivity
pub fn isomorphisms(
    first: &[[u32; 3]],
    first_vertices: usize,
    second: &[[u32; 3]],
    second_vertices: usize,
    visit: &mut dyn FnMut(&[Option<u32>]),
) -> bool {
    let a = Connectivity::new(first, first_vertices);
    let b = Connectivity::new(second, second_vertices);
    if a.face_count() != b.face_count() || a.face_count() == 0 {
        return true;
    }
    let in_a = signature::levels(&a);
    let mut all = true;
    for b in [b.mirrored(), b].iter().rev() {
        let in_b = signature::levels(b);
        let (Some(in_a), Some(in_b)) = (in_a.last(), in_b.last()) else { continue };
        all &= laid(&a, b, &Lookalikes::new(in_a, in_b), visit);
    }
    all
}

/// Lays the rarest face of `b` on all faces of `a` that look like it. Whether on all.
fn laid(
    a: &Connectivity,
    b: &Connectivity,
    lookalikes: &Lookalikes,
    visit: &mut dyn FnMut(&[Option<u32>]),
) -> bool {
    let faces = 0..b.face_count() as u32;
    // A face that is nowhere shows that there is nothing to find.
    let Some(seed) = faces.min_by_key(|&face| (lookalikes.count(face), face)) else { return true };
    let mut assignment = Assignment::new(a, b);
    let mut of_first = vec![None; a.valence.len()];
    let (mut walked, mut limit) = (0, WALKS * b.face_count());
    for side in lookalikes.of(seed).flat_map(|face| [0, 1, 2].map(|k| turned(3 * face, k))) {
        if walked > limit {
            return false;
        }
        let (placement, steps) = assignment.flood(a, b, (seed, side), true);
        walked += steps;
        if let Some(placement) = placement.filter(|p| p.is_isomorphism() && p.faces.len() == b.face_count()) {
            limit = limit.max(STEPS_TO_OTHERS);
            placement.vertices.iter().for_each(|&(in_b, in_a)| of_first[in_a as usize] = Some(in_b));
            visit(&of_first);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    fn all(first: &[[u32; 3]], n: usize, second: &[[u32; 3]], m: usize) -> Vec<Vec<Option<u32>>> {
        let mut found = Vec::new();
        assert!(isomorphisms(first, n, second, m, &mut |numbering| found.push(numbering.to_vec())));
        found
    }

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
                let found = all(&soup.triangles, count, &other, count);
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
        assert_eq!(all(&sphere.triangles, count, &sphere.triangles, count).len(), 120);
    }

    #[test]
    fn a_turned_body_goes_onto_itself_in_as_many_ways_as_it_has_segments() {
        // Around the middle the wrong turns of a face are noticed late; they must not end the search. It may stand on its head, and be a mirror image.
        let vase = shapes::vase(56, 36);
        let count = vase.points.len();
        let place = |v: usize| (v * 1007 + 7) % count;
        let other: Vec<_> =
            vase.triangles.iter().rev().map(|t| t.map(|v| place(v as usize) as u32)).collect();
        let found = all(&vase.triangles, count, &other, count);
        assert_eq!(found.len(), 4 * 56);
        assert!(found.contains(&(0..count).map(|v| Some(place(v) as u32)).collect()));
    }

    #[test]
    fn a_search_that_takes_too_long_says_so() {
        let grid = shapes::torus(120, 100, 2.0, 0.5);
        let n = grid.points.len();
        let mut seen = 0;
        assert!(!isomorphisms(&grid.triangles, n, &grid.triangles, n, &mut |_| seen += 1));
        assert!(seen > 100);
    }

    #[test]
    fn other_connectivity_and_nothing_have_no_numbering() {
        let (sphere, bumpy) = (shapes::sphere(2), shapes::bumpy_sphere(300));
        let [a, b] = [&sphere, &bumpy].map(|s| s.points.len());
        assert!(all(&sphere.triangles, a, &bumpy.triangles, b).is_empty());
        assert!(all(&[], 0, &[], 0).is_empty());
        assert!(all(&[[0, 0, 9]], 1, &[[0, 1, 2]], 3).is_empty());
    }
}
