//! Which vertex is which, by the connectivity alone: for suspects that were renumbered or cropped.

use crate::limits::{MOST_POSES, TOLD_APART};
use crate::model::Model;
use crate::pairs::Pairs;
use nalgebra::Point3;
use sombrero_mesh::{Soup, VertexMatching, match_connectivity};

/// Every way to number the suspect's vertices as the original's that fits the shape, best first: for each of the
/// original's points its place on the suspect, in the suspect's coordinates, or `None`.
pub(crate) fn matched(model: &Model, suspect: &Soup) -> Vec<Vec<Option<Point3<f64>>>> {
    let original = model.soup();
    let (points, others) = (original.points.len(), suspect.points.len());
    let matchings = match_connectivity(&original.triangles, points, &suspect.triangles, others);
    let place = |v: Option<u32>| v.and_then(|v| suspect.points.get(v as usize).copied());
    let places = |m: &VertexMatching| m.of_first.iter().map(|v| place(*v)).collect::<Vec<_>>();
    let fitted = matchings.found.iter().map(places).filter_map(|found| {
        let pairs = Pairs::new(original, &found);
        Some((pairs.rms(&pairs.placement()?), found))
    });
    let mut fitted: Vec<_> = fitted.collect();
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (factor, length) = TOLD_APART;
    let limit = fitted.first().map_or(0.0, |best| factor * best.0 + length * model.largest_side());
    fitted.into_iter().filter(|(rms, _)| *rms <= limit).map(|(_, found)| found).take(MOST_POSES).collect()
}
