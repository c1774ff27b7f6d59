//! The vase.

use core::f64::consts::{PI, TAU};

use nalgebra::Point3;

use sombrero_mesh::Soup;

/// How far the first ring is from the lower pole, and the last from the upper, along the wall.
const POLE: f64 = 0.03;

/// A turned body about the z axis with a wavy wall and `around * along + 2` vertices, genus 0: its connectivity goes onto itself
/// in twice as many ways as it has segments around, its shape in one.
///
/// Segment counts are moved into 3..=4096.
///
/// ```
/// let vase = sombrero_shapes::vase(24, 12);
/// assert_eq!((vase.points.len(), vase.triangles.len()), (290, 576));
/// ```
pub fn vase(around: usize, along: usize) -> Soup {
    let (m, n) = (around.clamp(3, 4096), along.clamp(3, 4096));
    let mut points = Vec::with_capacity(m * n + 2);
    for j in 0..n {
        let t = POLE + (PI - 2.0 * POLE) * j as f64 / (n - 1) as f64;
        for i in 0..m {
            let a = TAU * i as f64 / m as f64;
            let waves = 0.06 * libm::cos(5.0 * a + 2.0 * t) + 0.03 * libm::sin(2.0 * a);
            let radius = libm::sin(t) * (1.0 + 0.25 * libm::sin(3.0 * t + 0.5)) * (1.0 + waves);
            points.push(Point3::new(radius * libm::cos(a), radius * libm::sin(a), -1.6 * libm::cos(t)));
        }
    }
    let (lower, upper) = ((m * n) as u32, (m * n + 1) as u32);
    points.extend([-1.62, 1.62].map(|z| Point3::new(0.0, 0.0, z)));
    let mut triangles = Vec::with_capacity(2 * m * n);
    for i in 0..m {
        let at = |di: usize, j: usize| (j * m + (i + di) % m) as u32;
        triangles.push([lower, at(1, 0), at(0, 0)]);
        for j in 0..n - 1 {
            triangles.push([at(0, j), at(1, j), at(1, j + 1)]);
            triangles.push([at(0, j), at(1, j + 1), at(0, j + 1)]);
        }
        triangles.push([upper, at(0, n - 1), at(1, n - 1)]);
    }
    Soup::new(points, triangles)
}
