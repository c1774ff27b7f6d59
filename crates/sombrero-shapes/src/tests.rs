//! What every generated shape promises.

use nalgebra::Point3;

use super::*;
use sombrero_mesh::Soup;

/// The edges of a manifold.
struct Edges {
    /// Undirected edges, interior and boundary ones.
    count: usize,
    /// Directed edges without an opposite.
    boundary: Vec<[u32; 2]>,
}

/// Collects edges, and fails on one that two faces use in the same direction.
fn edges(soup: &Soup) -> Edges {
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let mut directed: Vec<_> = soup.triangles.iter().flat_map(sides).collect();
    directed.sort_unstable();
    assert!(directed.windows(2).all(|w| w[0] != w[1]), "two faces share an edge in one direction");
    let lonely = |e: &&[u32; 2]| directed.binary_search(&[e[1], e[0]]).is_err();
    let boundary: Vec<_> = directed.iter().filter(lonely).copied().collect();
    Edges { count: (directed.len() + boundary.len()) / 2, boundary }
}

/// The number of closed walks along the boundary.
fn loops(mut boundary: Vec<[u32; 2]>) -> usize {
    let mut loops = 0;
    while let Some([start, mut end]) = boundary.pop() {
        while end != start {
            let next = boundary.iter().position(|e| e[0] == end).expect("the boundary goes on");
            end = boundary.swap_remove(next)[1];
        }
        loops += 1;
    }
    loops
}

/// Fails unless the faces around each vertex are one fan: as many fans as vertices.
fn assert_single_fans(soup: &Soup) {
    let mut faces_of = vec![Vec::new(); soup.points.len()];
    for t in &soup.triangles {
        for i in 0..3 {
            faces_of[t[i] as usize].push([t[(i + 1) % 3], t[(i + 2) % 3]]);
        }
    }
    for link in faces_of {
        // An open fan starts with the corner that no other face leads to.
        let starts = |e: &[u32; 2]| link.iter().all(|other| other[1] != e[0]);
        let first = link.iter().copied().find(starts).unwrap_or(link[0]);
        let (mut end, mut steps) = (first[1], 1);
        while let Some(next) = link.iter().find(|e| e[0] == end && end != first[0]) {
            (end, steps) = (next[1], steps + 1);
        }
        assert_eq!(steps, link.len(), "a vertex joins two fans");
    }
}

fn corners(soup: &Soup, t: &[u32; 3]) -> [Point3<f64>; 3] {
    t.map(|v| soup.points[v as usize])
}

/// Fails on degenerate faces, or on faces much thinner than the shape promises.
fn assert_fair(soup: &Soup, sharpest_degrees: f64) {
    for t in &soup.triangles {
        for i in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|k| soup.points[t[(i + k) % 3] as usize]);
            let angle = (b - a).angle(&(c - a)).to_degrees();
            assert!(angle > sharpest_degrees, "{angle} degrees at {a}");
        }
    }
}

/// What holds for all shapes; gives the boundary's edges.
fn assert_clean(soup: &Soup, euler: i64, sharpest_degrees: f64) -> Vec<[u32; 2]> {
    assert!(soup.points.iter().all(|p| p.coords.iter().all(|c| c.is_finite())));
    assert!(soup.used().iter().all(|used| *used), "an unused vertex");
    let mut sorted: Vec<_> =
        soup.points.iter().map(|p| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits)).collect();
    sorted.sort_unstable();
    assert!(sorted.windows(2).all(|w| w[0] != w[1]), "a doubled vertex");
    let edges = edges(soup);
    assert_eq!(soup.points.len() as i64 - edges.count as i64 + soup.triangles.len() as i64, euler);
    assert_single_fans(soup);
    assert_fair(soup, sharpest_degrees);
    edges.boundary
}

fn assert_closed(soup: &Soup, euler: i64, sharpest_degrees: f64) {
    assert!(assert_clean(soup, euler, sharpest_degrees).is_empty(), "an open edge");
    assert!(volume(soup) > 0.0, "inside out");
}

