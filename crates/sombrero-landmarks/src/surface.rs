//! A surface as even points with normals.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::geometry::area_vector;
use sombrero_mesh::vertex_normals;
use sombrero_spatial::spread_samples;

/// A point of a surface with its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Where it is.
    pub point: Point3<f64>,
    /// Of length 1, smoothed over the neighbouring faces; 0 where there is none.
    pub normal: Vector3<f64>,
}

/// `count` points of a surface, each standing for the same area; none when it has no area.
///
/// Normals are the sums of the area vectors around the corners, weighed by barycentric coordinates: noise on the
/// vertices shakes them less than those of the faces. Vertices at equal positions are to be joined first
/// ([`sombrero_mesh::Weld`]).
///
/// # Panics
/// When a triangle names a vertex that does not exist.
pub fn surface_points(points: &[Point3<f64>], triangles: &[[u32; 3]], count: usize) -> Vec<SurfacePoint> {
    let normals = vertex_normals(points, triangles);
    let places = spread_samples(points, triangles, count).into_iter();
    let sample = |place: sombrero_spatial::SurfaceSample| {
        let corners = triangles[place.face as usize].iter().zip(place.barycentric);
        let normal: Vector3<f64> = corners.map(|(&v, w)| normals[v as usize] * w).sum();
        let point = place.point(points, triangles)?;
        Some(SurfacePoint { point, normal: normal.try_normalize(0.0).unwrap_or_default() })
    };
    places.filter_map(sample).collect()
}

/// Area of a surface, in squares of the unit of its points.
///
/// # Panics
/// When a triangle names a vertex that does not exist.
pub fn area(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let of_triangle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| &points[v as usize]);
        area_vector(a, b, c).norm() / 2.0
    };
    triangles.iter().map(of_triangle).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn a_sphere_has_the_normals_of_a_sphere() {
        let ball = shapes::sphere(4);
        let points = surface_points(&ball.points, &ball.triangles, 500);
        assert_eq!(points.len(), 500);
        assert!(points.iter().all(|s| s.normal.dot(&s.point.coords.normalize()) > 0.999));
        let radius = ball.points[0].coords.norm();
        let round = 4.0 * std::f64::consts::PI * radius * radius;
        assert!((area(&ball.points, &ball.triangles) / round - 1.0).abs() < 0.01);
    }

    #[test]
    fn no_area_no_points() {
        assert_eq!(surface_points(&[Point3::origin()], &[[0, 0, 0]], 5), []);
    }
}
