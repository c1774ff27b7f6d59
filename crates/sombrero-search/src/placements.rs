//! Which part of the original each component of a suspect may be, and where it lies on it. The shapes alone decide.

use crate::limits::{MOST_POSES, TOLD_APART};
use crate::pairs::Pairs;
use crate::parts::{Component, PartShape};
use crate::placement::{Placement, mirror_image};
use nalgebra::{Affine3, Point3};
use rayon::prelude::*;
use sombrero_mesh::{Soup, isomorphisms};
use sombrero_registration::{RegisterOptions, Registration, Starts, likeness, register};

/// Root mean square distance, in largest sides of the part, beyond which a component is another part.
const FITS: f64 = 0.03;
/// Parts that a component is registered to: those that look most like it.
const LIKELY: usize = 3;
/// Parts whose likeness is further off than this, squared, are not tried: noise and other triangles change it by less than a fifth.
const UNLIKE: f64 = 0.04;
/// Scores of poses are told apart by this factor, and this much.
const SCORES_APART: (f64, f64) = (2.25, 0.005);

/// A component of the suspect, and every place that its shape permits, best first.
#[derive(Debug, Clone)]
pub(crate) struct Found<'a> {
    pub(crate) component: &'a Component,
    pub(crate) places: Vec<Place>,
}

/// One place of a component.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// Which of the original's parts it is.
    pub(crate) part: usize,
    /// From the suspect to the original.
    pub(crate) map: Affine3<f64>,
    /// Where each of the part's points is on the suspect, placed on the original; `None` where surfaces have to be compared.
    pub(crate) vertices: Option<Vec<Option<Point3<f64>>>>,
    /// How badly it fits.
    misfit: f64,
}

/// Components whose connectivity is that of a part, placed by all numberings that fit.
pub(crate) fn by_vertices<'a>(parts: &[&PartShape], components: &'a [Component]) -> Vec<Found<'a>> {
    let found = |component: &'a Component| {
        let places = parts.iter().enumerate().flat_map(|(number, part)| numbered(number, part, component));
        with_best(component, places.collect(), |best| TOLD_APART.0 * best + TOLD_APART.1)
    };
    components.par_iter().filter_map(found).collect()
}

/// All ways to number a component as a part that fit, the best of them; none where there are too many to look at all.
fn numbered(number: usize, part: &PartShape, component: &Component) -> Vec<Place> {
    let (original, suspect) = (&part.component.soup, &component.soup);
    let [n, m] = [original, suspect].map(|soup| soup.points.len());
    if n != m || original.triangles.len() != suspect.triangles.len() {
        return Vec::new();
    }
    let mut best: Vec<Place> = Vec::new();
    let all = isomorphisms(&original.triangles, n, &suspect.triangles, m, &mut |numbering| {
        let found: Vec<_> = numbering.iter().map(|v| v.map(|v| suspect.points[v as usize])).collect();
        let pairs = Pairs::new(original, &found);
        let Some(placement) = pairs.placement() else { return };
        let misfit = pairs.rms(&placement) / part.side;
        let at = best.partition_point(|other| other.misfit <= misfit);
        if misfit <= FITS && at < MOST_POSES {
            let placed = found.iter().map(|p| p.map(|p| placement.of(&p))).collect();
            best.insert(at, Place { part: number, map: placement.map(), vertices: Some(placed), misfit });
            best.truncate(MOST_POSES);
        }
    });
    if all { best } else { Vec::new() }
}

/// Components placed by their surfaces, whole ones.
pub(crate) fn by_surfaces<'a>(parts: &[&PartShape], components: &'a [Component]) -> Vec<Found<'a>> {
    let likeness_of = |soup: &Soup| likeness(&soup.points, &soup.triangles);
    let known: Vec<Option<[f64; 3]>> = parts.iter().map(|part| likeness_of(&part.component.soup)).collect();
    let found = |component: &'a Component| {
        let own = likeness_of(&component.soup)?;
        let apart = |other: &[f64; 3]| own.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let mut likely: Vec<(f64, usize)> = known
            .iter()
            .enumerate()
            .filter_map(|(number, other)| Some((apart(other.as_ref()?), number)))
            .collect();
        likely.retain(|(apart, _)| *apart <= UNLIKE);
        likely.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        likely.truncate(LIKELY);
        let places = likely.into_iter().flat_map(|(_, number)| registered(number, parts[number], component));
        with_best(component, places.collect(), |best| SCORES_APART.0 * best + SCORES_APART.1)
    };
    components.par_iter().filter_map(found).collect()
}

/// All poses of a component on a part, or of its mirror image, that can be trusted.
fn registered(number: usize, part: &PartShape, component: &Component) -> Vec<Place> {
    let options = RegisterOptions { starts: Starts::Moments, ..RegisterOptions::default() };
    let poses = |soup: &Soup| -> Option<Registration> {
        let found = register(part.reference()?, &soup.points, &soup.triangles, &options).ok()?;
        found.trusted.then_some(found)
    };
    let place = |map, misfit| Place { part: number, map, vertices: None, misfit };
    let places = |found: &Registration, mirrored: bool| -> Vec<Place> {
        let map = |similarity| Placement { similarity, mirrored }.map();
        found
            .poses()
            .take(MOST_POSES)
            .map(|pose| place(map(pose.reference_from_suspect), pose.score))
            .collect()
    };
    let mut found = poses(&component.soup).map_or_else(Vec::new, |found| places(&found, false));
    found.extend(poses(&mirror_image(&component.soup)).iter().flat_map(|found| places(found, true)));
    found
}

/// Those that cannot be told from the best by their misfit.
fn with_best(component: &Component, mut places: Vec<Place>, limit: impl Fn(f64) -> f64) -> Option<Found<'_>> {
    places.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let limit = limit(places.first()?.misfit);
    places.retain(|place| place.misfit <= limit);
    places.truncate(MOST_POSES);
    Some(Found { component, places })
}
