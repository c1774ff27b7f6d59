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

/// How far face normals turned, root mean square by area, in radians: what shading shows of a mark. Faces without area
/// before or after, or with corners that are not there, do not count.
pub fn normal_change(before: &[Point3<f64>], after: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let area = |points: &[Point3<f64>], corners: &[u32; 3]| {
        let at = |v: u32| points.get(v as usize);
        let [a, b, c] = [at(corners[0])?, at(corners[1])?, at(corners[2])?];
        Some((b - a).cross(&(c - a))).filter(|n| n.norm() > 0.0)
    };
    let (mut squares, mut total) = (0.0, 0.0);
    for corners in triangles {
        if let (Some(n), Some(m)) = (area(before, corners), area(after, corners)) {
            // The chord of the angle is accurate for small ones.
            let chord = (n.normalize() - m.normalize()).norm();
            squares += n.norm() * (2.0 * libm::asin((chord / 2.0).min(1.0))).powi(2);
            total += n.norm();
        }
    }
    if total > 0.0 { (squares / total).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_basis::BasisOptions;
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    #[test]
    fn a_face_that_turns_by_an_angle_counts_with_its_area() {
        let angle = 0.01_f64;
        let before = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-3.0, 0.0, 0.0]].map(Point3::from);
        let mut after = before;
        // The face on the left turns about the y axis; it has three times the area of the other.
        after[3] = Point3::new(-3.0 * angle.cos(), 0.0, 3.0 * angle.sin());
        let triangles = [[0, 1, 2], [0, 2, 3], [7, 1, 2], [1, 1, 2]];
        let change = normal_change(&before, &after, &triangles);
        assert!((change - angle * 0.75_f64.sqrt()).abs() < 1e-12, "{change}");
        assert_eq!(normal_change(&before, &before, &triangles), 0.0);
        assert_eq!(normal_change(&[], &[], &[]), 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn twice_the_watermark_moves_twice_as_far(w in prop::collection::vec(-2.0..2.0f64, 20)) {
            let made = repair(&shapes::bumpy_sphere(500));
            let mut progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
            let options = BasisOptions { coefficients: 20, ..Default::default() };
            let basis = Basis::new(&mut progressive, &made.points, &options).unwrap();
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
