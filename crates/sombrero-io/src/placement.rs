//! Where a scene puts a stored mesh: an affine map and its inverse.
//!
//! ```text
//! world = A stored + t,   stored = A⁻¹ (world - t)
//! ```

use std::ops::Range;

use nalgebra::{Matrix3, Matrix4, Point3, Vector3};
use sombrero_mesh::Place;

/// Vertices at all their places: as many are followed, so that no file can show more than anybody could hold.
pub(crate) const MOST_SHOWN: usize = 1 << 23;

/// An affine map that can be undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placement {
    linear: Matrix3<f64>,
    inverse: Matrix3<f64>,
    shift: Vector3<f64>,
    identity: bool,
}

impl Placement {
    /// Everything where it is stored.
    pub(crate) fn identity() -> Self {
        Self {
            linear: Matrix3::identity(),
            inverse: Matrix3::identity(),
            shift: Vector3::zeros(),
            identity: true,
        }
    }

    /// The map of a matrix whose last row is 0 0 0 1; `None` when it flattens space or is not finite.
    pub(crate) fn new(matrix: &Matrix4<f64>) -> Option<Self> {
        if *matrix == Matrix4::identity() {
            return Some(Self::identity());
        }
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let shift: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        let inverse = linear.try_inverse()?;
        let finite = |m: &[f64]| m.iter().all(|x| x.is_finite());
        let usable = finite(linear.as_slice()) && finite(inverse.as_slice()) && finite(shift.as_slice());
        usable.then_some(Self { linear, inverse, shift, identity: false })
    }

    /// Where the scene shows a stored point.
    pub(crate) fn world(&self, stored: &Point3<f64>) -> Point3<f64> {
        // Not multiplied by one: a product of -0 and 1 added to 0 is no longer -0.
        if self.identity { *stored } else { Point3::from(self.linear * stored.coords + self.shift) }
    }

    /// What to store for a point that the scene is to show at `world`.
    pub(crate) fn stored(&self, world: &Point3<f64>) -> Point3<f64> {
        if self.identity { *world } else { Point3::from(self.inverse * (world.coords - self.shift)) }
    }

    /// What takes a point from where `first` shows it to where this shows it.
    pub(crate) fn after(&self, first: &Self, vertices: Range<u32>) -> Place {
        let linear = self.linear * first.inverse;
        Place { vertices, linear, shift: self.shift - linear * first.shift }
    }

    /// The factor by which it makes distances larger, at most.
    pub(crate) fn scale(&self) -> f64 {
        self.linear.norm()
    }

    /// t: where the origin goes.
    pub(crate) fn shift(&self) -> Vector3<f64> {
        self.shift
    }

    /// A: what becomes of directions.
    pub(crate) fn linear(&self) -> &Matrix3<f64> {
        &self.linear
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let matrix =
            Matrix4::new(2.0, 0.0, 1.0, 5.0, 0.0, -3.0, 0.0, 6.0, 0.0, 0.5, 4.0, 7.0, 0.0, 0.0, 0.0, 1.0);
        let placement = Placement::new(&matrix).unwrap();
        let p = Point3::new(0.3, -0.7, 11.0);
        assert!((placement.stored(&placement.world(&p)) - p).norm() < 1e-13);
        assert_eq!(placement.world(&Point3::origin()), Point3::new(5.0, 6.0, 7.0));
    }

    #[test]
    fn nothing_changes_a_bit_of_what_is_not_moved() {
        let p = Point3::new(-0.0, 1e-310, 3.3);
        assert_eq!(Placement::new(&Matrix4::identity()).unwrap().world(&p).x.to_bits(), p.x.to_bits());
    }

    #[test]
    fn a_flat_map_is_none() {
        let mut matrix = Matrix4::identity();
        matrix[(2, 2)] = 0.0;
        assert_eq!(Placement::new(&matrix), None);
        matrix[(2, 2)] = f64::NAN;
        assert_eq!(Placement::new(&matrix), None);
    }
}
