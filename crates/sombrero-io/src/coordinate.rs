//! Coordinates that can be stored.

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::error::WriteError;

/// The 32-bit float nearest to a coordinate of a vertex, unless it is beyond all of them.
pub(crate) fn narrow(vertex: usize, value: f64) -> Result<f32, WriteError> {
    let narrow = value as f32;
    if narrow.is_finite() { Ok(narrow) } else { Err(WriteError::Overflow { vertex, value }) }
}

/// Refuses points that are infinite or not a number.
pub(crate) fn check_finite(points: &[Point3<f64>]) -> Result<(), WriteError> {
    match points.iter().position(|p| !is_finite(p)) {
        Some(vertex) => Err(WriteError::NonFinite { vertex }),
        None => Ok(()),
    }
}

/// The distance between 32-bit floats that are as large as `x`.
pub(crate) fn step_of_single(x: f64) -> f64 {
    let x = (x as f32).abs().min(f32::MAX / 2.0);
    f64::from(f32::from_bits(x.to_bits() + 1) - x)
}

/// The steps of a format that stores 32-bit floats, one for each vertex.
pub(crate) fn steps_of_singles(soup: &Soup) -> Vec<f32> {
    soup.points.iter().map(|p| step_of_single(p.coords.amax()) as f32).collect()
}

/// Whether all three coordinates are finite.
pub(crate) fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|c| c.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_double_with_every_power_of_two() {
        assert_eq!(step_of_single(1.0), f64::from(f32::EPSILON));
        assert_eq!(step_of_single(-5.0), 4.0 * f64::from(f32::EPSILON));
        assert!(step_of_single(f64::NAN).is_nan() || step_of_single(f64::NAN) > 0.0);
        assert!(step_of_single(1e300).is_finite());
    }

    #[test]
    fn what_rounds_to_the_largest_float_fits() {
        assert_eq!(narrow(7, f64::from(f32::MAX)).unwrap(), f32::MAX);
        assert!(matches!(narrow(7, -1e39), Err(WriteError::Overflow { vertex: 7, value: -1e39 })));
    }
}
