//! Edge collapses: the topology stays, and undoing is exact.

use proptest::prelude::*;
use sombrero_mesh::{CollapseError, HalfedgeId, Mesh, Soup, VertexId, repair, topology};
use sombrero_shapes as shapes;

fn surfaces() -> impl Strategy<Value = Soup> {
    prop_oneof![
        Just(shapes::sphere(1)),
        Just(shapes::torus(6, 5, 1.0, 0.4)),
        Just(shapes::genus(2, 1)),
        Just(shapes::open_sheet(5, 4)),
        Just(shapes::sheet_with_hole(6, 6)),
    ]
}

proptest! {
    #[test]
    fn collapses_keep_the_topology_and_undo_exactly(soup in surfaces(), picks in prop::collection::vec(any::<u32>(), 1..80)) {
        let full = repair(&soup).mesh;
        let genus = topology::genus(&full);
        let loops = topology::boundary_loops(&full).len();
        let mut mesh = full.clone();
        let mut history = Vec::new();
        for pick in picks {
            let h = HalfedgeId::new(pick as usize % mesh.halfedge_bound());
            let before = mesh.clone();
            match mesh.collapse(h) {
                Ok(collapse) => history.push((before, collapse)),
                Err(_) => prop_assert_eq!(&mesh, &before, "a refused collapse changes nothing"),
            }
            prop_assert_eq!(mesh.validate(), Ok(()));
        }
        prop_assert_eq!(topology::genus(&mesh), genus);
        prop_assert_eq!(topology::boundary_loops(&mesh).len(), loops);
        while let Some((before, collapse)) = history.pop() {
            mesh.undo_collapse(&collapse);
            prop_assert_eq!(&mesh, &before);
        }
        prop_assert_eq!(&mesh, &full);
    }
}

#[test]
fn a_collapse_in_a_hexagon_leaves_four_faces() {
    // A wheel: hub 0, rim 1 to 6.
    let faces: Vec<_> = (0..6).map(|i| [0, i + 1, (i + 1) % 6 + 1]).collect();
    let mut mesh = Mesh::from_triangles(7, &faces).unwrap();
    let h = mesh.halfedge_between(VertexId::new(0), VertexId::new(1)).unwrap();
    let collapse = mesh.collapse(h).unwrap();
    assert_eq!((collapse.removed, collapse.kept), (VertexId::new(0), VertexId::new(1)));
    assert_eq!((mesh.vertex_count(), mesh.edge_count(), mesh.face_count()), (6, 9, 4));
    assert!(mesh.faces().all(|f| mesh.vertices_of_face(f).contains(&VertexId::new(1))));
}

#[test]
fn the_smallest_closed_and_open_surfaces_do_not_collapse() {
    let triangle = Mesh::from_triangles(3, &[[0, 1, 2]]).unwrap();
    let tetrahedron = repair(&shapes::tetrahedron()).mesh;
    for mesh in [triangle, tetrahedron] {
        for halfedge in mesh.halfedges() {
            assert_eq!(mesh.check_collapse(halfedge), Err(CollapseError::Smallest { halfedge }));
        }
    }
}

#[test]
fn a_collapse_that_would_pinch_is_refused() {
    // Two triangles at an edge: the edge joins two boundary vertices through the inside.
    let mesh = Mesh::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let halfedge = mesh.halfedge_between(VertexId::new(0), VertexId::new(2)).unwrap();
    assert_eq!(mesh.check_collapse(halfedge), Err(CollapseError::Boundary { halfedge }));
    // A tube of three sides: its waist cannot be closed.
    let mesh = repair(&shapes::torus(3, 3, 1.0, 0.4)).mesh;
    let refused =
        mesh.halfedges().filter(|&h| matches!(mesh.check_collapse(h), Err(CollapseError::Link { .. })));
    assert!(refused.count() > 0);
}
