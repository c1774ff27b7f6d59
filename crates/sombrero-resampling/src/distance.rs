//! E_dist: how far the samples of the suspect are from the deforming original (section 5).
//!
//! ```text
//! E_dist(v*) = Σ over samples s of |s - π(s)|²,   π(s) = b₁ v₁* + b₂ v₂* + b₃ v₃*,
//! ```
//!
//! where π(s) is the projection of s, the closest point of the deforming original. Moving a vertex moves
//! the foot π(s) as well, and where the foot slides along the surface the distance does not change. With
//! the foot held at its barycentric coordinates the sum would resist that sliding, and many rounds
//! of projection would be needed. So within a round the distance is measured along u, the unit vector
//! from foot to sample (the face's normal when they are one), which is the true distance to first order,
//! and only a part μ of the rest is kept to hold the step together:
//!
//! ```text
//! e_s(v*) = (1 - μ) (u · r)² + μ |r|²,   r = s - b₁ v₁* - b₂ v₂* - b₃ v₃*,
//! ∂e_s/∂v_i* = -2 b_i ((1 - μ) (u · r) u + μ r).
//! ```
//!
//! At the start of a round r is parallel to u, so value and gradient there are those of E_dist for any μ
//! (a foot keeps its distance to first order when its coordinates change), and a point where the rounds
//! rest is a stationary point of E_dist itself. μ = 1 is the plain reading.

use nalgebra::Vector3;

/// A sample held by a face of the original.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Attachment {
    /// s.
    pub(crate) sample: Vector3<f64>,
    /// b, in the order of the face's corners.
    pub(crate) barycentric: [f64; 3],
    /// u.
    pub(crate) direction: Vector3<f64>,
}

impl Attachment {
    /// e_s, its gradient by the face's corners added to `gradient`.
    #[inline]
    pub(crate) fn energy(
        &self,
        corners: &[Vector3<f64>; 3],
        resistance: f64,
        gradient: &mut [Vector3<f64>; 3],
    ) -> f64 {
        let b = &self.barycentric;
        let r = self.sample - corners[0] * b[0] - corners[1] * b[1] - corners[2] * b[2];
        let along = self.direction.dot(&r);
        let pull = self.direction * ((1.0 - resistance) * along) + r * resistance;
        for (gradient, b) in gradient.iter_mut().zip(b) {
            *gradient -= pull * (2.0 * b);
        }
        pull.dot(&r)
    }

    /// Mean over directions of the second derivative by corner `i`.
    pub(crate) fn curvature(&self, i: usize, resistance: f64) -> f64 {
        let b = self.barycentric[i];
        2.0 * b * b * ((1.0 - resistance) / 3.0 + resistance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_gradient, triangle, vector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_gradient_is_that_of_finite_differences(
            corners in triangle(), sample in vector(), direction in vector(),
            u in 0.0..1.0f64, v in 0.0..1.0f64, resistance in 0.0..=1.0f64
        ) {
            let barycentric = [(1.0 - u) * (1.0 - v), u * (1.0 - v), v];
            let direction = direction.try_normalize(1e-3).unwrap_or(Vector3::x());
            let attachment = Attachment { sample, barycentric, direction };
            assert_gradient(&corners, |c, g| attachment.energy(c, resistance, g));
        }

        #[test]
        fn value_and_gradient_are_the_distances_when_the_round_starts(
            corners in triangle(), height in -1.0..1.0f64, u in 0.1..0.5f64, v in 0.1..0.4f64, resistance in 0.0..=1.0f64
        ) {
            let direction = crate::projection::normal(&corners);
            prop_assume!(direction != Vector3::zeros());
            let barycentric = [1.0 - u - v, u, v];
            let foot = corners[0] * barycentric[0] + corners[1] * u + corners[2] * v;
            let attachment = Attachment { sample: foot + direction * height, barycentric, direction };
            let (mut sliding, mut plain) = ([Vector3::zeros(); 3], [Vector3::zeros(); 3]);
            let e = attachment.energy(&corners, resistance, &mut sliding);
            prop_assert!((e - height * height).abs() < 1e-12);
            attachment.energy(&corners, 1.0, &mut plain);
            for (s, p) in sliding.iter().zip(&plain) {
                prop_assert!((s - p).norm() < 1e-12);
            }
        }
    }
}