fn volume(soup: &Soup) -> f64 {
    let cone = |t| {
        let [a, b, c] = corners(soup, t);
        a.coords.dot(&b.coords.cross(&c.coords)) / 6.0
    };
    soup.triangles.iter().map(cone).sum()
}

/// Fails if some surface patch folds back onto its neighbour.
fn assert_no_folds(soup: &Soup, least_cosine: f64) {
    let mut sides: Vec<([u32; 2], nalgebra::Vector3<f64>)> = Vec::new();
    for t in &soup.triangles {
        let [a, b, c] = corners(soup, t);
        let normal = (b - a).cross(&(c - a)).normalize();
        sides.extend([0, 1, 2].map(|i| {
            let (from, to) = (t[i], t[(i + 1) % 3]);
            ([from.min(to), from.max(to)], normal)
        }));
    }
    sides.sort_unstable_by_key(|side| side.0);
    for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let cosine = pair[0].1.dot(&pair[1].1);
        assert!(cosine > least_cosine, "a fold of cosine {cosine} at vertices {:?}", pair[0].0);
    }
}

#[test]
fn small_solids_are_closed_and_have_their_volume() {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let side = 2.0 / (1.0 + golden * golden).sqrt();
    let icosahedron_volume = 5.0 / 6.0 * golden * golden * side * side * side;
    let solids = [tetrahedron(), octahedron(), cube(), icosahedron()];
    for (solid, expected) in solids.iter().zip([8.0 / 3.0, 4.0 / 3.0, 8.0, icosahedron_volume]) {
        assert_closed(solid, 2, 44.0);
        assert!((volume(solid) - expected).abs() < 1e-12);
    }
}

#[test]
fn spheres_are_closed_and_even() {
    for subdivisions in 0..5 {
        let soup = sphere(subdivisions);
        assert_eq!(soup.points.len(), 10 * (1 << (2 * subdivisions)) + 2);
        assert_closed(&soup, 2, 40.0);
    }
    assert!((volume(&sphere(5)) / (4.0 / 3.0 * core::f64::consts::PI) - 1.0).abs() < 2e-3);
}

#[test]
fn geodesics_of_any_frequency_are_closed() {
    for frequency in 1..8 {
        let soup = geodesic::geodesic(frequency);
        assert_eq!(soup.points.len(), 10 * frequency * frequency + 2);
        assert_closed(&soup, 2, 40.0);
    }
}

#[test]
fn tori_are_closed_with_one_handle() {
    assert_closed(&torus(0, 1, 2.0, 0.5), 0, 1.0);
    assert_closed(&torus(40, 20, 2.0, 0.7), 0, 20.0);
    assert_eq!(torus(40, 20, 2.0, 0.7).points.len(), 800);
}

#[test]
fn slabs_have_the_genus_asked_for() {
    for g in 0..5 {
        for r in 1..4 {
            let soup = genus(g, r);
            assert_eq!(soup.points.len(), (18 * g + 14) * r * r + 2 - 2 * g);
            assert_closed(&soup, 2 - 2 * g as i64, 44.0);
            assert!((volume(&soup) - (5 * g + 3) as f64).abs() < 1e-9);
        }
    }
    assert_closed(&genus(1, 0), 0, 44.0);
}

#[test]
fn sheets_have_one_boundary_loop_and_face_up() {
    for (nx, ny) in [(0, 0), (1, 1), (2, 5), (30, 20)] {
        let soup = open_sheet(nx, ny);
        assert_eq!(loops(assert_clean(&soup, 1, 10.0)), 1);
        assert!(soup.triangles.iter().all(|t| faces_up(&soup, t)));
    }
}

#[test]
fn sheets_with_a_hole_have_two_boundary_loops() {
    for (nx, ny) in [(0, 0), (3, 4), (5, 7), (30, 20)] {
        let soup = sheet_with_hole(nx, ny);
        assert_eq!(loops(assert_clean(&soup, 0, 10.0)), 2);
        assert!(soup.triangles.iter().all(|t| faces_up(&soup, t)));
    }
}

