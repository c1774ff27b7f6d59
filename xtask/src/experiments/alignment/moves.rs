//! Random directions and maps.

use nalgebra::{Matrix3, Matrix4, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) fn random_direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        if (1e-3..=1.0).contains(&v.norm_squared()) {
            return v.normalize();
        }
    }
}

pub(super) fn random_rotation(rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    loop {
        let q: [f64; 4] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        let q = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
        if (1e-3..=1.0).contains(&q.norm_squared()) {
            return UnitQuaternion::from_quaternion(q);
        }
    }
}

/// Any rotation, scales from 0.1 to 10, shifts up to 100.
pub(super) fn random_similarity(rng: &mut ChaCha8Rng) -> Similarity3<f64> {
    let shift = Vector3::from_fn(|_, _| rng.random_range(-100.0..100.0));
    let scale = 10f64.powf(rng.random_range(-1.0..1.0));
    Similarity3::from_parts(Translation3::from(shift), random_rotation(rng), scale)
}

/// R diag(1, a, c) Rᵀ with 1 ≤ a ≤ c ≤ 1.5.
pub(super) fn random_affine(rng: &mut ChaCha8Rng) -> Matrix4<f64> {
    let largest = rng.random_range(1.0..1.5);
    let stretch = Vector3::new(1.0, rng.random_range(1.0..=largest), largest);
    let axes: Rotation3<f64> = random_rotation(rng).to_rotation_matrix();
    let linear: Matrix3<f64> = axes.matrix() * Matrix3::from_diagonal(&stretch) * axes.matrix().transpose();
    linear.to_homogeneous()
}
