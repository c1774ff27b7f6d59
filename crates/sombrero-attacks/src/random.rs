//! Random rotations and directions, without trigonometry, so the same everywhere.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use sombrero_spatial::sample_ball;

/// All rotations equally likely: an even draw from the four-dimensional ball, as a quaternion.
pub(crate) fn random_rotation<R: Rng + ?Sized>(rng: &mut R) -> UnitQuaternion<f64> {
    loop {
        let [w, i, j, k] = std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0);
        let q = Quaternion::new(w, i, j, k);
        if (1e-4..=1.0).contains(&q.norm_squared()) {
            return Unit::new_normalize(q);
        }
    }
}

/// Any direction, all equally likely.
pub(crate) fn random_direction<R: Rng + ?Sized>(rng: &mut R) -> Vector3<f64> {
    sample_ball(rng).try_normalize(0.0).unwrap_or_else(Vector3::x)
}