fn faces_up(soup: &Soup, t: &[u32; 3]) -> bool {
    let [a, b, c] = corners(soup, t);
    (b - a).cross(&(c - a)).z > 0.0
}

#[test]
fn parts_are_closed_with_two_handles() {
    for resolution in (0..14).chain([20, 33]) {
        let soup = part(resolution);
        assert_closed(&soup, -2, 4.0);
        assert_no_folds(&soup, -0.75);
    }
}

#[test]
fn parts_have_the_documented_size() {
    let counts = [1, PART_RESOLUTION, 100].map(|r| part(r).points.len());
    assert_eq!(counts, [650, 6_406, 615_592]);
    let sides = part(PART_RESOLUTION).bounding_box().expect("a part is not empty").sides();
    assert!((sides - nalgebra::Vector3::new(12.0, 6.25, 7.75)).norm() < 1e-9);
}

/// Between the volume of plate, lug, boss, collar and rib without chamfers, and 4 percent less.
#[test]
fn parts_have_the_volume_of_their_pieces() {
    let pi = core::f64::consts::PI;
    let plate = (12.0 * 6.25 - (4.0 - pi) * 2.25 - pi) * 1.25 - 1.375 * 6.25 * 0.375;
    let lug = 1.375 * (4.75 * 4.125 + pi * 2.375 * 2.375 / 2.0 - pi);
    let rings = (1.0 + 0.625) * pi * (1.625 * 1.625 - 1.0);
    let whole = plate + lug + rings + 2.0 * 0.75;
    let ratio = volume(&part(40)) / whole;
    assert!((0.96..1.0).contains(&ratio), "{ratio}");
}

#[test]
fn busts_are_closed_and_unfolded() {
    for resolution in [1, 2, 5, 10, 20, BUST_RESOLUTION, 64] {
        let soup = bust(resolution);
        assert_eq!(soup.points.len(), 10 * resolution * resolution + 2);
        assert_closed(&soup, 2, 8.0);
        assert_no_folds(&soup, -0.7);
    }
}

#[test]
fn bumpy_spheres_are_closed_and_near_the_size_asked_for() {
    for vertices in [0, 12, 500, 1_000, 10_000] {
        let soup = bumpy_sphere(vertices);
        assert_closed(&soup, 2, 8.0);
        assert_no_folds(&soup, 0.0);
        assert!(vertices < 12 || soup.points.len().abs_diff(vertices) * 20 <= vertices);
    }
    assert_eq!([100_000, 500_000].map(|v| bumpy_sphere(v).points.len()), [100_002, 501_762]);
}

/// Folds the bits of positions and the corners of triangles into one number (FNV-1a).
fn fingerprint(soup: &Soup) -> u64 {
    let bits = soup.points.iter().flat_map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]);
    let corners = soup.triangles.iter().flatten().map(|&v| u64::from(v));
    bits.chain(corners).fold(0xcbf2_9ce4_8422_2325, |h, word| (h ^ word).wrapping_mul(0x0100_0000_01b3))
}

/// The same bits on every machine. A change of shape on purpose changes these numbers on purpose.
#[test]
fn shapes_are_the_same_to_the_bit_everywhere() {
    let shapes = [
        sphere(3),
        torus(24, 12, 2.0, 0.5),
        genus(2, 2),
        sheet_with_hole(12, 9),
        part(PART_RESOLUTION),
        bust(BUST_RESOLUTION),
        bumpy_sphere(1_000),
    ];
    let expected = [
        5462381093610078153,
        7343212917235887441,
        16828068138660849173,
        17888239669695474812,
        11895579346887661444,
        15947995300324635418,
        13774270957796971175,
    ];
    assert_eq!(shapes.each_ref().map(fingerprint), expected);
}
