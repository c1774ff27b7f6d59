//! The routes, in order: vertices first, which are quick and exact, surfaces when those do not settle it.

use crate::examiner::Examiner;
use crate::matched::matched;
use crate::options::{SearchOptions, When};
use crate::original::Original;
use crate::poses::poses;
use crate::stages::Stages;
use crate::surfaces::by_surfaces;
use crate::suspect::Suspect;
use crate::tally::Tally;
use crate::vertices::by_vertices;

/// A search that is over.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SearchOutcome<E> {
    /// Who was shown every estimate.
    pub examiner: E,
    /// The number of tests that the best p is to be corrected for: those made, and those left out because one was certain.
    pub counted: usize,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

/// Shows the examiner an estimate for every hypothesis that the shapes permit, until one is certain.
///
/// # Errors
/// [`SearchError`](crate::SearchError) when no hypothesis can be examined or a step that was insisted on cannot be taken; and
/// what the examiner fails with.
pub fn search<E: Examiner>(
    original: &Original,
    suspect: &Suspect,
    options: &SearchOptions,
    examiner: E,
) -> Result<SearchOutcome<E>, E::Error> {
    let mut tally = Tally::new(options, examiner);
    if options.resampling != When::Always {
        let correspondences = match &suspect.correspondence {
            Some(stored) => vec![stored.clone()],
            None => tally.seconds.time("matching", || matched(original.model(), &suspect.soup)),
        };
        by_vertices(original, correspondences, &mut tally)?;
    }
    if tally.is_open() {
        let poses = poses(original, &suspect.soup, options.registration, &mut tally.seconds)?;
        tally.warnings.extend(poses.warning);
        by_surfaces(original, &suspect.soup, &poses.found, &mut tally)?;
    }
    let tally = tally.finish()?;
    Ok(SearchOutcome {
        counted: tally.counted(),
        examiner: tally.examiner,
        seconds: tally.seconds,
        warnings: tally.warnings,
    })
}
