//! Vertices that the connectivity alone tells: renumbered, cropped, damaged and symmetric meshes.

use proptest::prelude::*;
use sombrero_mesh::{Matchings, Soup, best_matchings, match_connectivity};
use sombrero_shapes as shapes;

/// A generator of numbers that does not need a crate.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n.max(1)
    }

    fn order(&mut self, n: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..n as u32).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// Triangles with vertices, faces and corners renumbered, and the new number of each vertex.
fn renumbered(triangles: &[[u32; 3]], vertices: usize, seed: u64) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut random = Random(seed);
    let place = random.order(vertices);
    let faces = random.order(triangles.len());
    let renumbered = faces.iter().map(|&f| {
        let mut corners = triangles[f as usize].map(|v| place[v as usize]);
        corners.rotate_left(random.below(3));
        corners
    });
    (renumbered.collect(), place)
}

fn kept_by(soup: &Soup, keep: impl Fn(&[u32; 3]) -> bool) -> Vec<[u32; 3]> {
    soup.triangles.iter().copied().filter(keep).collect()
}

/// Faces with their smallest corner first, in order.
fn canonical(faces: impl Iterator<Item = [u32; 3]>) -> Vec<[u32; 3]> {
    let mut faces: Vec<_> = faces
        .map(|mut corners| {
            let first = (0..3).min_by_key(|&k| corners[k]).expect("three corners");
            corners.rotate_left(first);
            corners
        })
        .collect();
    faces.sort_unstable();
    faces
}

/// How many faces have three different corners below `vertices`, repetitions not counted.
fn usable_faces(faces: &[[u32; 3]], vertices: u32) -> usize {
    let whole = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a && a.max(b).max(c) < vertices;
    let mut sorted: Vec<_> = faces.iter().copied().filter(whole).collect();
    sorted.iter_mut().for_each(|corners| corners.sort_unstable());
    sorted.sort_unstable();
    sorted.dedup();
    sorted.len()
}

/// Whether each matching takes all faces of `second` to different faces of `first`.
fn covers(matchings: &Matchings, first: &[[u32; 3]], second: &[[u32; 3]]) -> bool {
    let known = canonical(first.iter().copied());
    matchings.found.iter().all(|matching| {
        let mapped = second
            .iter()
            .map(|corners| corners.map(|v| matching.of_second[v as usize].expect("all are placed")));
        let mapped = canonical(mapped);
        matching.faces == second.len()
            && mapped.windows(2).all(|w| w[0] != w[1])
            && mapped.iter().all(|face| known.binary_search(face).is_ok())
    })
}

fn matched(first: &[[u32; 3]], second: &[[u32; 3]], vertices: usize) -> Matchings {
    match_connectivity(first, vertices, second, vertices)
}

fn expected(place: &[u32], second: &[[u32; 3]]) -> Vec<Option<u32>> {
    let mut used = vec![false; place.len()];
    second.iter().flatten().for_each(|&v| used[v as usize] = true);
    place.iter().map(|&v| used[v as usize].then_some(v)).collect()
}

/// A closed surface whose valences vary, made from a sphere by flipping many edges.
fn irregular(subdivisions: usize, seed: u64) -> Soup {
    let mut soup = shapes::sphere(subdivisions);
    let mut random = Random(seed);
    for side in 0..soup.triangles.len() * 3 {
        if random.below(9) == 0 {
            flip(&mut soup.triangles, side);
        }
    }
    soup
}

/// Flips an edge by search through all faces, unless the new edge exists.
fn flip(triangles: &mut [[u32; 3]], side: usize) -> bool {
    let corners = triangles[side / 3];
    let [a, b, c] = [0, 1, 2].map(|k| corners[(side + k) % 3]);
    let runs = |t: &[u32; 3], tail: u32, tip: u32| (0..3).any(|k| t[k] == tail && t[(k + 1) % 3] == tip);
    let Some(other) = triangles.iter().position(|t| runs(t, b, a)) else { return false };
    let d = triangles[other].into_iter().find(|&v| v != a && v != b).expect("the corner across");
    if triangles.iter().any(|t| t.contains(&c) && t.contains(&d)) {
        return false;
    }
    triangles[side / 3] = [a, d, c];
    triangles[other] = [d, b, c];
    true
}

