//! The route by parts: each component of the suspect placed on its own, and the evidence of all summed up.
//!
//! A component may have several places that its shape cannot tell apart: parts that occur twice, parts with symmetries. The
//! examiner says of each place how well it suits, and the best is taken; all combinations are counted, as if each had been
//! tried:
//!
//! ```text
//! p = (Π_s n_s + Σ_s n_s) · min over what was tried,    n_s places of component s
//! ```
//!
//! The first term is for the sum over all components, the second for each component by itself, which counts where the others are
//! no use. However the examiner chooses, what it chose is one of those.

use crate::error::SearchError;
use crate::examiner::{Examiner, Hypothesis, Look};
use crate::nuisances::NUISANCES;
use crate::original::Original;
use crate::parts::Part;
use crate::placements::{Found, Place};
use crate::surfaces::moved;
use crate::tally::Tally;
use nalgebra::Affine3;
use rayon::prelude::*;
use sombrero_extraction::{Estimate, Nuisance};
use sombrero_stats::LogProbability;

/// The first of [`NUISANCES`], without the free form: parts are laid elsewhere, and seldom bent.
const SIMPLE: usize = 3;
/// Combinations of places at most; components with the most places are left out before there are more.
const COMBINATIONS: usize = 1_000_000_000;

/// A part of the original where it was found on the suspect.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FoundPart {
    /// The part of the original, by the order of the parts' first points.
    pub part: usize,
    /// The component of the suspect, by the order of the components' first points.
    pub component: usize,
    /// From the suspect's coordinates to the original's.
    pub pose: Affine3<f64>,
    /// The smallest p of this component alone, not corrected.
    pub p: LogProbability,
    /// The share of the part's area that was found, 0 to 1.
    pub coverage: f64,
}

/// Examines the components together and each by itself, with every nuisance. Gives where they were found.
pub(crate) fn by_parts<E: Examiner>(
    original: &Original,
    mut found: Vec<Found<'_>>,
    tally: &mut Tally<'_, E>,
) -> Result<Vec<FoundPart>, E::Error> {
    let combinations = keep_countable(&mut found);
    let alone: usize = found.iter().map(|found| found.places.len()).sum();
    tally.take_all(combinations + alone);
    let mut best: Vec<FoundPart> = Vec::new();
    for &(name, nuisance) in &NUISANCES[..SIMPLE] {
        if tally.is_over() {
            break;
        }
        let estimates = tally.seconds.time("extraction", || estimates(original.parts(), &found, nuisance))?;
        let mut chosen = Vec::new();
        for (found, estimates) in found.iter().zip(&estimates) {
            chosen.extend(choose(original.parts(), found, estimates, tally)?);
        }
        let hypothesis = |chosen: &[Chosen<'_>]| Hypothesis {
            nuisance: name,
            look: Look::Parts,
            resampling: chosen.iter().any(|chosen| chosen.place.vertices.is_none()),
            pose: if let [one] = chosen { Some(one.place.map) } else { None },
        };
        tally.show(&hypothesis(&chosen), &pooled(original, &chosen))?;
        // One that is surer by itself than all are together.
        let surest = chosen.iter().min_by(|a, b| a.p.ln().total_cmp(&b.p.ln())).filter(|_| chosen.len() > 1);
        if let Some(surest) = surest.filter(|one| tally.examiner.best().is_none_or(|best| one.p < best)) {
            let one = std::slice::from_ref(surest);
            tally.show(&hypothesis(one), &pooled(original, one))?;
        }
        note(original, &chosen, &mut best);
    }
    best.sort_by_key(|part| (part.part, part.component));
    Ok(best)
}

/// Leaves out components with many places until the combinations can be counted. Gives their number.
fn keep_countable(found: &mut Vec<Found<'_>>) -> usize {
    found.sort_by_key(|found| found.places.len());
    let mut combinations: usize = 1;
    let countable = |found: &Found<'_>| {
        let more = combinations.saturating_mul(found.places.len());
        let fits = more <= COMBINATIONS;
        if fits {
            combinations = more;
        }
        fits
    };
    found.retain(countable);
    combinations
}

/// For each component the estimate at each of its places.
fn estimates(
    parts: &[Part],
    found: &[Found<'_>],
    nuisance: Nuisance,
) -> Result<Vec<Vec<Estimate>>, SearchError> {
    let estimate = |component: &Found<'_>| {
        let at = |place: &Place| {
            let extractor = &parts[place.part].extractor;
            match &place.vertices {
                Some(vertices) => extractor.estimate_from_vertices(vertices, nuisance),
                None => {
                    extractor.estimate_from_surface(&moved(&component.component.soup, &place.map), nuisance)
                }
            }
        };
        component.places.iter().map(at).collect::<Result<Vec<_>, _>>().map_err(SearchError::from)
    };
    found.par_iter().map(estimate).collect()
}

/// The place of a component that suits best.
struct Chosen<'a> {
    component: usize,
    place: &'a Place,
    part: &'a Part,
    estimate: &'a Estimate,
    /// Of the component alone.
    p: LogProbability,
}

fn choose<'a, E: Examiner>(
    parts: &'a [Part],
    found: &'a Found<'_>,
    estimates: &'a [Estimate],
    tally: &mut Tally<'_, E>,
) -> Result<Option<Chosen<'a>>, E::Error> {
    let mut best: Option<Chosen<'a>> = None;
    for (place, estimate) in found.places.iter().zip(estimates) {
        let part = &parts[place.part];
        let p = tally.seconds.time("tests", || tally.examiner.weigh(&part.functions, estimate))?;
        if best.as_ref().is_none_or(|best| p < best.p) {
            best = Some(Chosen { component: found.component.number, place, part, estimate, p });
        }
    }
    Ok(best)
}

/// What the chosen components say together.
fn pooled(original: &Original, chosen: &[Chosen<'_>]) -> Estimate {
    let soup = original.model().soup();
    let (mut positions, mut present) = (soup.points.clone(), vec![false; soup.points.len()]);
    for Chosen { part, estimate, .. } in chosen {
        for (local, &point) in part.shape.component.points.iter().enumerate() {
            if estimate.present[local] {
                positions[point as usize] = estimate.positions[local];
                present[point as usize] = true;
            }
        }
    }
    let parts: Vec<(&[usize], &Estimate)> =
        chosen.iter().map(|chosen| (chosen.part.functions.as_slice(), chosen.estimate)).collect();
    Estimate::pooled(original.basis().functions().len(), &parts, positions, present)
}

/// Notes of each component its surest place so far.
fn note(original: &Original, chosen: &[Chosen<'_>], best: &mut Vec<FoundPart>) {
    let parts = original.parts();
    for Chosen { component, place, part, estimate, p } in chosen {
        let found = FoundPart {
            part: parts[place.part].shape.component.number,
            component: *component,
            pose: place.map,
            p: *p,
            coverage: part.shape.coverage(&estimate.present),
        };
        match best.iter_mut().find(|known| known.component == *component) {
            Some(known) if found.p < known.p => *known = found,
            Some(_) => {}
            None => best.push(found),
        }
    }
}
