//! Faces as gaps: a corner and the place of the longest edge that it faces.
//!
//! Where a face is thinner than a mark moves its corners, it folds over unless both keep their distance.

use crate::Facing;
use nalgebra::{Matrix3, Point3};
use sombrero_mesh::geometry;

/// The corner opposite to the longest edge and its foot on that edge: seen along the edge's height, and along the normal,
/// both at the face's height. `None` for a face without area.
///
/// # Panics
/// When a corner is not below the number of points.
pub fn across(points: &[Point3<f64>], corners: &[u32; 3]) -> Option<[Facing; 2]> {
    let length = |k: usize| {
        let [a, b] = [corners[k], corners[(k + 1) % 3]].map(|v| points[v as usize]);
        (b - a).norm()
    };
    let longest = (1..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    let [a, b, apex] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
    let [from, to, tip] = [a, b, apex].map(|v| points[v as usize]);
    let along = (to - from).try_normalize(0.0)?;
    let share = (tip - from).dot(&along) / (to - from).norm();
    let normal = geometry::area_vector(&from, &to, &tip).try_normalize(0.0)?;
    let height = normal.cross(&along);
    let distance = (tip - from).dot(&height);
    let terms = vec![
        (apex, Matrix3::identity()),
        (a, Matrix3::identity() * (share - 1.0)),
        (b, Matrix3::identity() * -share),
    ];
    (distance > 0.0)
        .then(|| [height, normal].map(|direction| Facing { distance, direction, terms: terms.clone() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_thin_face_is_a_gap_between_its_corner_and_its_longest_edge() {
        let points = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 0.25, 0.0]].map(Point3::from);
        for corners in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            let [height, normal] = across(&points, &corners).unwrap();
            assert_eq!([height.distance, normal.distance], [0.25; 2]);
            assert_eq!([height.direction, normal.direction], [Vector3::y(), Vector3::z()]);
            let shares: Vec<_> = height.terms.iter().map(|(v, map)| (*v, map[(0, 0)])).collect();
            assert_eq!(shares, [(2, 1.0), (0, -0.75), (1, -0.25)]);
        }
        let line = [[0.0; 3], [4.0, 0.0, 0.0], [1.0, 0.0, 0.0]].map(Point3::from);
        assert_eq!(across(&line, &[0, 1, 2]), None);
    }
}
