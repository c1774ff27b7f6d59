//! Who is shown what the search finds. The search itself knows no watermark; who implements this trait may.

use crate::error::SearchError;
use crate::stages::Stages;
use nalgebra::Affine3;
use sombrero_extraction::Estimate;
use sombrero_stats::LogProbability;

/// What a suspect is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Look {
    /// The original, or a piece of it, in one pose.
    Whole,
    /// Its mirror image.
    Mirrored,
    /// Parts of it, each placed by itself.
    Parts,
    /// The original, or a piece of it, bent by warps that are finer than what is solved for otherwise.
    Warped,
}

impl Look {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Mirrored => "mirrored",
            Self::Parts => "parts",
            Self::Warped => "warped",
        }
    }
}

/// How an estimate came about.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Hypothesis {
    /// The name of what was solved for beside the coefficients.
    pub nuisance: &'static str,
    /// What the suspect was taken for.
    pub look: Look,
    /// Whether surfaces were compared instead of vertices.
    pub resampling: bool,
    /// The map from the suspect's coordinates to the original's; `None` when the suspect was taken as it is, or its parts
    /// have several.
    pub pose: Option<Affine3<f64>>,
}

/// One who tests each estimate, for one watermark or many, and says how sure it is. A clone of one that has seen nothing
/// begins anew: each look at a suspect gets its own.
pub trait Examiner: Clone {
    /// The reason why an examination fails; a search fails with it too.
    type Error: From<SearchError>;

    /// The number of tests that are made of each estimate for each watermark.
    const TESTS: usize;

    /// Tests the estimate that `hypothesis` gave. `seconds` is there to note the time.
    ///
    /// # Errors
    /// Those of the examiner; they end the search.
    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), Self::Error>;

    /// The smallest p of at most [`TESTS`](Self::TESTS) tests for each watermark of the estimate of these functions alone, one a
    /// coefficient; not corrected for their number, and not noted.
    ///
    /// # Errors
    /// Those of the examiner; they end the search.
    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> Result<LogProbability, Self::Error>;

    /// The smallest p of all tests so far, not corrected for their number; `None` before the first estimate.
    fn best(&self) -> Option<LogProbability>;

    /// The number of watermarks that each test is made for; 1 unless said otherwise.
    fn watermarks(&self) -> usize {
        1
    }
}
