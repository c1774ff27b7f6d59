//! A motion in words: turned, made larger or smaller, stretched, shifted.

use super::words::{decimal, percent};
use nalgebra::{Matrix3, Matrix4, Vector3};

/// A difference of stretches below which a map counts as a similarity.
const EVEN: f64 = 1e-6;

/// What the matrix does, ready to follow "The suspect was moved: "; `None` when it is no motion. `side` is the length
/// that shifts are compared with.
///
/// The linear part is A = U S Vᵀ. Its turn is R = U Vᵀ, up to a reflection, and S holds the three stretches.
pub(super) fn in_words(matrix: &[[f64; 4]; 4], side: f64) -> Option<String> {
    let matrix = Matrix4::from_fn(|row, column| matrix[row][column]);
    if !matrix.iter().all(|value| value.is_finite()) {
        return None;
    }
    let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let svd = linear.try_svd(true, true, f64::EPSILON, 100)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let stretches = svd.singular_values;
    if !stretches.iter().all(|s| s.is_finite() && *s > 0.0) {
        return None;
    }
    let mirrored = (u * v_t).determinant() < 0.0;
    let turn = if mirrored { -(u * v_t) } else { u * v_t };
    let mut parts = vec![turned(&turn)];
    if mirrored {
        parts.push("mirrored at the origin".into());
    }
    parts.push(scaled(&stretches));
    let shift: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    parts.push(format!("and then shifted by {} of the largest side", percent(shift.norm() / side)));
    Some(parts.join(", "))
}

/// The angle from the trace, 1 + 2 cos θ, and from the skew part, whose length is 2 sin θ and which is the axis.
fn turned(turn: &Matrix3<f64>) -> String {
    let skew =
        Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]);
    let degrees = skew.norm().atan2(turn.trace() - 1.0).to_degrees();
    if degrees < 0.005 {
        return "not turned by as much as 0.01°".into();
    }
    let angle = format!("turned by {}°", decimal(degrees, 2));
    // Near a half turn the skew part vanishes, and with it the axis.
    match skew.try_normalize(1e-3) {
        Some(axis) if degrees > 0.05 => {
            let [x, y, z] = [axis.x, axis.y, axis.z].map(|c| decimal(c, 3));
            format!("{angle} about the axis ({x}, {y}, {z})")
        }
        _ => angle,
    }
}

fn scaled(stretches: &Vector3<f64>) -> String {
    let [least, most] = [stretches.min(), stretches.max()];
    if most - least > EVEN * most {
        return format!("stretched by factors from {} to {}", decimal(least, 5), decimal(most, 5));
    }
    let scale = stretches.mean();
    if (scale - 1.0).abs() < EVEN {
        "left in its size".into()
    } else {
        format!("made {} by the factor {}", if scale > 1.0 { "larger" } else { "smaller" }, decimal(scale, 5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Unit};

    fn words(linear: Matrix3<f64>, shift: Vector3<f64>) -> Option<String> {
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&linear);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
        in_words(&std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)])), 2.0)
    }

    #[test]
    fn similarities() {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5).into_inner();
        assert_eq!(
            words(turn * 1.25, Vector3::new(0.0, 1.0, 0.0)).unwrap(),
            "turned by 28.65° about the axis (0.000, 0.000, 1.000), made larger by the factor 1.25000, and then shifted \
             by 50.0\u{a0}% of the largest side"
                .replace("50.0", "50")
        );
        let words = words(Matrix3::identity(), Vector3::zeros()).unwrap();
        assert!(words.starts_with("not turned by as much as 0.01°, left in its size"), "{words}");
    }

    #[test]
    fn half_turns_mirrors_and_stretches() {
        let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, 2.0));
        let half = Rotation3::from_axis_angle(&axis, std::f64::consts::PI).into_inner();
        assert!(words(half, Vector3::zeros()).unwrap().starts_with("turned by 180.00°, left in its size"));
        let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        assert!(words(mirror, Vector3::zeros()).unwrap().contains(", mirrored at the origin, "));
        let stretch = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.5));
        assert!(words(stretch, Vector3::zeros()).unwrap().contains("by factors from 1.00000 to 1.50000"));
    }

    #[test]
    fn what_is_no_motion_has_no_words() {
        assert_eq!(words(Matrix3::zeros(), Vector3::zeros()), None);
        assert_eq!(words(Matrix3::repeat(f64::NAN), Vector3::zeros()), None);
    }
}