fn shape(kind: usize, size: usize) -> Soup {
    match kind {
        0 => shapes::bumpy_sphere(100 * size),
        1 => shapes::bust(2 * size),
        2 => shapes::part(2 + size),
        3 => shapes::genus(1 + size % 3, 1 + size / 3),
        4 => shapes::sheet_with_hole(3 * size, 4 + size),
        5 => shapes::torus(3 + size, 3 + 2 * size, 1.0, 0.4),
        6 => shapes::open_sheet(size, 2 * size),
        7 => shapes::vase(5 * size, 4 * size),
        _ => irregular(3, size as u64),
    }
}

fn side_of(soup: &Soup, corners: &[u32; 3], normal: [f64; 3], offset: f64) -> bool {
    corners.iter().all(|&v| {
        let p = soup.points[v as usize];
        p.x * normal[0] + p.y * normal[1] + p.z * normal[2] <= offset
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn renumbered_meshes_are_recovered_up_to_their_symmetries(kind in 0usize..9, size in 2usize..7, seed: u64) {
        let soup = shape(kind, size);
        let n = soup.points.len();
        let (second, place) = renumbered(&soup.triangles, n, seed);
        let matchings = matched(&soup.triangles, &second, n);
        prop_assert!(!matchings.found.is_empty());
        prop_assert!(covers(&matchings, &soup.triangles, &second));
        let truth = expected(&place, &second);
        prop_assert!(matchings.truncated || matchings.found.iter().any(|m| m.of_first == truth));
        for (i, matching) in matchings.found.iter().enumerate() {
            prop_assert_eq!(matching.mirrored_faces, 0);
            prop_assert!(matchings.found[..i].iter().all(|m| m != matching));
            for (v, w) in matching.of_second.iter().enumerate().filter_map(|(v, w)| w.map(|w| (v, w))) {
                prop_assert_eq!(matching.of_first[w as usize], Some(v as u32));
            }
        }
    }

    /// However many ways there are, where vertices lie tells which is right.
    #[test]
    fn the_best_matching_is_the_right_one(kind in 0usize..9, size in 2usize..12, part in 0.0..1.0f64, seed: u64) {
        let soup = shape(kind, size);
        let n = soup.points.len();
        let whole = part < 0.5;
        let kept = kept_by(&soup, |corners| whole || side_of(&soup, corners, [0.0, 1.0, 0.1], part - 0.5));
        let (second, place) = renumbered(&kept, n, seed);
        let mut points = soup.points.clone();
        place.iter().zip(&soup.points).for_each(|(&v, p)| points[v as usize] = *p);
        let misfit = |pairs: &[(u32, u32)]| -> f64 {
            pairs.iter().map(|&(s, f)| (points[s as usize] - soup.points[f as usize]).norm_squared()).sum()
        };
        let matchings = best_matchings(&soup.triangles, n, &second, n, 24, &misfit);
        prop_assert!(matchings.found.len() <= 24 && (!whole || !matchings.found.is_empty()));
        let Some(best) = matchings.found.first() else { return Ok(()) };
        let right = best.of_first.iter().zip(&place).filter(|(w, v)| **w == Some(**v)).count();
        prop_assert!(matchings.truncated || right == best.of_first.iter().flatten().count());
    }

    #[test]
    fn cropped_meshes_keep_their_vertices(
        seed: u64, normal in prop::array::uniform3(-1.0..1.0f64), offset in -0.3..0.6f64
    ) {
        let soup = irregular(4, seed);
        let n = soup.points.len();
        let kept = kept_by(&soup, |corners| side_of(&soup, corners, normal, offset));
        let (second, place) = renumbered(&kept, n, seed ^ 1);
        let matchings = matched(&soup.triangles, &second, n);
        if kept.len() > 500 {
            prop_assert_eq!(matchings.found.len(), 1);
            let wrong = matchings.found[0].of_first.iter().zip(expected(&place, &second))
                .filter(|(found, truth)| found.is_some() && **found != *truth).count();
            prop_assert_eq!(wrong, 0);
            prop_assert!(matchings.found[0].faces * 100 >= 97 * kept.len());
        }
    }

    #[test]
    fn faces_turned_over_are_recognised(seed: u64) {
        let soup = irregular(3, seed);
        let n = soup.points.len();
        let (mut second, place) = renumbered(&soup.triangles, n, seed ^ 1);
        second.iter_mut().for_each(|corners| corners.swap(0, 1));
        let matchings = matched(&soup.triangles, &second, n);
        prop_assert_eq!(matchings.found.len(), 1);
        prop_assert_eq!(&matchings.found[0].of_first, &expected(&place, &second));
        prop_assert_eq!(matchings.found[0].mirrored_faces, second.len());
    }

    #[test]
    fn a_few_edited_places_are_walked_around(seed: u64) {
        let soup = irregular(4, seed);
        let n = soup.points.len();
        let (mut second, place) = renumbered(&soup.triangles, n, seed ^ 1);
        for side in [7, 1501, 4000] {
            flip(&mut second, side);
        }
        let matchings = matched(&soup.triangles, &second, n);
        prop_assert_eq!(matchings.found.len(), 1);
        prop_assert!(matchings.found[0].faces + 100 > second.len());
        let right = matchings.found[0].of_first.iter().zip(&place).filter(|(w, v)| **w == Some(**v)).count();
        let matched = matchings.found[0].of_first.iter().flatten().count();
        prop_assert_eq!(right, matched);
    }

    #[test]
    fn meshes_of_equal_size_with_other_edges_are_refused(seed: u64, other: u64) {
        prop_assume!(seed != other);
        let (first, second) = (irregular(4, seed), irregular(4, other));
        let n = first.points.len();
        prop_assert!(matched(&first.triangles, &second.triangles, n).found.is_empty());
    }

    #[test]
    fn any_faces_do(
        first in prop::collection::vec(prop::array::uniform3(0u32..9), 0..40),
        second in prop::collection::vec(prop::array::uniform3(0u32..9), 0..40),
        seed: u64,
    ) {
        let matchings = match_connectivity(&first, 8, &second, 7);
        prop_assert!(matchings.found.len() <= 8);
        prop_assert_eq!(&matchings, &match_connectivity(&first, 8, &second, 7));
        let usable = usable_faces(&first, 9);
        let (copy, _) = renumbered(&first, 9, seed);
        for matching in matched(&first, &copy, 9).found {
            prop_assert!(matching.faces <= usable);
        }
    }
}

#[test]
fn two_components_are_matched_each_on_its_own() {
    let (large, small) = (irregular(4, 1), irregular(3, 2));
    let shift = large.points.len() as u32;
    let n = large.points.len() + small.points.len();
    let mut first = large.triangles.clone();
    first.extend(small.triangles.iter().map(|corners| corners.map(|v| v + shift)));
    let (second, place) = renumbered(&first, n, 3);
    let matchings = matched(&first, &second, n);
    assert_eq!(matchings.found.len(), 1);
    assert_eq!(matchings.found[0].of_first, expected(&place, &second));

    // Only the small one is left, beside something else.
    let stranger = irregular(3, 4);
    let mut left: Vec<[u32; 3]> = small.triangles.clone();
    left.extend(stranger.triangles.iter().map(|corners| corners.map(|v| v + small.points.len() as u32)));
    let matchings = match_connectivity(&first, n, &left, small.points.len() + stranger.points.len());
    assert_eq!(matchings.found.len(), 1);
    assert_eq!(matchings.found[0].faces, small.triangles.len());
    for v in 0..small.points.len() as u32 {
        assert_eq!(matchings.found[0].of_first[(v + shift) as usize], Some(v));
    }
}

#[test]
fn one_of_two_components_turned_over() {
    let small = irregular(3, 2);
    let shift = small.points.len() as u32;
    let mut first = small.triangles.clone();
    first.extend(irregular(3, 5).triangles.iter().map(|corners| corners.map(|v| v + shift)));
    let mut second = first.clone();
    second[small.triangles.len()..].iter_mut().for_each(|corners| corners.swap(1, 2));
    let matchings = matched(&first, &second, 2 * small.points.len());
    assert_eq!(matchings.found[0].mirrored_faces, small.triangles.len());
    assert_eq!(matchings.found[0].faces, first.len());
}

#[test]
fn solids_have_the_symmetries_of_their_rotations() {
    let count = |soup: Soup| {
        let found = matched(&soup.triangles, &soup.triangles, soup.points.len());
        (found.found.len(), found.truncated)
    };
    assert_eq!(count(shapes::tetrahedron()), (8, true));
    assert_eq!(count(shapes::icosahedron()), (8, true));
    assert_eq!(count(shapes::sphere(4)), (8, true));
    assert_eq!(count(shapes::torus(12, 9, 1.0, 0.3)), (8, true));
    // A triangle turns three ways.
    assert_eq!(count(Soup::new(vec![Default::default(); 3], vec![[0, 1, 2]])), (3, false));
    assert_eq!(count(shapes::open_sheet(8, 4)), (2, false));
    assert_eq!(count(irregular(3, 1)), (1, false));
}

#[test]
fn two_equal_components_change_places() {
    let one = irregular(2, 1);
    let shift = one.points.len() as u32;
    let mut both = one.triangles.clone();
    both.extend(one.triangles.iter().map(|corners| corners.map(|v| v + shift)));
    let matchings = matched(&both, &both, 2 * one.points.len());
    assert_eq!((matchings.found.len(), matchings.truncated), (2, false));
    assert!(covers(&matchings, &both, &both));
}

/// Each of several turned bodies has many places, and all of them together have the product; the best is found all the same.
#[test]
fn the_best_matching_of_several_symmetric_components_is_the_right_one() {
    let mut all = Soup::default();
    for (i, part) in
        [shapes::vase(40, 20), shapes::vase(40, 20), shapes::sphere(3), shapes::torus(30, 20, 1.0, 0.4)]
            .into_iter()
            .enumerate()
    {
        let first = all.points.len() as u32;
        // Each turned by itself, so that two alike do not lie alike.
        let turn = nalgebra::Rotation3::from_euler_angles(i as f64, 0.5 * i as f64, 0.0);
        all.points.extend(part.points.iter().map(|p| turn * p + nalgebra::Vector3::x() * (4.0 * i as f64)));
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }
    let n = all.points.len();
    let (second, place) = renumbered(&all.triangles, n, 11);
    let mut points = all.points.clone();
    place.iter().zip(&all.points).for_each(|(&v, p)| points[v as usize] = *p);
    let misfit = |pairs: &[(u32, u32)]| -> f64 {
        pairs.iter().map(|&(s, f)| (points[s as usize] - all.points[f as usize]).norm_squared()).sum()
    };
    let best = best_matchings(&all.triangles, n, &second, n, 24, &misfit);
    assert_eq!(best.found[0].of_first, expected(&place, &second));
    assert!(best.found.len() <= 24);
}

#[test]
fn small_symmetric_components_do_not_multiply_matchings() {
    let body = irregular(4, 1);
    let mut first = body.triangles.clone();
    let mut n = body.points.len() as u32;
    for bolt in [shapes::sphere(1), shapes::sphere(1), shapes::tetrahedron(), irregular(2, 3)] {
        first.extend(bolt.triangles.iter().map(|corners| corners.map(|v| v + n)));
        n += bolt.points.len() as u32;
    }
    first.extend((0..50).map(|k| [n + 3 * k, n + 3 * k + 1, n + 3 * k + 2]));
    n += 150;
    let (second, place) = renumbered(&first, n as usize, 5);
    let matchings = matched(&first, &second, n as usize);
    assert_eq!((matchings.found.len(), matchings.truncated), (1, false));
    assert_eq!(matchings.found[0].faces, body.triangles.len() + irregular(2, 3).triangles.len());
    let found = &matchings.found[0].of_first;
    assert!(found.iter().zip(&place).all(|(w, v)| w.is_none_or(|w| w == *v)));
}

#[test]
fn regular_meshes_of_other_sizes_are_refused() {
    let first = shapes::torus(20, 31, 1.0, 0.3);
    let second = shapes::torus(20, 30, 1.0, 0.3);
    let found = |a: &Soup, b: &Soup| {
        match_connectivity(&a.triangles, a.points.len(), &b.triangles, b.points.len()).found.len()
    };
    assert_eq!(found(&first, &second), 0);
    assert_eq!(found(&second, &first), 0);
    assert_eq!(found(&shapes::sphere(4), &shapes::sphere(3)), 0);
    assert_eq!(found(&shapes::part(8), &shapes::bust(9)), 0);
    assert_eq!(found(&shapes::part(8), &shapes::tetrahedron()), 0);
}

#[test]
fn crops_of_regular_grids_are_ambiguous_or_refused() {
    let grid = shapes::torus(40, 30, 1.0, 0.3);
    let kept = kept_by(&grid, |corners| corners.iter().all(|&v| v < 600));
    assert!(matched(&grid.triangles, &kept, grid.points.len()).found.is_empty());

    let sheet = shapes::open_sheet(40, 30);
    let kept = kept_by(&sheet, |corners| corners.iter().all(|&v| v < 41 * 15));
    let matchings = matched(&sheet.triangles, &kept, sheet.points.len());
    assert!(matchings.found.is_empty() || matchings.truncated);
}

#[test]
fn a_vertex_on_a_cut_may_become_several() {
    let soup = irregular(4, 1);
    let n = soup.points.len();
    // Every face of one half gets vertices of its own on the border: both halves are whole, and apart.
    let upper = |corners: &[u32; 3]| corners.iter().any(|&v| soup.points[v as usize].z > 0.0);
    let second: Vec<[u32; 3]> =
        soup.triangles.iter().map(|t| if upper(t) { t.map(|v| v + n as u32) } else { *t }).collect();
    let matchings = match_connectivity(&soup.triangles, n, &second, 2 * n);
    assert_eq!(matchings.found.len(), 1);
    // Scraps of single triangles hold on to nothing.
    assert!(matchings.found[0].faces + 10 > second.len());
    let of_second = &matchings.found[0].of_second;
    assert!((0..).zip(of_second).all(|(v, w)| w.is_none_or(|w| w == v % n as u32)));
    let copies: Vec<usize> =
        (0..n).filter(|&v| of_second[v].is_some() && of_second[v + n].is_some()).collect();
    assert!(copies.len() > 50 && copies.iter().all(|&v| matchings.found[0].of_first[v] == Some(v as u32)));
}

#[test]
fn more_than_two_faces_at_an_edge_are_no_obstacle() {
    let soup = irregular(4, 1);
    let n = soup.points.len() + 1;
    let mut first = soup.triangles.clone();
    let [a, b, c] = first[100];
    // A fin, a doubled face, a face without area.
    first.extend([[a, b, n as u32 - 1], [c, a, b], [a, a, b]]);
    let (second, place) = renumbered(&first, n, 9);
    let matchings = matched(&first, &second, n);
    assert_eq!(matchings.found.len(), 1);
    assert!(matchings.found[0].faces >= soup.triangles.len());
    let found = &matchings.found[0].of_first;
    assert!((0..n - 1).all(|v| found[v] == Some(place[v])));
}

#[test]
fn nothing_matches_nothing() {
    for none in [
        match_connectivity(&[], 0, &[], 0),
        match_connectivity(&[[0, 1, 2]], 3, &[], 5),
        match_connectivity(&[[0, 1, 7]], 3, &[[0, 1, 2]], 3),
    ] {
        assert!(none.found.is_empty() && !none.truncated);
    }
}
