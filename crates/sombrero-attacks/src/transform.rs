//! Similarity transforms (row G): rotation, translation and uniform scale.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::random::random_rotation;
use crate::spec::Given;
use nalgebra::{Quaternion, Similarity3, Translation3, Unit, UnitQuaternion};
use rand::{Rng, RngExt};
use sombrero_mesh::Soup;
use sombrero_spatial::sample_ball;

/// What to fix of a random similarity; the default draws everything.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Transform {
    /// Angle in degrees about a random axis; `None` draws any rotation, all equally likely.
    pub rotation: Option<f64>,
    /// Length of the translation as a multiple of the largest side, in a random direction; `None` draws
    /// a vector from the ball whose radius is the largest side.
    pub translation: Option<f64>,
    /// The factor; `None` draws it between 1/2 and 2, halving and doubling equally likely.
    pub scale: Option<f64>,
}

/// Draws a similarity about the centre of the soup's bounding box.
///
/// # Errors
/// [`AttackError::Parameter`] when the scale is not positive or a number is not finite.
pub fn random_similarity<R: Rng + ?Sized>(
    transform: &Transform,
    soup: &Soup,
    rng: &mut R,
) -> Result<Similarity3<f64>, AttackError> {
    let bounds = soup.bounding_box().ok_or(AttackError::NothingLeft)?;
    let rotation = match transform.rotation {
        None => random_rotation(rng),
        Some(degrees) => {
            in_range("rotation", degrees, (-360.0, 360.0), "an angle between -360 and 360 degrees")?;
            rotation_about(sample_ball(rng), degrees)
        }
    };
    let shift = match transform.translation {
        None => sample_ball(rng),
        Some(length) => {
            in_range("translation", length, (0.0, 1e6), "between 0 and 1e6 times the largest side")?;
            sample_ball(rng).try_normalize(0.0).unwrap_or_default() * length
        }
    };
    let scale = match transform.scale {
        None => libm::exp2(2.0 * rng.random::<f64>() - 1.0),
        Some(scale) => {
            in_range("scale", scale, (1e-6, 1e6), "between 1e-6 and 1e6")?;
            scale
        }
    };
    let centre = nalgebra::center(&bounds.min, &bounds.max).coords;
    let about_origin = Similarity3::from_parts(Translation3::identity(), rotation, scale);
    let back = Translation3::from(centre + shift * bounds.largest_side());
    Ok(back * about_origin * Translation3::from(-centre))
}

fn rotation_about(axis: nalgebra::Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
    let axis = axis.try_normalize(0.0).unwrap_or_else(nalgebra::Vector3::x);
    let (sin, cos) = libm::sincos(degrees.to_radians() / 2.0);
    Unit::new_normalize(Quaternion::from_parts(cos, axis * sin))
}

impl Operation for Transform {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self {
            rotation: given.number("rotation")?,
            translation: given.number("translation")?,
            scale: given.number("scale")?,
        })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        let all = [("rotation", self.rotation), ("translation", self.translation), ("scale", self.scale)];
        all.into_iter().filter_map(|(name, value)| Some((name, value?.to_string()))).collect()
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        let similarity = random_similarity(self, soup, rng)?;
        Ok(Attacked::moved(soup, soup.points.iter().map(|p| similarity * p).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    fn centre_of(points: &[Point3<f64>]) -> Point3<f64> {
        Point3::from(points.iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / points.len() as f64)
    }

    #[test]
    fn what_is_given_is_kept() {
        let soup = shapes::sphere(2);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let given = Transform { rotation: Some(30.0), translation: Some(0.25), scale: Some(3.0) };
        let s = random_similarity(&given, &soup, &mut rng).unwrap();
        assert!((s.scaling() - 3.0).abs() < 1e-12);
        assert!((s.isometry.rotation.angle().to_degrees() - 30.0).abs() < 1e-9);
        let moved: Vec<_> = soup.points.iter().map(|p| s * p).collect();
        let side = soup.bounding_box().unwrap().largest_side();
        assert!(((centre_of(&moved) - centre_of(&soup.points)).norm() - 0.25 * side).abs() < 1e-9);
    }

    #[test]
    fn draws_cover_all_rotations() {
        let soup = shapes::tetrahedron();
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let draws: Vec<_> =
            (0..4000).map(|_| random_similarity(&Transform::default(), &soup, &mut rng).unwrap()).collect();
        // The image of any direction is even on the sphere: its mean vanishes.
        let mean: nalgebra::Vector3<f64> = draws
            .iter()
            .map(|s| s.isometry.rotation * nalgebra::Vector3::x())
            .sum::<nalgebra::Vector3<f64>>()
            / 4000.0;
        assert!(mean.norm() < 0.05);
        assert!(draws.iter().all(|s| (0.5..=2.0).contains(&s.scaling())));
    }
}
