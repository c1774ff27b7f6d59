//! Walks, normals and edges: what the mesh tells of itself agrees with what its triangles say.

use nalgebra::Point3;
use sombrero_mesh::{Edges, FaceId, Soup, VertexId, geometry, repair, topology, weld_and_repair};
use sombrero_shapes as shapes;

fn surfaces() -> [Soup; 4] {
    [shapes::part(2), shapes::torus(9, 7, 1.0, 0.4), shapes::open_sheet(6, 5), shapes::sheet_with_hole(9, 9)]
}

#[test]
fn a_walk_along_a_boundary_loop_meets_each_of_its_vertices_once() {
    for soup in surfaces() {
        let mesh = repair(&soup).mesh;
        let mut seen: Vec<VertexId> = Vec::new();
        for first in topology::boundary_loops(&mesh) {
            let walk: Vec<_> = mesh.halfedges_along(first).collect();
            assert_eq!(walk[0], first);
            assert!(walk.windows(2).all(|w| mesh.tip(w[0]) == mesh.tail(w[1])));
            assert_eq!(mesh.tip(walk[walk.len() - 1]), mesh.tail(first));
            seen.extend(walk.into_iter().map(|h| mesh.tail(h)));
        }
        seen.sort_unstable();
        let boundary: Vec<_> = mesh.vertices().filter(|&v| mesh.is_boundary_vertex(v)).collect();
        assert_eq!(seen, boundary);
        let around = mesh.halfedges_along(mesh.face_halfedge(FaceId::new(3)));
        assert_eq!(around.count(), 3, "the same walk goes around a face");
    }
}

#[test]
fn normals_of_a_sphere_are_its_radii() {
    let made = repair(&shapes::sphere(4));
    let normals = geometry::vertex_normals(&made.mesh, &made.points);
    assert_eq!(normals.len(), made.points.len());
    for (normal, p) in normals.iter().zip(&made.points) {
        assert!((normal.unwrap() - p.coords).norm() < 5e-3);
    }
}

#[test]
fn edges_are_those_of_the_mesh_in_its_order() {
    for soup in surfaces() {
        let mesh = repair(&soup).mesh;
        let edges = Edges::new(soup.points.len(), &soup.triangles);
        let halfedges: Vec<_> = mesh.edges().map(|e| e.halfedge()).collect();
        assert_eq!(edges.len(), halfedges.len());
        for ((ends, &sides), h) in edges.ends.iter().zip(&edges.sides).zip(halfedges) {
            let mut theirs = [mesh.tail(h), mesh.tip(h)].map(VertexId::to_u32);
            theirs.sort_unstable();
            assert_eq!(*ends, theirs);
            assert_eq!(sides == 1, mesh.is_boundary_edge(h.edge()));
        }
        for (side, &edge) in edges.of_side.iter().enumerate() {
            let corners = soup.triangles[side / 3];
            let mut ends = [corners[side % 3], corners[(side + 1) % 3]];
            ends.sort_unstable();
            assert_eq!(edges.ends[edge as usize], ends);
        }
    }
    // Any number of sides.
    let fin = Edges::new(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
    assert_eq!((fin.ends[0], fin.sides[0]), ([0, 1], 3));
    assert!(Edges::new(3, &[]).is_empty());
}

#[test]
fn corner_soup_becomes_the_mesh_that_it_was_made_of() {
    for soup in surfaces() {
        let corners: Vec<Point3<f64>> =
            soup.triangles.iter().flatten().map(|&v| soup.points[v as usize]).collect();
        let n = corners.len() as u32;
        let mut torn = Soup::new(corners, (0..n / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect());
        let (weld, made) = weld_and_repair(&torn);
        assert!(made.report.is_clean());
        assert_eq!(made.points.len(), soup.points.len());
        assert_eq!(made.mesh.edge_count(), repair(&soup).mesh.edge_count());
        assert!((0..n as usize).all(|v| weld.points[weld.point_of[v] as usize] == torn.points[v]));
        torn.triangles.push([0, 1, n]);
        assert_eq!(weld_and_repair(&torn).1.report.out_of_range_faces, 1, "counted, no panic");
    }
}

#[test]
fn ids_print_alike() {
    let (v, f) = (VertexId::new(3), FaceId::new(1));
    assert_eq!((v.to_string(), format!("{v:?}")), ("v3".into(), "v3".into()));
    assert_eq!((f.to_string(), format!("{f:?}")), ("f1".into(), "f1".into()));
}
