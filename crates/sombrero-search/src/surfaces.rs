//! The route by surfaces: the suspect against the original in every pose that fits.

use crate::error::SearchError;
use crate::examiner::{Examiner, Hypothesis};
use crate::original::Original;
use crate::suspect::Suspect;
use crate::tally::Tally;
use nalgebra::Affine3;
use sombrero_extraction::Nuisance;
use sombrero_mesh::Soup;

/// Examines every pose with each of these nuisances: the simplest nuisance in all poses first, since of a symmetric shape's poses
/// one is right.
pub(crate) fn by_surfaces<E: Examiner>(
    original: &Original,
    suspect: &Suspect,
    poses: &[Affine3<f64>],
    nuisances: &[(&'static str, Nuisance)],
    tally: &mut Tally<'_, E>,
) -> Result<(), E::Error> {
    tally.take(poses.len());
    let registers = tally.registers();
    let suspects: Vec<Soup> = poses.iter().map(|pose| moved(&suspect.soup, pose)).collect();
    for &(nuisance, solved_for) in nuisances {
        for (pose, placed) in poses.iter().zip(&suspects) {
            if tally.is_over() {
                return Ok(());
            }
            let extractor = original.extractor().map_err(SearchError::from)?;
            let estimate = tally.seconds.time("extraction", || match suspect.cloud {
                true => extractor.estimate_from_points(placed, solved_for),
                false => extractor.estimate_from_surface(placed, solved_for),
            });
            let hypothesis = Hypothesis {
                nuisance,
                look: tally.look(),
                resampling: true,
                pose: registers.then_some(*pose),
            };
            tally.show(&hypothesis, &estimate.map_err(SearchError::from)?)?;
        }
    }
    Ok(())
}

/// The soup in this pose. A mirror image is inside out, which extraction sees.
pub(crate) fn moved(soup: &Soup, pose: &Affine3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| pose * p).collect(), soup.triangles.clone())
}
