//! Repair: any soup becomes a manifold, and the report accounts for every face and vertex.

use nalgebra::Point3;
use proptest::prelude::*;
use sombrero_mesh::repair::{Repaired, repair};
use sombrero_mesh::{Soup, topology};

fn soup(vertices: usize, triangles: &[[u32; 3]]) -> Soup {
    let points = (0..vertices).map(|i| {
        let x = i as f64;
        Point3::new(x, x * x, x * x * x)
    });
    Soup::new(points.collect(), triangles.to_vec())
}

fn sorted(mut corners: [u32; 3]) -> [u32; 3] {
    corners.sort_unstable();
    corners
}

fn check(soup: &Soup, repaired: &Repaired) {
    repaired.mesh.validate().expect("invariants hold");
    assert_eq!(repaired.mesh.face_count(), repaired.face_source.len());
    for (corners, &f) in repaired.mesh.triangles().iter().zip(&repaired.face_source) {
        let back = corners.map(|v| repaired.source[v as usize]);
        assert_eq!(sorted(back), sorted(soup.triangles[f as usize]), "faces keep their corners");
    }
    let r = repaired.report;
    let left_out = r.out_of_range_faces + r.non_finite_faces + r.degenerate_faces + r.doubled_faces;
    assert_eq!(left_out + repaired.mesh.face_count(), soup.triangles.len(), "every face is accounted for");
    assert_eq!(
        repaired.mesh.vertex_count() + r.unused_vertices,
        soup.points.len() + r.added_vertices,
        "every vertex is accounted for"
    );
}

proptest! {
    #[test]
    fn any_soup_becomes_a_manifold(
        triangles in prop::collection::vec(prop::array::uniform3(0u32..9), 0..40)
    ) {
        let soup = soup(8, &triangles);
        let repaired = repair(&soup);
        check(&soup, &repaired);
    }

    #[test]
    fn shuffled_and_turned_faces_of_a_closed_surface_are_mended(
        turn in prop::collection::vec(any::<bool>(), 80), seed in any::<u64>()
    ) {
        let mut sphere = sombrero_shapes::sphere(1);
        for (corners, turn) in sphere.triangles.iter_mut().zip(turn) {
            if turn { corners.swap(0, 1); }
        }
        let n = sphere.triangles.len();
        for i in 0..n {
            sphere.triangles.swap(i, (seed as usize).wrapping_mul(2 * i + 1) % n);
        }
        let repaired = repair(&sphere);
        check(&sphere, &repaired);
        prop_assert_eq!(topology::genus(&repaired.mesh), Some(0));
        prop_assert!(topology::boundary_loops(&repaired.mesh).is_empty());
        prop_assert!(2 * repaired.report.flipped_faces <= n);
    }
}

#[test]
fn a_clean_mesh_is_left_alone() {
    let torus = sombrero_shapes::torus(8, 6, 1.0, 0.4);
    let repaired = repair(&torus);
    assert!(repaired.report.is_clean());
    assert_eq!(repaired.mesh.triangles(), torus.triangles);
    assert_eq!(repaired.points, torus.points);
}

#[test]
fn two_tetrahedra_at_an_edge_are_parted() {
    let tetrahedron = |a: u32, b, c, d| [[a, b, c], [a, c, d], [a, d, b], [b, d, c]];
    let faces = [tetrahedron(0, 1, 2, 3), tetrahedron(0, 1, 4, 5)].concat();
    let soup = soup(6, &faces);
    let repaired = repair(&soup);
    check(&soup, &repaired);
    assert_eq!(topology::components(&repaired.mesh).1, 2);
    assert!(topology::boundary_loops(&repaired.mesh).is_empty());
    let r = repaired.report;
    assert_eq!((r.nonmanifold_edges, r.nonmanifold_vertices, r.added_vertices), (1, 2, 2));
    assert_eq!(repaired.copies(0).len(), 2);
    assert_eq!(repaired.copies(2).len(), 1);
}

#[test]
fn a_moebius_band_is_cut_once() {
    let n = 7u32;
    let faces: Vec<_> = (0..n).map(|i| [i, (i + 1) % n, (i + 2) % n]).collect();
    let soup = soup(n as usize, &faces);
    let repaired = repair(&soup);
    check(&soup, &repaired);
    assert_eq!(repaired.report.unorientable_edges, 1);
    assert_eq!(topology::euler_characteristic(&repaired.mesh), 1, "a disc");
}

#[test]
fn doubled_degenerate_and_foreign_faces_are_left_out() {
    let faces = [[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 0, 1], [0, 1, 9], [1, 0, 3]];
    let mut soup = soup(5, &faces);
    soup.points[4].x = f64::NAN;
    soup.triangles.push([0, 1, 4]);
    let repaired = repair(&soup);
    check(&soup, &repaired);
    let r = repaired.report;
    let counts = (r.doubled_faces, r.degenerate_faces, r.out_of_range_faces, r.non_finite_faces);
    assert_eq!(counts, (2, 1, 1, 1));
    assert_eq!(r.unused_vertices, 1);
    assert_eq!(repaired.face_source, [0, 5]);
}

#[test]
fn an_empty_soup_gives_an_empty_mesh() {
    let repaired = repair(&Soup::default());
    assert_eq!(repaired.mesh.face_count(), 0);
    assert!(repaired.report.is_clean());
}
