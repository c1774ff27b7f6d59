//! The flatness of planar regions.
//!
//! The best plane of a region's vertices goes through their mean x̄ along the two larger principal axes of
//! Σ (x - x̄)(x - x̄)ᵀ. With h the height of a vertex above it, before and after each above its own, a region is bent by
//! max |h_after - h_before|: what its vertices leave their plane by, when it was a plane. A region that is moved or turned as
//! a whole is not bent.

use crate::Change;
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use sombrero_mesh::PlanarRegions;

/// Largest departure of a planar region's vertices from their best plane that was not there before, as a share of the largest
/// side; `None` without planar regions ([`PlanarRegions`]). O(n log n).
pub fn flatness(change: &Change<'_>) -> Option<f64> {
    let side = change.bounds.largest_side();
    let planar = PlanarRegions::of(change.before, &change.triangles, side, &change.facets[0], &change.hinges);
    let mut corners: Vec<(u32, u32)> = Vec::new();
    for (region, triangle) in planar.of_face.iter().zip(&change.triangles) {
        corners.extend(region.iter().flat_map(|&r| triangle.map(|v| (r, v))));
    }
    corners.sort_unstable();
    corners.dedup();
    let regions = corners.chunk_by(|a, b| a.0 == b.0);
    let bends = regions.map(|region| bend(change, region, &planar.normals[region[0].0 as usize]));
    bends.reduce(f64::max).map(|bend| bend / side)
}

/// The largest change of height of a region's vertices, in model units. `normal` tells up from down.
fn bend(change: &Change<'_>, region: &[(u32, u32)], normal: &Vector3<f64>) -> f64 {
    let [before, after] = change.sides().map(|points| {
        let points: Vec<Point3<f64>> = region.iter().map(|&(_, v)| points[v as usize]).collect();
        heights(&points, normal)
    });
    before.iter().zip(&after).map(|(h, g)| (g - h).abs()).fold(0.0, f64::max)
}

/// How far each point is above the best plane of all.
fn heights(points: &[Point3<f64>], up: &Vector3<f64>) -> Vec<f64> {
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let seen: Vec<Vector3<f64>> = points.iter().map(|p| p.coords - mean).collect();
    let scatter: Matrix3<f64> = seen.iter().map(|x| x * x.transpose()).sum();
    let axis = least_axis(scatter).unwrap_or(*up);
    let axis = if axis.dot(up) < 0.0 { -axis } else { axis };
    seen.iter().map(|x| axis.dot(x)).collect()
}

/// The eigenvector of the smallest eigenvalue.
fn least_axis(matrix: Matrix3<f64>) -> Option<Vector3<f64>> {
    /// Far more than a matrix of this size needs.
    const ROUNDS: usize = 100;
    let largest = matrix.amax();
    let scaled = (largest > 0.0 && largest.is_finite()).then(|| matrix / largest)?;
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, ROUNDS)?;
    Some(eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Unit};
    use sombrero_shapes as shapes;

    /// A cube of side 1 whose top has a vertex in its middle, at the given height.
    fn peaked(height: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let corner = |k: u32| [k & 1, k >> 1 & 1, k >> 2].map(f64::from);
        let mut points: Vec<Point3<f64>> = (0..8).map(|k| Point3::from(corner(k))).collect();
        points.push(Point3::new(0.5, 0.5, height));
        let sides = [[0, 2, 3, 1], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
        let mut triangles: Vec<[u32; 3]> =
            sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        triangles.extend([[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]);
        (points, triangles)
    }

    #[test]
    fn a_dent_is_measured_from_the_best_plane() {
        // Heights of four corners and a middle: the plane lies at a fifth of the middle's.
        let ((before, triangles), (after, _)) = (peaked(1.0), peaked(0.99));
        let bent = flatness(&Change::new(&before, &after, &triangles)).unwrap();
        assert!((bent - 0.008).abs() < 1e-12, "{bent}");
    }

    #[test]
    fn what_moves_and_turns_as_a_whole_stays_flat() {
        let (before, triangles) = peaked(1.0);
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(Vector3::new(1.0, 2.0, -0.5)), 0.7);
        let after: Vec<_> = before.iter().map(|p| turn * p + Vector3::new(3.0, 0.0, -1.0)).collect();
        assert!(flatness(&Change::new(&before, &after, &triangles)).unwrap() < 1e-15);
        // One face tilts about an edge, its neighbours with it: all stay planes.
        let tilted: Vec<_> = before.iter().map(|p| Point3::new(p.x, p.y, p.z * (1.0 + 0.1 * p.x))).collect();
        assert!(flatness(&Change::new(&before, &tilted, &triangles)).unwrap() < 1e-15);
    }

    #[test]
    fn nothing_flat_nothing_to_bend() {
        let ball = shapes::bumpy_sphere(500);
        assert_eq!(flatness(&Change::new(&ball.points, &ball.points, &ball.triangles)), None);
        assert_eq!(flatness(&Change::new(&[], &[], &[])), None);
    }
}
