//! The torus.

use core::f64::consts::TAU;

use nalgebra::Point3;

use sombrero_mesh::Soup;

/// A torus about the z axis with `major_segments * minor_segments` vertices, genus 1.
///
/// The tube of radius `minor_radius` has its centre line at distance `major_radius` from the origin, in the
/// plane z = 0. Segment counts are moved into 3..=4096. The surface is free of self-intersections for
/// 0 < `minor_radius` < `major_radius`; other radii are taken as they are.
///
/// ```
/// let ring = sombrero_shapes::torus(24, 12, 2.0, 0.5);
/// assert_eq!((ring.points.len(), ring.triangles.len()), (288, 576));
/// ```
pub fn torus(major_segments: usize, minor_segments: usize, major_radius: f64, minor_radius: f64) -> Soup {
    let (m, n) = (major_segments.clamp(3, 4096), minor_segments.clamp(3, 4096));
    let mut points = Vec::with_capacity(m * n);
    let mut triangles = Vec::with_capacity(2 * m * n);
    for i in 0..m {
        let (sin_u, cos_u) = libm::sincos(TAU * i as f64 / m as f64);
        for j in 0..n {
            let (sin_v, cos_v) = libm::sincos(TAU * j as f64 / n as f64);
            let out = major_radius + minor_radius * cos_v;
            points.push(Point3::new(out * cos_u, out * sin_u, minor_radius * sin_v));
            let at = |di: usize, dj: usize| ((i + di) % m * n + (j + dj) % n) as u32;
            triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
            triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
        }
    }
    Soup::new(points, triangles)
}
