//! Poses on the way to an answer, in the unit frames.

use crate::error::RegistrationError;
use crate::refinement::motion::Motion;
use crate::refinement::optimizer::Run;
use crate::result::{Pose, Registration};
use crate::surface::shape::Shape;
use crate::verdict::fit::{Fit, REACH};
use crate::verdict::trust::is_trusted;

/// Poses tell apart when their RMS differs by more than this factor and this length, in units of the
/// diagonal: about what a mark does to the surface.
const TOLD_APART: (f64, f64) = (1.5, 5e-4);

/// A start after refinement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate<M> {
    pub(crate) run: Run<M>,
    pub(crate) fit: Fit,
}

impl<M: Motion> Candidate<M> {
    /// The pose in model units.
    fn pose(&self, reference: &Shape, suspect: &Shape) -> Result<Pose<M::Model>, RegistrationError> {
        let Fit { score, rms, overlap, suspect_overlap, .. } = self.fit;
        let reference_from_suspect =
            self.run.pose.to_model(reference, suspect).ok_or(RegistrationError::SizeRatio)?;
        Ok(Pose { reference_from_suspect, rms: rms * reference.diagonal, overlap, suspect_overlap, score })
    }
}

/// Those that the fit cannot tell from the best, which comes first.
///
/// What has no counterpart costs every pose alike; so the scores may differ by as much as the matched distances
/// would make them differ, were their RMS larger by [`TOLD_APART`], and by three standard errors of that cost.
pub(crate) fn comparable<M>(mut candidates: Vec<Candidate<M>>) -> Vec<Candidate<M>> {
    if let Some(fit) = candidates.first().map(|c| c.fit) {
        let rms = fit.rms.min(REACH);
        let larger = TOLD_APART.0 * rms + TOLD_APART.1;
        let limit = fit.score + (larger * larger - rms * rms) / (REACH * REACH) + 3.0 * fit.error();
        candidates.retain(|c| c.fit.score <= limit);
    }
    candidates
}

/// The answer that `candidates` are, the best first, with at most `most` alternatives.
pub(crate) fn answer<M: Motion>(
    reference: &Shape,
    suspect: &Shape,
    candidates: &[Candidate<M>],
    most: usize,
) -> Result<Registration<M::Model>, RegistrationError> {
    let poses = candidates.iter().take(most + 1).map(|c| c.pose(reference, suspect));
    let mut poses = poses.collect::<Result<Vec<_>, _>>()?.into_iter();
    let (Some(first), Some(best)) = (candidates.first(), poses.next()) else {
        return Err(RegistrationError::NoStarts);
    };
    Ok(Registration {
        best,
        alternatives: poses.collect(),
        agreement: first.fit.agreement(),
        sharpness: first.fit.sharpness(),
        trusted: is_trusted(&first.fit),
        iterations: first.run.iterations,
        converged: first.run.converged,
    })
}
