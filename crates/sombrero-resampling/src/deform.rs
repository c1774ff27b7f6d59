//! E_deform: a spring on every edge of the original (section 5).
//!
//! ```text
//! E_deform(v*) = Σ over edges {i, j} of (|v_i* - v_j*| - L_ij)²,   L_ij = |v_i - v_j|,
//! ∂/∂v_i* = 2 (1 - L_ij / |v_i* - v_j*|) (v_i* - v_j*).
//! ```
//!
//! A spring without length pulls nowhere.

use nalgebra::Vector3;

/// The energy of one spring between `a` and `b`, and its gradient by `a` (that by `b` is the opposite).
#[inline]
pub(crate) fn spring(a: &Vector3<f64>, b: &Vector3<f64>, rest: f64) -> (f64, Vector3<f64>) {
    let edge = a - b;
    let length = edge.norm();
    let stretch = length - rest;
    let pull = if length > 0.0 { 2.0 * stretch / length } else { 0.0 };
    (stretch * stretch, edge * pull)
}

/// Mean over directions of the second derivative of a spring at rest by one of its ends.
pub(crate) const CURVATURE: f64 = 2.0 / 3.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_gradient, vector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_gradient_is_that_of_finite_differences(a in vector(), b in vector(), rest in 0.0..2.0f64) {
            prop_assume!((a - b).norm() > 0.05);
            assert_gradient(&[a, b], |[a, b], gradient| {
                let (energy, of_a) = spring(a, b, rest);
                gradient[0] += of_a;
                gradient[1] -= of_a;
                energy
            });
        }
    }

    #[test]
    fn rest_and_collapse_pull_nowhere() {
        let (a, b) = (Vector3::x(), Vector3::y());
        assert_eq!(spring(&a, &b, 2f64.sqrt()).0, 0.0);
        assert_eq!(spring(&a, &a, 1.0), (1.0, Vector3::zeros()));
    }
}
