//! E_flip: a penalty on faces that have turned over (section 5).
//!
//! ```text
//! E_flip(v*) = Σ over faces of min(0, δ)²,   δ = N* · n / |N|,   N* = (b - a) × (c - a),
//! ```
//!
//! with N the original's area vector of the face and n = N / |N|. The paper takes the product of the two
//! unit normals. Here the present normal keeps its length, relative to the original's, so δ is the cosine
//! times the ratio of areas: it has the same sign, equals the paper's on a face of unchanged area, and is a
//! polynomial, where the cosine jumps when a face shrinks to nothing and turns over.
//!
//! ```text
//! ∂/∂a = (b - c) × g,   ∂/∂b = (c - a) × g,   ∂/∂c = (a - b) × g,   g = 2 δ n / |N|   where δ < 0.
//! ```
//!
//! A face whose original has no area has no normal to keep and no penalty.

use nalgebra::Vector3;

/// `weight` times the energy of one face, `normal` being n / |N|; its gradient is added to `gradient`.
#[inline]
pub(crate) fn turned(
    [a, b, c]: &[Vector3<f64>; 3],
    normal: &Vector3<f64>,
    weight: f64,
    gradient: &mut [Vector3<f64>; 3],
) -> f64 {
    let delta = (b - a).cross(&(c - a)).dot(normal);
    if delta >= 0.0 {
        return 0.0;
    }
    let g = normal * (2.0 * weight * delta);
    gradient[0] += (b - c).cross(&g);
    gradient[1] += (c - a).cross(&g);
    gradient[2] += (a - b).cross(&g);
    weight * delta * delta
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_gradient, triangle, vector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_gradient_is_that_of_finite_differences(corners in triangle(), normal in vector(), weight in 0.0..10.0f64) {
            assert_gradient(&corners, |c, g| turned(c, &normal, weight, g));
        }

        #[test]
        fn downhill_turns_the_face_back(corners in triangle(), normal in vector()) {
            let mut gradient = [Vector3::zeros(); 3];
            let before = turned(&corners, &normal, 1.0, &mut gradient);
            prop_assume!(before > 1e-6);
            let moved = [0, 1, 2].map(|i| corners[i] - gradient[i] * 1e-4);
            prop_assert!(turned(&moved, &normal, 1.0, &mut [Vector3::zeros(); 3]) < before);
        }
    }

    #[test]
    fn a_mirrored_face_costs_its_weight() {
        let face = [Vector3::zeros(), Vector3::x() * 2.0, Vector3::y()];
        let mut gradient = [Vector3::zeros(); 3];
        // |N| = 2.
        assert_eq!(turned(&face, &(Vector3::z() / 2.0), 7.0, &mut gradient), 0.0);
        assert_eq!(gradient, [Vector3::zeros(); 3]);
        assert_eq!(turned(&face, &(-Vector3::z() / 2.0), 7.0, &mut gradient), 7.0);
    }
}
