//! Who is shown what the search finds. The search itself knows no watermark; who implements this trait may.

use crate::error::SearchError;
use crate::stages::Stages;
use nalgebra::Affine3;
use sombrero_extraction::Estimate;
use sombrero_stats::LogProbability;

/// How an estimate came about.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Hypothesis {
    /// The name of what was solved for beside the coefficients.
    pub nuisance: &'static str,
    /// Whether surfaces were compared instead of vertices.
    pub resampling: bool,
    /// The map from the suspect's coordinates to the original's; `None` when the suspect was taken as it is.
    pub pose: Option<Affine3<f64>>,
}

/// One who tests each estimate, for one watermark or many, and says how sure it is.
pub trait Examiner {
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

    /// The smallest p of all tests so far, not corrected for their number; `None` before the first estimate.
    fn best(&self) -> Option<LogProbability>;

    /// The number of watermarks that each test is made for; 1 unless said otherwise.
    fn watermarks(&self) -> usize {
        1
    }
}
