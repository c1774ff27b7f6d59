//! A random projective map: x' = c + (x - c) / (1 + S a · (x - c) / s) about the centre c of the bounding box,
//! with its largest side s and an even draw of the unit vector a.
//!
//! Straight lines and planes stay straight and plane; what lies ahead along a shrinks, what lies behind grows.
//! No vertex of the box is further from c than √3/2 s, so the denominator is above 1 - √3/2 when S < 1.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::random::random_direction;
use crate::spec::Given;
use nalgebra::{Point3, center};
use rand::Rng;
use sombrero_mesh::Soup;

/// Below all denominators of vertices that faces use; keeps stray vertices off the horizon.
const LEAST_DENOMINATOR: f64 = 0.1;

/// Draws the map and applies it; `strength` is S.
///
/// # Errors
/// [`AttackError::Parameter`] unless the strength is at least 0 and below 1.
pub fn projective<R: Rng + ?Sized>(
    soup: &Soup,
    strength: f64,
    rng: &mut R,
) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("strength", strength, (0.0, 1.0_f64.next_down()), "at least 0 and below 1")?;
    let towards = random_direction(rng);
    let Some((bounds, side)) = soup.bounding_box().map(|b| (b, b.largest_side())).filter(|b| b.1 > 0.0)
    else {
        return Ok(soup.points.clone());
    };
    let centre = center(&bounds.min, &bounds.max);
    let moved = |p: &Point3<f64>| {
        let seen = p - centre;
        let denominator = 1.0 + strength * towards.dot(&(seen / side));
        centre + seen / denominator.max(LEAST_DENOMINATOR)
    };
    Ok(soup.points.iter().map(moved).collect())
}

/// A random projective map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projective {
    /// S, by how much sizes differ across the box, roughly; at least 0 and below 1.
    pub strength: f64,
}

impl Operation for Projective {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { strength: given.needed_number("strength")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("strength", self.strength.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::moved(soup, projective(soup, self.strength, rng)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_mesh::{geometry, repair};
    use sombrero_shapes as shapes;

    /// The cube and a fourth point on the plane and a third on the line of others.
    fn probe() -> Soup {
        let mut soup = shapes::cube();
        let (a, b, c) = (soup.points[0], soup.points[3], soup.points[6]);
        soup.points.push(a + (b - a) * 0.3);
        soup.points.push(a + (b - a) * 0.4 + (c - a) * 0.4);
        soup
    }

    proptest! {
        #[test]
        fn lines_and_planes_stay(strength in 0.0..0.999, seed in any::<u64>()) {
            let soup = probe();
            let moved = projective(&soup, strength, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let [a, b, c] = [moved[0], moved[3], moved[6]];
            let [on_line, on_plane] = [moved[8], moved[9]];
            prop_assert!((on_line - a).cross(&(b - a)).norm() < 1e-10 * (b - a).norm_squared());
            let normal: Vector3<f64> = (b - a).cross(&(c - a));
            prop_assert!((on_plane - a).dot(&normal.normalize()).abs() < 1e-10);
            prop_assert!(moved.iter().all(|p| p.iter().all(|x| x.is_finite())));
        }

        #[test]
        fn the_surface_is_not_turned_inside_out(strength in 0.0..0.999, seed in any::<u64>()) {
            let soup = shapes::sphere(2);
            let moved = projective(&soup, strength, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            prop_assert!(geometry::volume(&repair(&soup).mesh, &moved) > 0.0);
        }
    }

    #[test]
    fn no_strength_no_change() {
        let soup = shapes::sphere(2);
        let moved = projective(&soup, 0.0, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        assert!(moved.iter().zip(&soup.points).all(|(p, q)| (p - q).norm() < 1e-15));
    }
}
