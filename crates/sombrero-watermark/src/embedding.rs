//! Insertion: v' = v + B w (the paper, section 4).

use nalgebra::Point3;
use sombrero_basis::Basis;

/// Where the marked vertices stand.
///
/// # Panics
/// When `points` or `w` do not fit the basis.
pub fn embed(points: &[Point3<f64>], basis: &Basis, w: &[f64], epsilon: f64) -> Vec<Point3<f64>> {
    assert_eq!(points.len(), basis.vertex_count(), "a point for every row of the basis");
    points.iter().zip(basis.displacements(w, epsilon)).map(|(p, d)| p + d).collect()
}

/// How far vertices moved, in model units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Distortion {
    /// The longest displacement.
    pub max: f64,
    /// Root mean square of the displacements.
    pub rms: f64,
}

impl Distortion {
    /// Compares positions vertex by vertex; those beyond the shorter slice are not counted.
    pub fn between(before: &[Point3<f64>], after: &[Point3<f64>]) -> Self {
        let squared = || before.iter().zip(after).map(|(a, b)| (b - a).norm_squared());
        let count = before.len().min(after.len()).max(1) as f64;
        Self { max: squared().fold(0.0, f64::max).sqrt(), rms: (squared().sum::<f64>() / count).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_basis::BasisOptions;
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn twice_the_watermark_moves_twice_as_far(w in prop::collection::vec(-2.0..2.0f64, 20)) {
            let made = repair(&shapes::bumpy_sphere(500));
            let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
            let options = BasisOptions { coefficients: 20, ..Default::default() };
            let basis = Basis::new(progressive, &made.points, &options).unwrap();
            let once = embed(&made.points, &basis, &w, 0.01);
            let twice = embed(&made.points, &basis, &w, 0.02);
            for ((v, once), twice) in made.points.iter().zip(&once).zip(&twice) {
                prop_assert!(((twice - v) - (once - v) * 2.0).norm() < 1e-14);
            }
            let (one, two) = (Distortion::between(&made.points, &once), Distortion::between(&made.points, &twice));
            prop_assert!((two.max - 2.0 * one.max).abs() < 1e-14 && (two.rms - 2.0 * one.rms).abs() < 1e-14);
            prop_assert!(one.rms <= one.max);
        }
    }
}
