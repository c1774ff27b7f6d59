//! Measures of a mesh whose vertices stand at given points: `points[v.index()]`, in model units.
//!
//! All of them panic when `points` is shorter than [`Mesh::vertex_bound`] and a vertex without a point is asked for.

use crate::{EdgeId, FaceId, Mesh, VertexId};
use nalgebra::{Point3, Vector3};

/// Twice the area of a triangle times its unit normal: (b - a) × (c - a).
#[inline]
pub fn area_vector(a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// The length of a triangle's longest side.
#[inline]
pub fn longest_side([a, b, c]: &[Point3<f64>; 3]) -> f64 {
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

/// The corners of a face.
#[inline]
pub fn corners(mesh: &Mesh, points: &[Point3<f64>], f: FaceId) -> [Point3<f64>; 3] {
    mesh.vertices_of_face(f).map(|v| points[v.index()])
}

/// Area of a face, in squared model units.
pub fn face_area(mesh: &Mesh, points: &[Point3<f64>], f: FaceId) -> f64 {
    let [a, b, c] = corners(mesh, points, f);
    0.5 * area_vector(&a, &b, &c).norm()
}

/// Unit normal of a face; `None` when its area is zero.
pub fn face_normal(mesh: &Mesh, points: &[Point3<f64>], f: FaceId) -> Option<Vector3<f64>> {
    let [a, b, c] = corners(mesh, points, f);
    area_vector(&a, &b, &c).try_normalize(0.0)
}

/// Unit normal of a vertex, faces weighted by area; `None` when their area vectors cancel.
pub fn vertex_normal(mesh: &Mesh, points: &[Point3<f64>], v: VertexId) -> Option<Vector3<f64>> {
    let sum: Vector3<f64> = mesh
        .faces_around_vertex(v)
        .map(|f| {
            let [a, b, c] = corners(mesh, points, f);
            area_vector(&a, &b, &c)
        })
        .sum();
    sum.try_normalize(0.0)
}

/// Unit normals of all vertices, as [`vertex_normal`] has them: one entry for each index below [`Mesh::vertex_bound`], `None`
/// for removed vertices.
///
/// # Panics
/// When `points` is shorter than [`Mesh::vertex_bound`].
pub fn vertex_normals(mesh: &Mesh, points: &[Point3<f64>]) -> Vec<Option<Vector3<f64>>> {
    assert!(points.len() >= mesh.vertex_bound(), "a point for every vertex");
    let mut normals = vec![None; mesh.vertex_bound()];
    mesh.vertices().for_each(|v| normals[v.index()] = vertex_normal(mesh, points, v));
    normals
}

/// Length of an edge.
#[inline]
pub fn edge_length(mesh: &Mesh, points: &[Point3<f64>], e: EdgeId) -> f64 {
    let h = e.halfedge();
    (points[mesh.tip(h).index()] - points[mesh.tail(h).index()]).norm()
}

/// Mean length of all edges; 0 without edges.
pub fn mean_edge_length(mesh: &Mesh, points: &[Point3<f64>]) -> f64 {
    let total: f64 = mesh.edges().map(|e| edge_length(mesh, points, e)).sum();
    total / mesh.edge_count().max(1) as f64
}

/// Surface area, in squared model units.
pub fn area(mesh: &Mesh, points: &[Point3<f64>]) -> f64 {
    // An empty sum is -0.
    0.0 + mesh.faces().map(|f| face_area(mesh, points, f)).sum::<f64>()
}

/// Enclosed volume of a closed mesh, positive when faces are counter-clockwise seen from outside.
///
/// 6 V = sum over faces of a · (b × c), with the origin moved to the first vertex.
pub fn volume(mesh: &Mesh, points: &[Point3<f64>]) -> f64 {
    let Some(origin) = mesh.vertices().next().map(|v| points[v.index()]) else { return 0.0 };
    let six: f64 = mesh
        .faces()
        .map(|f| {
            let [a, b, c] = corners(mesh, points, f).map(|p| p - origin);
            a.dot(&b.cross(&c))
        })
        .sum();
    six / 6.0
}
