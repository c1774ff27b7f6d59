//! Which positions take part.

use nalgebra::Point3;

/// Largest coordinate that takes part, in model units.
///
/// Projection onto a triangle multiplies four lengths; with coordinates up to this size no product overflows.
const LARGEST: f64 = 1e70;

/// Whether all coordinates are finite and small enough to compute with.
pub(crate) fn usable(p: &Point3<f64>) -> bool {
    // A comparison with NaN is false.
    p.iter().all(|x| x.abs() <= LARGEST)
}

/// The corners of a triangle; `None` when an index is out of range or a corner is not [`usable`].
pub(crate) fn corners(points: &[Point3<f64>], triangle: [u32; 3]) -> Option<[Point3<f64>; 3]> {
    let corner = |i: u32| points.get(i as usize).copied().filter(usable);
    let [a, b, c] = triangle;
    Some([corner(a)?, corner(b)?, corner(c)?])
}
