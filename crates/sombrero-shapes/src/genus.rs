//! A slab with holes.

use super::blocks::{Axis, boundary};
use sombrero_mesh::Soup;

/// A closed surface of genus `g`: a slab 2 g + 1 long (x), 3 wide (y), 1 thick (z), with `g` square holes of
/// side 1 through it in a row, one corner in the origin.
///
/// Each unit square is cut into `resolution`² squares of two triangles: (18 g + 14) r² + 2 - 2 g vertices.
/// `g` is moved into 0..=100, `resolution` into 1..=100.
///
/// ```
/// let pretzel = sombrero_shapes::genus(3, 2);
/// assert_eq!(pretzel.points.len(), (18 * 3 + 14) * 4 + 2 - 6);
/// ```
pub fn genus(g: usize, resolution: usize) -> Soup {
    let length = 2 * g.min(100) + 1;
    let step = 1.0 / resolution.clamp(1, 100) as f64;
    let axis = |units: usize| {
        let borders: Vec<f64> = (0..=units).map(|b| b as f64).collect();
        Axis::new(&borders, step, 0.0)
    };
    // Every other unit of the middle row is a hole, so holes never touch each other or the rim.
    let hole = |x: f64, y: f64| y > 1.0 && y < 2.0 && x as usize % 2 == 1;
    boundary(&[axis(length), axis(3), axis(1)], |p| !hole(p.x, p.y), |p| p)
}
