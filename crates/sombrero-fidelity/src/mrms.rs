//! The distance between the surfaces.
//!
//! ```text
//! MRMS = max over both sides of √(1/|S| ∫ d(p, S')² dA) / diagonal,
//! ```
//!
//! d(p, S') the distance from p on the one surface to the closest point of the other, as in Metro (Cignoni, Rocchini and
//! Scopigno 1998); Wang et al. (2010) divide by the diagonal of the bounding box. The integral is a mean over samples of
//! equal area, spread without chance.

use crate::Change;
use nalgebra::Point3;
use sombrero_spatial::spread_samples;

/// The least and the most samples; between them it is one for each triangle.
const LEAST_SAMPLES: usize = 10_000;
const MOST_SAMPLES: usize = 50_000;

/// Root mean square distance between the surfaces, the larger of both ways, over the diagonal of the bounding box; 0 without
/// area. Of a smooth displacement it is right to about a hundredth. O(n log n).
pub fn mrms(change: &Change<'_>) -> f64 {
    let diagonal = change.bounds.diagonal();
    let squares = [0, 1].map(|side| mean_square(change, side));
    let largest = squares[0].max(squares[1]).sqrt() / diagonal;
    if largest.is_finite() { largest } else { 0.0 }
}

/// Mean squared distance from one side to the other.
fn mean_square(change: &Change<'_>, side: usize) -> f64 {
    let (points, triangles) = (change.sides()[side], &change.triangles);
    let count = triangles.len().clamp(LEAST_SAMPLES, MOST_SAMPLES);
    let samples = spread_samples(points, triangles, count);
    let places: Vec<Point3<f64>> = samples.iter().filter_map(|s| s.point(points, triangles)).collect();
    let faces: Vec<u32> = samples.iter().map(|s| s.face).collect();
    let closest = change.surfaces[1 - side].closest_many_from(&places, &faces);
    let sum: f64 = closest.iter().flatten().map(|c| c.squared_distance).sum();
    sum / places.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use sombrero_shapes as shapes;

    #[test]
    fn a_lifted_plate_is_that_far_away() {
        let plate = shapes::open_sheet(4, 3);
        let lifted: Vec<_> = plate.points.iter().map(|p| p + Vector3::z() * 0.125).collect();
        // The sheet is wavy: what is lifted straight up is nearer than that.
        let flat =
            |points: &[Point3<f64>]| points.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect::<Vec<_>>();
        let before = flat(&plate.points);
        let after: Vec<_> = before.iter().map(|p| p + Vector3::z() * 0.125).collect();
        let change = Change::new(&before, &after, &plate.triangles);
        let expected = 0.125 / change.bounds.diagonal();
        assert!((mrms(&change) - expected).abs() < 1e-14 * expected);
        assert!(mrms(&Change::new(&plate.points, &lifted, &plate.triangles)) <= expected * 1.1);
    }

    #[test]
    fn a_corner_that_is_pulled_out_counts_from_the_side_that_has_more() {
        // The plate [0, 1]² becomes [0, 2] × [0, 1]: before lies within after, and after overhangs by 1 on half of its area.
        let before = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(Point3::from);
        let after = [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]].map(Point3::from);
        let change = Change::new(&before, &after, &[[0, 1, 2], [0, 2, 3]]);
        let expected = (1.0_f64 / 6.0).sqrt() / 2.0_f64.sqrt();
        assert!((mrms(&change) - expected).abs() < 1e-3, "{}", mrms(&change));
    }

    #[test]
    fn sliding_along_the_surface_is_no_distance() {
        let cube = shapes::cube();
        let turned: Vec<_> = cube.points.iter().map(|p| Point3::new(-p.y, p.x, p.z)).collect();
        assert!(mrms(&Change::new(&cube.points, &turned, &cube.triangles)) < 1e-15);
        assert_eq!(mrms(&Change::new(&[], &[], &[])), 0.0);
    }
}
