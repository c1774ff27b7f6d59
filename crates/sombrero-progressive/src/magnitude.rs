//! How much each vertex split changes the shape (the paper, section 3).
//!
//! With c the centroid of the new vertex's neighbours at its level and d the unit normal of their ring,
//!
//!   h = d · (v - c):
//!
//! the height of the new vertex over the coarser surface.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{Mesh, VertexId};

/// Height and direction of one vertex split.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Magnitude {
    /// h, in model units; its sign is that of the new vertex's side of its ring.
    pub height: f64,
    /// d, of unit length; zero where the ring has no normal, and then h is zero too.
    pub direction: Vector3<f64>,
}

/// The magnitude of the split that introduced `v`, from the mesh right after it, or right before the collapse.
///
/// The ring's normal is that of its polygon (half the sum of cross products of consecutive corners). At a
/// boundary the ring is a path and the polygon is closed by its chord.
///
/// # Panics
/// When a neighbour has no point.
pub fn magnitude(mesh: &Mesh, points: &[Point3<f64>], v: VertexId) -> Magnitude {
    let centre = points[v.index()];
    // Relative to v, so that models far from the origin keep their digits.
    let ring = || mesh.vertices_around_vertex(v).map(|w| points[w.index()] - centre);
    let (mut sum, mut area, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    let mut before = ring().last().unwrap_or_default();
    for p in ring() {
        sum += p;
        area += before.cross(&p);
        count += 1.0;
        before = p;
    }
    let direction = area.try_normalize(0.0).unwrap_or_default();
    Magnitude { height: -direction.dot(&sum) / count, direction }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_apex_has_its_height_over_the_rim() {
        let faces: Vec<_> = (0..4).map(|i| [0, i + 1, (i + 1) % 4 + 1]).collect();
        let mesh = Mesh::from_triangles(5, &faces).unwrap();
        let rim = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
        let mut points = vec![Point3::new(5.0, 5.0, 5.75)];
        points.extend(rim.map(|(x, y)| Point3::new(5.0 + x, 5.0 + y, 5.0)));
        let m = magnitude(&mesh, &points, VertexId::new(0));
        assert_eq!(m.direction, Vector3::z());
        assert!((m.height - 0.75).abs() < 1e-15);
    }
}
