//! The account of one look at a suspect: the hypotheses that p is corrected for, and whether one is certain.
//!
//! A suspect is looked at as a whole, and where that does not settle it as a mirror image, part by part, and through a warp. Whether it gets so
//! far depends on w, so each look pays for itself, whether others follow or not. Look i has a share s_i of the chance to find
//! something where nothing is, and counts its k_i tests as k_i / s_i:
//!
//! ```text
//! Pr[min_i p_i k_i / s_i ≤ x] ≤ Σ_i k_i · (x s_i / k_i) = x,    Σ_i s_i = 1
//! ```
//!
//! The usual look has nearly all, 63/64: others cost it 0.007 of log10 p. Where the shape alone says that there are no others it has all.

use crate::budget::Budget;
use crate::examiner::{Examiner, Hypothesis, Look};
use crate::limits::MOST_POSES;
use crate::nuisances::{NUISANCES, WARP};
use crate::options::{SearchOptions, When};
use crate::stages::Stages;
use sombrero_extraction::Estimate;
use sombrero_stats::best_of;

/// The orders of magnitude that the best p must be below the threshold for the search to end early.
const MARGIN: f64 = 54.0;

/// The orders of magnitude that it must be below the threshold for a warp not to be looked for.
const CLEAR: f64 = 14.0;

/// Each other look has one of so many shares, the usual one has the rest.
const SHARES: usize = 192;
/// Looks beside the usual one.
const OTHERS: usize = 3;

/// One look under way.
pub(crate) struct Tally<'a, E> {
    pub(crate) options: &'a SearchOptions,
    budget: Budget,
    pub(crate) examiner: E,
    pub(crate) seconds: Stages,
    pub(crate) warnings: Vec<String>,
    look: Look,
    /// Whether the shape may let others follow.
    shared: bool,
    /// Routes taken so far.
    routes: usize,
    /// Routes that may yet be taken, at most.
    possible: usize,
}

impl<'a, E: Examiner> Tally<'a, E> {
    pub(crate) fn new(options: &'a SearchOptions, budget: Budget, look: Look, examiner: E) -> Self {
        let possible = match look {
            Look::Whole if options.resampling == When::Auto => 2 * MOST_POSES,
            _ => MOST_POSES,
        };
        Self {
            options,
            budget,
            examiner,
            seconds: Stages::default(),
            warnings: Vec::new(),
            look,
            // A suspect that must not be moved is looked at as it is.
            shared: options.registration != When::Never,
            routes: 0,
            possible,
        }
    }

    /// Counts the routes of one kind, of which there might have been [`MOST_POSES`].
    pub(crate) fn take(&mut self, routes: usize) {
        self.possible = self.possible.saturating_sub(MOST_POSES);
        self.routes += routes;
    }

    /// Counts all routes that there are.
    pub(crate) fn take_all(&mut self, routes: usize) {
        self.possible = 0;
        self.routes += routes;
    }

    /// Says that no other routes will be taken. Only the shapes may be the reason.
    pub(crate) fn close(&mut self) {
        self.possible = 0;
    }

    /// Says that there will be no other look. Only the shapes may be the reason.
    pub(crate) fn close_all(&mut self) {
        self.close();
        self.shared = false;
    }

    /// Whether other routes may and need be taken.
    pub(crate) fn is_open(&self) -> bool {
        self.possible > 0 && !self.is_over()
    }

    /// Whether another look may follow.
    pub(crate) fn is_shared(&self) -> bool {
        self.shared
    }

    /// Whether the suspect may be moved.
    pub(crate) fn registers(&self) -> bool {
        self.options.registration != When::Never
    }

    pub(crate) fn look(&self) -> Look {
        self.look
    }

    pub(crate) fn show(&mut self, hypothesis: &Hypothesis, estimate: &Estimate) -> Result<(), E::Error> {
        self.examiner.examine(hypothesis, estimate, &mut self.seconds)
    }

    /// All tests that p is corrected for: of the routes taken, and as long as others may come, of those too; and more of them
    /// where looks share.
    pub(crate) fn counted(&self) -> usize {
        let nuisances = if self.look == Look::Warped { WARP.len() } else { NUISANCES.len() };
        let each = nuisances * E::TESTS * self.examiner.watermarks();
        let tests = (self.routes + self.possible).saturating_mul(each);
        match self.look {
            _ if !self.shared => tests,
            Look::Whole => tests.saturating_mul(SHARES).div_ceil(SHARES - OTHERS),
            Look::Mirrored | Look::Parts | Look::Warped => tests.saturating_mul(SHARES),
        }
    }

    /// The decimal logarithm of the best p so far, corrected; 0 before there is one.
    pub(crate) fn log10_p(&self) -> f64 {
        self.examiner.best().map_or(0.0, |best| best_of(best, self.counted()).log10())
    }

    /// Whether the best p so far stays found by a wide margin whatever the others would give.
    pub(crate) fn is_certain(&self) -> bool {
        self.log10_p() <= self.options.threshold.log10() - MARGIN
    }

    /// Whether no more need or may be examined. The first estimate is made whatever it takes.
    pub(crate) fn is_over(&self) -> bool {
        self.is_certain() || (self.examiner.best().is_some() && self.budget.is_spent())
    }

    /// Whether the best p so far counts as found.
    pub(crate) fn is_found(&self) -> bool {
        self.log10_p() <= self.options.threshold.log10()
    }

    /// Whether it is found so clearly that evidence which takes seconds to get is not missed.
    pub(crate) fn is_clear(&self) -> bool {
        self.log10_p() <= self.options.threshold.log10() - CLEAR
    }

    /// Ends the look. Routes that were left out because one is certain, or the time was over, stay counted.
    pub(crate) fn finish(&mut self) {
        if !self.is_over() {
            self.possible = 0;
        }
    }
}
