//! Random triangles, and derivatives by finite differences.

use nalgebra::Vector3;
use proptest::prelude::*;

pub(crate) fn vector() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(Vector3::from)
}

pub(crate) fn triangle() -> impl Strategy<Value = [Vector3<f64>; 3]> {
    [vector(), vector(), vector()]
}

/// Checks the gradient that `energy` adds to its second argument against central differences.
pub(crate) fn assert_gradient<const N: usize>(
    at: &[Vector3<f64>; N],
    energy: impl Fn(&[Vector3<f64>; N], &mut [Vector3<f64>; N]) -> f64,
) {
    const STEP: f64 = 1e-5;
    let mut gradient = [Vector3::zeros(); N];
    let value = energy(at, &mut gradient);
    let scale = value.abs() + gradient.iter().map(Vector3::norm).sum::<f64>() + 1.0;
    for i in 0..N {
        for axis in 0..3 {
            let shifted = |step: f64| {
                let mut x = *at;
                x[i][axis] += step;
                energy(&x, &mut [Vector3::zeros(); N])
            };
            let difference = (shifted(STEP) - shifted(-STEP)) / (2.0 * STEP);
            let error = (difference - gradient[i][axis]).abs();
            assert!(error < 1e-5 * scale, "corner {i} axis {axis}: {difference} and {}", gradient[i][axis]);
        }
    }
}
