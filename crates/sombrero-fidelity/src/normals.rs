//! The change of face normals: what shading shows.
//!
//! A face whose unit normal n becomes m turns by 2 asin(|n - m| / 2), which is accurate for small angles. Faces count with
//! their area before.

use crate::Change;
use nalgebra::Point3;

/// The angles by which face normals turned, in degrees.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct NormalChange {
    /// Root mean square by area.
    pub rms: f64,
    /// What the faces of 99 % of the area do not exceed.
    pub p99: f64,
}

/// The share of the area that [`NormalChange::p99`] covers.
const SHARE: f64 = 0.99;

/// How far face normals turned. Faces without area before or after do not count. O(n log n).
pub fn normals(change: &Change<'_>) -> NormalChange {
    let mut turns: Vec<(f64, f64)> = turns(change.before, change.after, &change.triangles).collect();
    let rms = root_mean_square(turns.iter().copied()).to_degrees();
    turns.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let covered = SHARE * turns.iter().map(|(_, area)| area).sum::<f64>();
    let mut sum = 0.0;
    let p99 = turns.iter().find(|(_, area)| {
        sum += area;
        sum >= covered
    });
    NormalChange { rms, p99: p99.map_or(0.0, |(angle, _)| angle.to_degrees()) }
}

/// How far face normals turned, root mean square by area, in radians. Faces without area before or after, or with corners
/// that are not there, do not count.
pub fn normal_change(before: &[Point3<f64>], after: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    root_mean_square(turns(before, after, triangles))
}

fn root_mean_square(turns: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut squares, mut total) = (0.0, 0.0);
    for (angle, area) in turns {
        squares += area * angle.powi(2);
        total += area;
    }
    if total > 0.0 { (squares / total).sqrt() } else { 0.0 }
}

/// The angle by which each face turned, and twice its area.
fn turns<'a>(
    before: &'a [Point3<f64>],
    after: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let area = |points: &[Point3<f64>], corners: &[u32; 3]| {
        let at = |v: u32| points.get(v as usize);
        let [a, b, c] = [at(corners[0])?, at(corners[1])?, at(corners[2])?];
        Some((b - a).cross(&(c - a))).filter(|n| n.norm() > 0.0)
    };
    triangles.iter().filter_map(move |corners| {
        let (n, m) = (area(before, corners)?, area(after, corners)?);
        let chord = (n.normalize() - m.normalize()).norm();
        Some((2.0 * libm::asin((chord / 2.0).min(1.0)), n.norm()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_that_turns_by_an_angle_counts_with_its_area() {
        let angle = 0.01_f64;
        let before = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-3.0, 0.0, 0.0]].map(Point3::from);
        let mut after = before;
        // The face on the left turns about the y axis; it has three times the area of the other.
        after[3] = Point3::new(-3.0 * angle.cos(), 0.0, 3.0 * angle.sin());
        let triangles = [[0, 1, 2], [0, 2, 3], [7, 1, 2], [1, 1, 2]];
        let rms = normal_change(&before, &after, &triangles);
        assert!((rms - angle * 0.75_f64.sqrt()).abs() < 1e-12, "{rms}");
        assert_eq!(normal_change(&before, &before, &triangles), 0.0);
        assert_eq!(normal_change(&[], &[], &[]), 0.0);
        let change = normals(&Change::new(&before, &after, &triangles));
        assert_eq!(change.rms, rms.to_degrees());
        assert!((change.p99 - angle.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn a_hundredth_of_the_area_may_turn_more() {
        // A fan of 200 equal triangles, one of which turns.
        let mut before = vec![Point3::origin()];
        before.extend((0..200).flat_map(|k| {
            let x = f64::from(k);
            [Point3::new(x, 1.0, 0.0), Point3::new(x + 1.0, 1.0, 0.0), Point3::new(x, 0.0, 0.0)]
        }));
        let triangles: Vec<[u32; 3]> = (0..200).map(|k| [3 * k + 1, 3 * k + 2, 3 * k + 3]).collect();
        let mut after = before.clone();
        after[3].z = 1.0;
        let one = normals(&Change::new(&before, &after, &triangles));
        assert!((one.rms - 45.0 / 200.0_f64.sqrt()).abs() < 1e-12 && one.p99 == 0.0, "{one:?}");
        (after[6].z, after[9].z) = (1.0, 1.0);
        let three = normals(&Change::new(&before, &after, &triangles));
        assert!((three.p99 - 45.0).abs() < 1e-12, "{three:?}");
    }
}
