//! The account of a search under way: the hypotheses that p is corrected for, and whether one is certain.

use crate::error::SearchError;
use crate::examiner::{Examiner, Hypothesis};
use crate::limits::MOST_POSES;
use crate::nuisances::NUISANCES;
use crate::options::{SearchOptions, When};
use crate::stages::Stages;
use sombrero_extraction::Estimate;
use sombrero_stats::best_of;

/// The orders of magnitude that the best p must be below the threshold for the search to end early.
const MARGIN: f64 = 54.0;

/// One search under way.
pub(crate) struct Tally<'a, E> {
    pub(crate) options: &'a SearchOptions,
    pub(crate) examiner: E,
    pub(crate) seconds: Stages,
    pub(crate) warnings: Vec<String>,
    /// Routes taken so far.
    routes: usize,
    /// Routes that may yet be taken, at most.
    possible: usize,
}

impl<'a, E: Examiner> Tally<'a, E> {
    pub(crate) fn new(options: &'a SearchOptions, examiner: E) -> Self {
        let possible = if options.resampling == When::Auto { 2 * MOST_POSES } else { MOST_POSES };
        Self { options, examiner, seconds: Stages::default(), warnings: Vec::new(), routes: 0, possible }
    }

    /// Counts the routes of one kind, of which there might have been [`MOST_POSES`].
    pub(crate) fn take(&mut self, routes: usize) {
        self.possible -= MOST_POSES;
        self.routes += routes;
    }

    /// Says that no other routes will be taken. Only the shapes may be the reason.
    pub(crate) fn close(&mut self) {
        self.possible = 0;
    }

    /// Whether other routes may and need be taken.
    pub(crate) fn is_open(&self) -> bool {
        self.possible > 0 && !self.is_certain()
    }

    /// Whether the suspect may be moved.
    pub(crate) fn registers(&self) -> bool {
        self.options.registration != When::Never
    }

    pub(crate) fn show(&mut self, hypothesis: &Hypothesis, estimate: &Estimate) -> Result<(), E::Error> {
        self.examiner.examine(hypothesis, estimate, &mut self.seconds)
    }

    /// All tests that p is corrected for: of the routes taken, and as long as others may come, of those too.
    pub(crate) fn counted(&self) -> usize {
        (self.routes + self.possible) * NUISANCES.len() * E::TESTS * self.examiner.watermarks()
    }

    /// Whether the best p so far stays found by a wide margin whatever the others would give.
    pub(crate) fn is_certain(&self) -> bool {
        let limit = self.options.threshold.log10() - MARGIN;
        self.examiner.best().is_some_and(|best| best_of(best, self.counted()).log10() <= limit)
    }

    /// Closes the account. Routes that were left out because one is certain stay counted.
    pub(crate) fn finish(mut self) -> Result<Self, SearchError> {
        if !self.is_certain() {
            self.close();
        }
        if self.examiner.best().is_some() {
            Ok(self)
        } else if self.warnings.is_empty() {
            Err(SearchError::NeedsResampling)
        } else {
            Err(SearchError::NothingWorked { reasons: self.warnings.join(" ") })
        }
    }
}
