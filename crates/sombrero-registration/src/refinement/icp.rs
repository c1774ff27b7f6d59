//! Point-to-plane ICP with uniform scale (Chen and Medioni 1992, `chen1992`; section 5 of the paper), in rounds.
//!
//! A coarse round on few samples comes first, and one on many follows from where it ended. That one weighs all near pairs
//! alike, or robustly where [`IcpOptions::uniform_reach`] is `None`: not one after the other, since where a sum of squares
//! is least does not depend on where one began to look. Pairs go from the suspect to the reference only, so a cropped
//! suspect needs no special care; what the suspect has and the reference has not is rejected by distance.
//!
//! Cost: an iteration is one closest-point query a sample, O(samples · log triangles).

use crate::options::IcpOptions;
use crate::refinement::criteria::Criteria;
use crate::refinement::motion::Motion;
use crate::refinement::optimizer::{self, Correspondences, Run};
use crate::refinement::rejector::Rejector;
use crate::surface::sample::{Sample, samples};
use crate::surface::shape::Shape;

/// Samples of a trial.
const TRIAL_SAMPLES: usize = 500;
/// How far from its counterpart a sample may be in a rough pose, in units of the diagonal.
pub(crate) const ROUGH_REACH: f64 = 0.3;
/// Least [`IcpOptions::relative_tolerance`] of all rounds but the last.
const COARSE_TOLERANCE: f64 = 0.3;
/// Coarse, and fine or uniform.
pub(crate) const ROUNDS: usize = 2;

/// Samples of one suspect, for any number of starts.
pub(crate) struct Icp<'a> {
    reference: &'a Shape,
    options: &'a IcpOptions,
    pub(crate) coarse: Vec<Sample>,
    trial: Vec<Sample>,
    fine: Vec<Sample>,
}

impl<'a> Icp<'a> {
    pub(crate) fn new(reference: &'a Shape, suspect: &Shape, options: &'a IcpOptions) -> Self {
        Self {
            reference,
            options,
            coarse: samples(suspect, options.coarse_samples),
            trial: samples(suspect, TRIAL_SAMPLES),
            fine: samples(suspect, options.samples),
        }
    }

    /// A few steps on few samples, to see where a start leads. Pairs farther apart than `reach` do not count.
    pub(crate) fn trial_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let rejector = Rejector { rejection: self.options.rejection, reach, ..Rejector::none(0.1) };
        self.run(&self.trial, start, rejector, COARSE_TOLERANCE, max_iterations)
    }

    /// The round from a rough pose.
    pub(crate) fn coarse_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let IcpOptions { rejection, tukey, relative_tolerance, .. } = *self.options;
        let rejector = Rejector { rejection, tukey, reach, ..Rejector::none(0.05) };
        let tolerance = relative_tolerance.max(COARSE_TOLERANCE);
        self.run(&self.coarse, start, rejector, tolerance, max_iterations)
    }

    /// The round from where the coarse one ended.
    fn fine_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let IcpOptions { rejection, tukey, relative_tolerance, .. } = *self.options;
        let rejector = Rejector { rejection, tukey, reach, ..Rejector::none(0.005) };
        self.run(&self.fine, start, rejector, relative_tolerance, max_iterations)
    }

    /// The round in which all pairs within reach weigh alike.
    fn uniform_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let rejector = Rejector { reach, ..Rejector::none(0.0) };
        self.run(&self.fine, start, rejector, self.options.relative_tolerance, max_iterations)
    }

    /// Both rounds one after the other; `done` is called after each of the [`ROUNDS`].
    pub(crate) fn all_rounds<M: Motion>(
        &self,
        start: M,
        reach: f64,
        max_iterations: usize,
        done: impl Fn(),
    ) -> Run<M> {
        let coarse = self.coarse_round(start, reach, max_iterations.div_ceil(2));
        done();
        let last = match self.options.uniform_reach {
            Some(reach) => self.uniform_round(coarse.pose, reach, max_iterations),
            None => self.fine_round(coarse.pose, reach, max_iterations - coarse.iterations),
        };
        done();
        Run { iterations: coarse.iterations + last.iterations, ..last }
    }

    fn run<M: Motion>(
        &self,
        samples: &[Sample],
        start: M,
        rejector: Rejector,
        tolerance: f64,
        most: usize,
    ) -> Run<M> {
        let problem = Correspondences { reference: self.reference, samples };
        optimizer::run(problem, start, rejector, Criteria { tolerance }, most)
    }
}
