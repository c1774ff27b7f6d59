//! Uniform quantisation of the coordinates, as in the benchmark of Wang, Lavoué, Denis, Baskurt and He
//! ("A Benchmark for 3D Mesh Watermarking", 2010): each coordinate goes to the nearest of 2^B levels.
//!
//! With the smallest corner m of the bounding box and its largest side s
//!
//!   k = round((x - m) (2^B - 1) / s),   x' = m + s k / (2^B - 1).
//!
//! The largest side serves all three axes, so the cells are cubes and the lattice has no direction of its own.
//! Faces that lose their area stay, so vertices keep their numbers.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::Soup;

/// Rounds the coordinates to `bits` bits. Vertices that no face uses go to the nearest level too.
///
/// # Errors
/// [`AttackError::Parameter`] unless there are 1 to 24 bits.
pub fn quantize(soup: &Soup, bits: u32) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("bits", f64::from(bits), (1.0, 24.0), "between 1 and 24")?;
    let last = f64::from((1u32 << bits) - 1);
    let Some((bounds, side)) = soup.bounding_box().map(|b| (b, b.largest_side())) else {
        return Ok(soup.points.clone());
    };
    if side == 0.0 {
        return Ok(soup.points.clone());
    }
    let level = |x: f64, least: f64| (((x - least) / side * last).round() / last).clamp(0.0, 1.0);
    let rounded = |p: &Point3<f64>| bounds.min + p.coords.zip_map(&bounds.min.coords, level) * side;
    Ok(soup.points.iter().map(rounded).collect())
}

/// Coordinates rounded to the nearest of 2^`bits` levels along the largest side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantization {
    /// Bits of a coordinate, between 1 and 24.
    pub bits: u32,
}

impl Operation for Quantization {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let bits = given.whole("bits")?;
        Ok(Self { bits: given.needed("bits", bits)? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("bits", self.bits.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::moved(soup, quantize(soup, self.bits)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn errors_are_half_a_cell_and_happen_once(bits in 1u32..=24, scale in 1e-3..1e3, shift in -5.0..5.0) {
            let mut soup = shapes::bumpy_sphere(300);
            soup.points.iter_mut().for_each(|p| *p = Point3::from(p.coords.add_scalar(shift) * scale));
            let side = soup.bounding_box().unwrap().largest_side();
            let cell = side / f64::from((1u32 << bits) - 1);
            let once = Soup::new(quantize(&soup, bits).unwrap(), soup.triangles.clone());
            for (p, q) in soup.points.iter().zip(&once.points) {
                prop_assert!((p - q).amax() <= cell * (0.5 + 1e-6), "{} > {cell}", (p - q).amax());
            }
            let twice = quantize(&once, bits).unwrap();
            prop_assert!(once.points.iter().zip(&twice).all(|(p, q)| (p - q).amax() <= 1e-13 * side * (1.0 + shift.abs())));
        }
    }

    #[test]
    fn one_bit_leaves_the_corners_of_the_box() {
        let cube = shapes::cube();
        assert_eq!(quantize(&cube, 1).unwrap(), cube.points);
        let sphere = shapes::sphere(2);
        let bounds = sphere.bounding_box().unwrap();
        let corner = |x: f64, low: f64, high: f64| x == low || x == high;
        assert!(quantize(&sphere, 1).unwrap().iter().all(|p| (0..3).all(|k| corner(
            p[k],
            bounds.min[k],
            bounds.max[k]
        ))));
    }
}
