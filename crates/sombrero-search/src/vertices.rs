//! The route by vertices: for each point of the original it is known, or supposed, where it is on the suspect.

use crate::error::SearchError;
use crate::examiner::{Examiner, Hypothesis};
use crate::limits::CORRESPONDS;
use crate::nuisances::NUISANCES;
use crate::original::Original;
use crate::pairs::Pairs;
use crate::tally::Tally;
use nalgebra::{Affine3, Point3};

/// Examines every correspondence with every nuisance: for each of the original's points its place on the suspect, in
/// the suspect's coordinates. One that fits the original closes the search: surfaces tell no more than it.
pub(crate) fn by_vertices<E: Examiner>(
    original: &Original,
    correspondences: Vec<Vec<Option<Point3<f64>>>>,
    tally: &mut Tally<'_, E>,
) -> Result<(), E::Error> {
    tally.take(correspondences.len());
    for found in correspondences {
        if tally.is_certain() {
            break;
        }
        let pairs = Pairs::new(original.model().soup(), &found);
        let pose = if tally.registers() { pairs.similarity() } else { None };
        if pairs.rms(&pose.unwrap_or_default()) < CORRESPONDS * original.model().largest_side() {
            tally.close();
        }
        let placed: Vec<_> = match &pose {
            Some(pose) => found.iter().map(|p| p.map(|p| pose * p)).collect(),
            None => found,
        };
        let pose = pose.map(|pose| Affine3::from_matrix_unchecked(pose.to_homogeneous()));
        for (nuisance, solved_for) in NUISANCES {
            let extractor = original.extractor().map_err(SearchError::from)?;
            let estimate =
                tally.seconds.time("extraction", || extractor.estimate_from_vertices(&placed, solved_for));
            let hypothesis = Hypothesis { nuisance, resampling: false, pose };
            tally.show(&hypothesis, &estimate.map_err(SearchError::from)?)?;
            if tally.is_certain() {
                break;
            }
        }
    }
    Ok(())
}
