//! The similarity between two sets of points that are paired already (Umeyama 1991, `umeyama1991`).
//!
//! It minimises Σ |q_i - (s R p_i + t)|². With both sets about their centroids and Σ q pᵀ = U D Vᵀ,
//!
//! ```text
//! R = U S Vᵀ,   s = tr(D S) / Σ |p|²,   t = q̄ - s R p̄,   S = diag(1, 1, det U det V),
//! ```
//!
//! S keeps R a rotation where a reflection would fit better.

use nalgebra::{Matrix3, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};

/// The similarity that brings each first point of `pairs` nearest to its second one; `None` when fewer than three
/// pairs are given, or the points of a side lie on one spot or line.
pub fn similarity_of_pairs(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Similarity3<f64>> {
    if pairs.len() < 3 {
        return None;
    }
    let count = pairs.len() as f64;
    let from = pairs.iter().map(|pair| pair.0.coords).sum::<Vector3<f64>>() / count;
    let to = pairs.iter().map(|pair| pair.1.coords).sum::<Vector3<f64>>() / count;
    let (mut cross, mut spread) = (Matrix3::zeros(), 0.0);
    for (p, q) in pairs {
        let (p, q) = (p.coords - from, q.coords - to);
        cross += q * p.transpose();
        spread += p.norm_squared();
    }
    let svd = cross.try_svd(true, true, f64::EPSILON, 0)?;
    let (u, v_t, d) = (svd.u?, svd.v_t?, svd.singular_values);
    // A line leaves the turn about itself open.
    if spread.is_nan() || spread <= 0.0 || d[1].is_nan() || d[1] <= 1e-12 * d[0] {
        return None;
    }
    let mut keep = Vector3::repeat(1.0);
    keep[2] = if (u * v_t).determinant() < 0.0 { -1.0 } else { 1.0 };
    let rotation = u * Matrix3::from_diagonal(&keep) * v_t;
    let scale = d.component_mul(&keep).sum() / spread;
    let shift = to - rotation * from * scale;
    let usable = scale > 0.0 && scale.is_finite() && shift.iter().all(|x| x.is_finite());
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    usable.then(|| Similarity3::from_parts(Translation3::from(shift), rotation, scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn a_similarity_is_found(
            axis in prop::array::uniform3(-3.0..3.0f64), shift in prop::array::uniform3(-9.0..9.0f64), scale in 0.01..100.0f64
        ) {
            let s = Similarity3::new(Vector3::from(shift), Vector3::from(axis), scale);
            let pairs: Vec<_> = shapes::part(2).points.iter().map(|p| (*p, s * p)).collect();
            let found = similarity_of_pairs(&pairs).unwrap();
            for (p, q) in pairs {
                prop_assert!((found * p - q).norm() < 1e-11 * scale.max(1.0) * 10.0);
            }
        }
    }

    #[test]
    fn spots_and_lines_have_no_answer() {
        let at = |x: f64| Point3::new(x, 2.0 * x, -x);
        let line: Vec<_> = (0..9).map(|i| (at(f64::from(i)), at(f64::from(i)))).collect();
        let spot = vec![(at(1.0), at(2.0)); 9];
        for pairs in [&line[..], &spot[..], &line[..2], &[]] {
            assert_eq!(similarity_of_pairs(pairs), None);
        }
    }

    #[test]
    fn a_mirror_image_gives_a_rotation() {
        let pairs: Vec<_> =
            shapes::part(2).points.iter().map(|p| (*p, Point3::new(-p.x, p.y, p.z))).collect();
        let found = similarity_of_pairs(&pairs).unwrap();
        assert!(found.scaling() > 0.0);
        assert!((found.isometry.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-9);
    }
}
