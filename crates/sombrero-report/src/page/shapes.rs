//! What pictures and scene show: original and suspect, and where the suspect is.

use super::distances::Distances;
use crate::report::Report;
use nalgebra::Matrix4;
use sombrero::mesh::{BoundingBox, Soup};
use sombrero::render::used_points;

/// Both shapes in the original's coordinates.
pub(super) struct Shapes<'a> {
    pub(super) original: &'a Soup,
    /// The suspect where detection put it.
    pub(super) suspect: Soup,
    pub(super) placement: Placement,
    /// How far they are apart, where that is known.
    pub(super) distances: Option<Distances>,
}

impl<'a> Shapes<'a> {
    pub(super) fn new(report: &Report<'a>) -> Self {
        let original = report.original.soup();
        let suspect = aligned(report);
        let placement = placement(original, &suspect);
        Self { original, suspect, placement, distances: Distances::new(report) }
    }
}

fn aligned(report: &Report<'_>) -> Soup {
    let mut soup = report.suspect.clone();
    if let Some(alignment) = &report.detection.registration {
        let matrix = Matrix4::from_fn(|row, column| alignment.matrix[row][column]);
        soup.points.iter_mut().for_each(|point| *point = matrix.transform_point(point));
    }
    soup
}

/// Where the suspect is, seen from the original.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Placement {
    /// There is nothing to see.
    Empty,
    /// The original's frame shows it.
    Near,
    /// In the original's frame it would be a speck or out of sight.
    Elsewhere,
}

impl Placement {
    /// Why the suspect's picture is not what one would expect, if so.
    pub(super) fn remark(self) -> Option<&'static str> {
        match self {
            Self::Near => None,
            Self::Empty => Some("It has no surface to draw."),
            Self::Elsewhere => Some(
                "It lies elsewhere or has another size, and is drawn in a frame of its own, turned as it is.",
            ),
        }
    }
}

/// Share of the original's largest side by which a suspect near it may stick out.
pub(super) const MARGIN: f64 = 0.1;

fn placement(original: &Soup, suspect: &Soup) -> Placement {
    let bounds = |soup: &Soup| BoundingBox::of(&used_points(&soup.points, &soup.triangles));
    let (Some(a), Some(b)) = (bounds(original), bounds(suspect)) else {
        return Placement::Empty;
    };
    let side = a.largest_side();
    // Part of the original lies inside its box, however small; what sticks out would be cut off.
    let inside = (0..3).all(|k| b.min[k] > a.min[k] - MARGIN * side && b.max[k] < a.max[k] + MARGIN * side);
    let visible = b.largest_side() > 0.2 * side;
    if inside && visible { Placement::Near } else { Placement::Elsewhere }
}
