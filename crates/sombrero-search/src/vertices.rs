//! The route by vertices: for each point of the original it is known, or supposed, where it is on the suspect.

use crate::error::SearchError;
use crate::examiner::{Examiner, Hypothesis};
use crate::limits::{CORRESPONDS, MOST_POSES};
use crate::original::Original;
use crate::pairs::Pairs;
use crate::placement::Placement;
use crate::tally::Tally;
use nalgebra::Point3;
use sombrero_extraction::Nuisance;

/// For each of the original's points its place on the suspect, in the suspect's coordinates, and how all of them are moved
/// onto the original.
pub(crate) struct Correspondence {
    found: Vec<Option<Point3<f64>>>,
    placement: Option<Placement>,
    /// Root mean square distance that is left, in largest sides of the original or of the parts that were found.
    misfit: f64,
    /// Whether it fits, so that surfaces tell no more.
    fits: bool,
    /// Whether points are missing.
    partial: bool,
}

impl Correspondence {
    pub(crate) fn new(original: &Original, found: Vec<Option<Point3<f64>>>, registers: bool) -> Self {
        let pairs = Pairs::new(original.model().soup(), &found);
        let placement = if registers { pairs.placement() } else { None };
        let rms = pairs.rms(&placement.unwrap_or(Placement::as_it_is()));
        let (side, soup) = (original.model().largest_side(), original.model().soup());
        let partial = found.iter().zip(soup.used()).any(|(found, used)| used && found.is_none());
        // One of several parts is small beside all.
        let own = if partial && original.has_parts() { pairs.side().min(side) } else { side };
        Self { found, placement, misfit: rms / own, fits: rms < CORRESPONDS * own, partial }
    }

    /// Whether it fits, so that surfaces tell no more.
    pub(crate) fn fits(&self) -> bool {
        self.fits
    }

    /// Whether it is that of a mirror image.
    pub(crate) fn is_mirrored(&self) -> bool {
        self.placement.is_some_and(|placement| placement.mirrored)
    }

    /// The same where the right one may be another: then that it fits settles nothing.
    pub(crate) fn doubted(self) -> Self {
        Self { fits: false, ..self }
    }

    /// The same where the parts that were found may as well be others: then a piece that fits settles nothing.
    pub(crate) fn doubted_if_partial(self) -> Self {
        if self.partial { self.doubted() } else { self }
    }

    /// Whether it is within this many largest sides of what was found.
    pub(crate) fn is_within(&self, sides: f64) -> bool {
        self.misfit < sides
    }
}

/// Examines every correspondence with each of these nuisances, or with the first of them where there are very many. One that fits the
/// original closes the search.
pub(crate) fn by_vertices<E: Examiner>(
    original: &Original,
    correspondences: &[Correspondence],
    nuisances: &[(&'static str, Nuisance)],
    tally: &mut Tally<'_, E>,
) -> Result<(), E::Error> {
    tally.take(correspondences.len());
    let nuisances = if correspondences.len() > MOST_POSES { &nuisances[..1] } else { nuisances };
    for correspondence in correspondences {
        if tally.is_over() {
            break;
        }
        if correspondence.fits() {
            tally.close();
        }
        let Correspondence { found, placement, .. } = correspondence;
        let placed: Vec<_> = match &placement {
            Some(placement) => found.iter().map(|p| p.map(|p| placement.of(&p))).collect(),
            None => found.clone(),
        };
        let pose = placement.map(|placement| placement.map());
        for &(nuisance, solved_for) in nuisances {
            let extractor = original.extractor().map_err(SearchError::from)?;
            let estimate =
                tally.seconds.time("extraction", || extractor.estimate_from_vertices(&placed, solved_for));
            let hypothesis = Hypothesis { nuisance, look: tally.look(), resampling: false, pose };
            tally.show(&hypothesis, &estimate.map_err(SearchError::from)?)?;
            if tally.is_over() {
                break;
            }
        }
    }
    Ok(())
}
