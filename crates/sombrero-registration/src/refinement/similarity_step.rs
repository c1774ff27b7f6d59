//! One Gauss-Newton step of the point-to-plane distance with scale (Chen and Medioni 1992, `chen1992`;
//! uniform scale added as in section 5 of the paper).
//!
//! The pose changes by x' = c + t + e^λ exp(ω) (x - c) about the centre c of the pairs. To first order the
//! sum to be minimised is
//!
//! ```text
//! Σ wᵢ (rᵢ + (dᵢ × nᵢ) · ω + nᵢ · t + (nᵢ · eᵢ) λ)²,   rᵢ = nᵢ · (pᵢ - qᵢ),  dᵢ = pᵢ - c,  eᵢ = qᵢ - c,
//! ```
//!
//! seven unknowns. The column of λ has q where one expects p: that is the derivative of r / scale, of the
//! distance as the suspect sees it. With p, shrinking the suspect to a dot would be a perfect fit.
//! A sphere may turn and a plane may slide: such directions are held still.

use nalgebra::{SVector, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::refinement::pairs::Pair;
use crate::refinement::reduction::{reduce, weighted_centre};

/// Damping relative to the mean of the diagonal.
const DAMPING: f64 = 1e-7;
/// Largest turn in radians, shift in units of the diagonal, and change of log scale in one step.
const LONGEST: [f64; 3] = [0.5, 0.3, 0.3];

/// The change of pose that the weighted pairs ask for; identity when they ask for nothing.
pub(crate) fn step(pairs: &[Pair], weights: &[f64]) -> Similarity3<f64> {
    let Some(centre) = weighted_centre(pairs, weights) else { return Similarity3::identity() };
    let row = |pair: &Pair| {
        let (n, turn) = (pair.normal, (pair.p.coords - centre).cross(&pair.normal));
        let scale = n.dot(&(pair.q.coords - centre));
        SVector::from([turn.x, turn.y, turn.z, n.x, n.y, n.z, scale])
    };
    match reduce::<7>(pairs, weights, DAMPING, row) {
        Some(x) => about(&centre, limited(x)),
        None => Similarity3::identity(),
    }
}

/// The step shortened, as a whole, to where the linearisation still means something.
fn limited(x: SVector<f64, 7>) -> SVector<f64, 7> {
    let lengths = [x.fixed_rows::<3>(0).norm(), x.fixed_rows::<3>(3).norm(), x[6].abs()];
    let excess = lengths.iter().zip(LONGEST).map(|(length, most)| length / most).fold(1.0, f64::max);
    x / excess
}

/// x' = c + t + e^λ exp(ω) (x - c).
fn about(centre: &Vector3<f64>, x: SVector<f64, 7>) -> Similarity3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(x.fixed_rows::<3>(0).into_owned());
    let scale = x[6].exp();
    let shift = centre + x.fixed_rows::<3>(3) - rotation * centre * scale;
    Similarity3::from_parts(Translation3::from(shift), rotation, scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// Samples of an ellipsoid's tangent planes, moved by a small similarity: one step nearly undoes it.
    #[test]
    fn a_small_similarity_is_undone_to_first_order() {
        let moved =
            Similarity3::new(Vector3::new(1e-4, -2e-4, 1e-4), Vector3::new(2e-4, 1e-4, -1e-4), 1.0002);
        let pairs: Vec<Pair> = (0..500)
            .map(|i| {
                let z: f64 = -1.0 + 2.0 * (i as f64 + 0.5) / 500.0;
                let (sin, cos) = (2.4 * i as f64).sin_cos();
                let rim = (1.0 - z * z).sqrt();
                let q = Point3::new(rim * cos, 0.7 * rim * sin, 0.4 * z);
                let normal = Vector3::new(rim * cos, rim * sin / 0.7, z / 0.4).normalize();
                let p = moved * q;
                Pair { p, q, normal, distance: (p - q).norm(), on_boundary: false, compatible: true }
            })
            .collect();
        let left = step(&pairs, &vec![1.0; 500]) * moved;
        assert!((left.to_homogeneous() - nalgebra::Matrix4::identity()).norm() < 2e-6);
    }

    #[test]
    fn a_plane_does_not_slide() {
        let pair = |x: f64, y: f64| Pair {
            p: Point3::new(x, y, 0.01),
            q: Point3::new(x, y, 0.0),
            normal: Vector3::z(),
            distance: 0.01,
            on_boundary: false,
            compatible: true,
        };
        let pairs: Vec<_> = (0..100).map(|i| pair(f64::from(i % 10), f64::from(i / 10))).collect();
        let found = step(&pairs, &vec![1.0; 100]);
        for Pair { p, q, .. } in pairs {
            let left = found * p - q;
            assert!(left.z.abs() < 1e-5 && left.xy().norm() < 2e-3, "{left}");
        }
    }

    #[test]
    fn no_pairs_no_step() {
        assert_eq!(step(&[], &[]), Similarity3::identity());
    }
}
