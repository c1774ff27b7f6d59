//! Random vectors.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// A vector drawn evenly from the unit ball, by rejection from the cube: no trigonometry, so the same everywhere.
///
/// Takes three numbers from `rng` for each try, of which about half succeed.
pub fn sample_ball<R: Rng + ?Sized>(rng: &mut R) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| 2.0 * rng.random::<f64>() - 1.0);
        if v.norm_squared() <= 1.0 {
            return v;
        }
    }
}
