//! Self-intersections that a change brings.
//!
//! Faces whose boxes touch after the change are the candidates; of those that cross then, the ones that crossed before are
//! left out. Faces that share a corner are neighbours, which meet by right.

use crate::Change;
use crate::crossing::cross;
use rayon::prelude::*;
use sombrero_mesh::BoundingBox;
use std::ops::ControlFlow;

/// Faces that one task looks at, and the most candidates that it tries: a mesh all of whose faces lie in one another would
/// have n²/2.
const CHUNK: usize = 256;
const MOST_CANDIDATES: usize = 256 * CHUNK;

/// How many pairs of triangles without a common corner cross after the change and did not before. O(n log n): where faces
/// have more than 256 candidates on average the count is a lower bound.
pub fn new_intersections(change: &Change<'_>) -> usize {
    let faces: Vec<u32> = (0..change.triangles.len() as u32).collect();
    faces.par_chunks(CHUNK).map(|chunk| crossings(change, chunk)).sum()
}

/// The new crossings of `faces` with later ones.
fn crossings(change: &Change<'_>, faces: &[u32]) -> usize {
    let (mut count, mut tried) = (0, 0);
    for &face in faces {
        let corners = change.corners(1, face);
        let Some(bounds) = BoundingBox::of(&corners) else { continue };
        change.surfaces[1].visit_overlapping(&bounds, |other| {
            tried += 1;
            if other > face && !neighbours(change, face, other) {
                let now = cross(&corners, &change.corners(1, other));
                let new = now && !cross(&change.corners(0, face), &change.corners(0, other));
                count += usize::from(new);
            }
            if tried < MOST_CANDIDATES { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
    }
    count
}

/// Whether two faces have a corner in common.
fn neighbours(change: &Change<'_>, face: u32, other: u32) -> bool {
    let [one, two] = [face, other].map(|f| change.triangles[f as usize]);
    one.iter().any(|v| two.contains(v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};
    use sombrero_shapes as shapes;

    /// A cube within another of thrice the size, the inner one moved.
    fn nested(shift: Vector3<f64>) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let cube = shapes::cube();
        let mut points: Vec<_> = cube.points.iter().map(|p| p * 3.0).collect();
        points.extend(cube.points.iter().map(|p| p + shift));
        let mut triangles = cube.triangles.clone();
        triangles.extend(cube.triangles.iter().map(|t| t.map(|v| v + 8)));
        (points, triangles)
    }

    #[test]
    fn a_cube_that_leaves_a_cube() {
        let half = shapes::cube().points[0].x.abs();
        let (before, triangles) = nested(Vector3::zeros());
        let within = |after: &[Point3<f64>]| new_intersections(&Change::new(&before, after, &triangles));
        assert_eq!(within(&before), 0);
        // Still inside.
        assert_eq!(within(&nested(Vector3::x() * 1.9 * half).0), 0);
        // Through the wall, a little off the diagonals: four sides of two faces each meet the two of the wall.
        let (after, _) = nested(Vector3::new(2.5, 0.1, 0.03) * half);
        let through = within(&after);
        assert!((8..=16).contains(&through), "{through}");
        // What was there before is not new, and going back inside brings none.
        assert_eq!(new_intersections(&Change::new(&after, &after, &triangles)), 0);
        assert_eq!(new_intersections(&Change::new(&after, &before, &triangles)), 0);
    }

    #[test]
    fn one_pair() {
        let before = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.], [1., 1., 1.], [1., 1., 2.], [2., 1., 2.]];
        let before = before.map(Point3::from);
        let mut after = before;
        after[3].z = -1.0;
        let triangles = [[0, 1, 2], [3, 4, 5]];
        assert_eq!(new_intersections(&Change::new(&before, &after, &triangles)), 1);
        after[3].z = 0.0;
        assert_eq!(new_intersections(&Change::new(&before, &after, &triangles)), 0);
    }

    #[test]
    fn a_heap_of_faces_ends() {
        // 2,000 needles through one point after, side by side before: 2 million pairs.
        let needle = |k: u32, apart: f64| {
            let angle = f64::from(k) * 0.618;
            let along = Vector3::new(libm::cos(angle), libm::sin(angle), 0.3 * libm::sin(3.0 * angle));
            let across = along.cross(&Vector3::z()) * 0.01;
            [-along, along + across, along - across]
                .map(|v| Point3::from(v) + Vector3::z() * (apart * f64::from(k)))
        };
        let corners = |apart: f64| (0..2000).flat_map(move |k| needle(k, apart)).collect::<Vec<_>>();
        let triangles: Vec<[u32; 3]> = (0..2000).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let (before, after) = (corners(10.0), corners(0.0));
        let count = new_intersections(&Change::new(&before, &after, &triangles));
        assert!(count > 0 && count < 8 * MOST_CANDIDATES, "{count}");
    }
}
