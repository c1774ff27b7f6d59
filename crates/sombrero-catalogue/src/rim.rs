//! Where a surface ends: what lies there looks like nothing else, and a crop's rim is none of its original's.

use nalgebra::Point3;
use sombrero_spatial::NearestVertex;

use crate::pieces::Piece;

/// Distance within which the rim spoils a landmark's looks, relative to the root of the area: the middle of the radii.
const NEAR: f64 = 0.13;
/// Longest stretch of the rim without a point that stands for it.
const STEP: f64 = 0.03;

/// Points on the open edges of a piece, in the piece's unit.
pub(crate) struct Rim(Option<NearestVertex>);

impl Rim {
    /// The edges of a piece that have one triangle.
    pub(crate) fn new(piece: &Piece, centroid: &Point3<f64>) -> Self {
        let sides =
            |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]);
        let mut edges: Vec<[u32; 2]> = piece.triangles.iter().flat_map(sides).collect();
        edges.sort_unstable();
        let open = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]);
        let mut points = Vec::new();
        for edge in open {
            let [a, b] = edge.map(|v| Point3::from((piece.points[v as usize] - centroid) / piece.size));
            let steps = ((b - a).norm() / STEP).ceil().clamp(1.0, 1e3) as usize;
            points.extend((0..=steps).map(|k| a + (b - a) * (k as f64 / steps as f64)));
        }
        Self((!points.is_empty()).then(|| NearestVertex::new(&points)))
    }

    /// Whether the rim spoils a landmark at the point.
    pub(crate) fn is_near(&self, point: &Point3<f64>) -> bool {
        let nearest = self.0.as_ref().and_then(|points| points.nearest(point));
        nearest.is_some_and(|found| found.1 < NEAR)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pieces::pieces;
    use sombrero_shapes as shapes;

    #[test]
    fn a_sheet_ends_and_a_ball_does_not() {
        let sheet = shapes::open_sheet(20, 20);
        let piece = &pieces(&sheet.points, &sheet.triangles).unwrap()[0];
        let bounds = sheet.bounding_box().unwrap();
        let middle = nalgebra::center(&bounds.min, &bounds.max);
        let rim = Rim::new(piece, &middle);
        assert!(!rim.is_near(&Point3::origin()));
        assert!(rim.is_near(&Point3::from((sheet.points[0] - middle) / piece.size)));
        let ball = shapes::sphere(2);
        let piece = &pieces(&ball.points, &ball.triangles).unwrap()[0];
        assert!(ball.points.iter().all(|p| !Rim::new(piece, &Point3::origin()).is_near(p)));
    }
}
