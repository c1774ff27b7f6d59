//! One Gauss-Newton step of the point-to-plane distance over affine maps.
//!
//! The map changes by x' = x + M (x - c) + t about the centre c of the pairs. To first order the sum to be
//! minimised is
//!
//! ```text
//! Σ wᵢ (rᵢ + nᵢ · M eᵢ + nᵢ · t)²,   rᵢ = nᵢ · (pᵢ - qᵢ),  eᵢ = qᵢ - c,
//! ```
//!
//! twelve unknowns. As in `similarity_step`, M acts on q rather than on p: shrinking the suspect along an axis, or
//! to a dot, is then no way to make the distances small.
//!
//! A cylinder may slide and turn, and an ellipsoid, which affine maps take to a sphere, may turn: such directions
//! are held still.

use nalgebra::{Matrix3, SVector, Vector3};

use crate::refinement::affine_map::AffineMap;
use crate::refinement::pairs::Pair;
use crate::refinement::reduction::{reduce, weighted_centre};

/// Damping relative to the mean of the diagonal.
const DAMPING: f64 = 1e-6;
/// Largest norm of M, and largest shift in units of the diagonal, in one step.
const LONGEST: [f64; 2] = [0.3, 0.3];

/// The change that the weighted pairs ask for; identity when they ask for nothing.
pub(crate) fn step(pairs: &[Pair], weights: &[f64]) -> AffineMap {
    let identity = AffineMap::new(Matrix3::identity(), Vector3::zeros());
    let Some(centre) = weighted_centre(pairs, weights) else { return identity };
    let row = |pair: &Pair| {
        let (n, e) = (pair.normal, pair.q.coords - centre);
        let [x, y, z] = [e.x, e.y, e.z].map(|e| n * e);
        SVector::from([x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, n.x, n.y, n.z])
    };
    let Some(x) = reduce::<12>(pairs, weights, DAMPING, row) else { return identity };
    let (m, t) = (Matrix3::from_column_slice(&x.as_slice()[..9]), Vector3::from(x.fixed_rows::<3>(9)));
    let excess = (m.norm() / LONGEST[0]).max(t.norm() / LONGEST[1]).max(1.0);
    let linear = Matrix3::identity() + m / excess;
    AffineMap::new(linear, centre + t / excess - linear * centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// Tangent planes of a bumpy ball, moved by a small affine map: one step nearly undoes it.
    #[test]
    fn a_small_affine_map_is_undone_to_first_order() {
        let small = Matrix3::new(2.0, -1.0, 3.0, 1.0, 1.0, -2.0, 0.5, 2.0, -1.0) * 1e-4;
        let moved = AffineMap::new(Matrix3::identity() + small, Vector3::new(1e-4, -2e-4, 1e-4));
        let pairs: Vec<Pair> = (0..2000)
            .map(|i| {
                // An octic surface: no affine map but the obvious ones takes it to itself.
                let z: f64 = -1.0 + 2.0 * (i as f64 + 0.5) / 2000.0;
                let (sin, cos) = (2.4 * i as f64).sin_cos();
                let d = Vector3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                let q = Point3::from(d / d.map(|x| x.powi(4)).sum().powf(0.25));
                let normal = q.coords.map(|x| x.powi(3)).normalize();
                let p = moved.point(&q);
                Pair { p, q, normal, distance: (p - q).norm(), on_boundary: false, compatible: true }
            })
            .collect();
        let found = step(&pairs, &vec![1.0; pairs.len()]);
        let left = found.linear * moved.linear - Matrix3::identity();
        assert!(left.norm() < 5e-6, "{left}");
    }

    #[test]
    fn no_pairs_no_step() {
        assert_eq!(step(&[], &[]), AffineMap::new(Matrix3::identity(), Vector3::zeros()));
    }
}
