//! A random affine map that keeps volumes: x' = c + A (x - c) about the centroid c of the vertices, with
//!
//!   A = U diag(s) Vᵀ,   U and V any rotations, all equally likely,
//!   ln s = (0, t, 1) ln(1 + S) less its mean,   t even between 0 and 1.
//!
//! So det A = 1, and the condition number, largest over smallest s, is 1 + S for every draw.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::random::random_rotation;
use crate::spec::Given;
use nalgebra::{Matrix3, Point3, Vector3};
use rand::{Rng, RngExt};
use sombrero_mesh::Soup;

/// Draws the map and applies it; `strength` is S.
///
/// # Errors
/// [`AttackError::Parameter`] unless the strength is between 0 and 10.
pub fn affine<R: Rng + ?Sized>(
    soup: &Soup,
    strength: f64,
    rng: &mut R,
) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("strength", strength, (0.0, 10.0), "between 0 and 10")?;
    let map = random_map(strength, rng);
    let centroid = centroid(soup);
    Ok(soup.points.iter().map(|p| centroid + map * (p - centroid)).collect())
}

fn random_map<R: Rng + ?Sized>(strength: f64, rng: &mut R) -> Matrix3<f64> {
    let (u, v) = (random_rotation(rng), random_rotation(rng));
    let spread = libm::log1p(strength);
    let logarithms = Vector3::new(0.0, rng.random::<f64>(), 1.0) * spread;
    let stretches = logarithms.add_scalar(-logarithms.mean()).map(libm::exp);
    u.to_rotation_matrix().matrix() * Matrix3::from_diagonal(&stretches) * v.to_rotation_matrix().matrix()
}

/// The mean of the vertices that faces use.
fn centroid(soup: &Soup) -> Point3<f64> {
    let used = soup.used();
    let count = used.iter().filter(|used| **used).count().max(1) as f64;
    let places = soup.points.iter().zip(used).filter(|(_, used)| *used).map(|(p, _)| p.coords / count);
    Point3::from(places.sum::<Vector3<f64>>())
}

/// A random linear map about the centroid that keeps volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// S, the condition number less one, between 0 and 10.
    pub strength: f64,
}

impl Operation for Affine {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { strength: given.needed_number("strength")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("strength", self.strength.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::moved(soup, affine(soup, self.strength, rng)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn strength_is_the_condition_number_less_one(strength in 0.0..10.0, seed in any::<u64>()) {
            let map = random_map(strength, &mut ChaCha8Rng::seed_from_u64(seed));
            let values = map.singular_values();
            prop_assert!((values.max() / values.min() / (1.0 + strength) - 1.0).abs() < 1e-9);
            prop_assert!((map.determinant() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_centroid_stays() {
        let soup = shapes::bust(6);
        let moved = affine(&soup, 0.5, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let after = centroid(&Soup::new(moved, soup.triangles.clone()));
        assert!((after - centroid(&soup)).norm() < 1e-12 * soup.bounding_box().unwrap().largest_side());
    }
}
