//! Which vertex is which, by the connectivity: for suspects that were renumbered or cropped. Where it permits several ways, the
//! shape decides.

use crate::limits::{TOLD_APART, most_matchings};
use crate::model::Model;
use crate::pairs::Pairs;
use nalgebra::Point3;
use sombrero_mesh::{Soup, VertexMatching, best_matchings};

/// The ways to number the suspect's vertices as the original's that fit the shape.
#[derive(Debug)]
pub(crate) struct Matched {
    /// Best first: for each of the original's points its place on the suspect, in the suspect's coordinates, or `None`.
    pub(crate) ways: Vec<Vec<Option<Point3<f64>>>>,
    /// Whether there may be others that fit better.
    pub(crate) truncated: bool,
}

/// Every way to number the suspect's vertices as the original's that fits the shape.
pub(crate) fn matched(model: &Model, suspect: &Soup) -> Matched {
    let original = model.soup();
    let (points, others) = (original.points.len(), suspect.points.len());
    // Sums of squares, which add up over components.
    let misfit = |pairs: &[(u32, u32)]| {
        let pairs = pairs.iter().map(|&(s, o)| (suspect.points[s as usize], original.points[o as usize]));
        let pairs = Pairs::from_iter(pairs);
        pairs.placement().map_or(f64::INFINITY, |placement| pairs.sum_of_squares(&placement))
    };
    let most = most_matchings(points);
    let matchings = best_matchings(&original.triangles, points, &suspect.triangles, others, most, &misfit);
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
    let ways = fitted.into_iter().filter(|(rms, _)| *rms <= limit).map(|(_, found)| found).collect();
    Matched { ways, truncated: matchings.truncated }
}
