//! The loop of point-to-plane ICP, run by argmin: an ICP step is an iteration of a [`Solver`].
//!
//! ```text
//! repeat  pairs   ← closest points of the reference to the suspect's samples     (pairs)
//!         weights ← rejection and Tukey's biweight                               (rejector)
//!         pose    ← Gauss-Newton step ∘ pose                                     (reduction)
//! until   the step is small against the pose's own uncertainty                   (criteria)
//!         or iterations run out
//! ```

use argmin::core::{
    Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};

use crate::refinement::criteria::Criteria;
use crate::refinement::motion::Motion;
use crate::refinement::pairs::{self, Pair};
use crate::refinement::rejector::{Rejector, Weights};
use crate::surface::sample::Sample;
use crate::surface::shape::Shape;

/// Where a run ended, in the unit frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run<M> {
    pub(crate) pose: M,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

/// The problem: a surface to lie on and samples that should.
#[derive(Clone, Copy)]
pub(crate) struct Correspondences<'a> {
    pub(crate) reference: &'a Shape,
    pub(crate) samples: &'a [Sample],
}

/// Iterates from `start`, `most` times at most.
pub(crate) fn run<M: Motion>(
    problem: Correspondences<'_>,
    start: M,
    rejector: Rejector,
    criteria: Criteria,
    most: usize,
) -> Run<M> {
    let solver = PointToPlane { rejector, criteria, faces: Vec::new(), settled: false };
    let configure = |state: PoseState<M>| state.param(start).max_iters(most as u64);
    // The solver has no way to fail; staying at the start is what a failure would mean.
    let result = Executor::new(problem, solver).configure(configure).timer(false).run().ok();
    let mut run = Run { pose: start, iterations: 0, converged: false };
    if let Some(state) = result.as_ref().map(|r| r.state()) {
        run.pose = state.get_param().copied().unwrap_or(start);
        run.iterations = state.get_iter() as usize;
        run.converged = matches!(state.get_termination_reason(), Some(TerminationReason::SolverConverged));
    }
    run
}

/// What argmin carries from iteration to iteration: a pose and its cost, no derivatives.
type PoseState<M> = IterState<M, (), (), (), (), f64>;

/// The solver: an ICP step an iteration.
struct PointToPlane {
    /// Its floor is halved by each step.
    rejector: Rejector,
    criteria: Criteria,
    /// Faces of the last closest points, where the next search starts.
    faces: Vec<u32>,
    /// Whether the last step was small enough.
    settled: bool,
}

impl PointToPlane {
    /// The pose after one step from `pose`, and the weighted mean square residual before it.
    fn advance<M: Motion>(&mut self, problem: &Correspondences, pose: &M) -> (M, f64) {
        let pairs = pairs::find(problem.reference, problem.samples, &pose.map(), &mut self.faces);
        let Weights { values, floored } = self.rejector.weights(&pairs);
        let change = M::step(&pairs, &values);
        let cost = mean_square_residual(&pairs, &values);
        self.settled = self.criteria.are_met(&pairs, &change.map(), cost, floored);
        self.rejector.floor /= 2.0;
        (change.after(pose), cost)
    }
}

/// Infinite when no pair has weight.
fn mean_square_residual(pairs: &[Pair], weights: &[f64]) -> f64 {
    let total: f64 = weights.iter().sum();
    let squares: f64 = pairs.iter().zip(weights).map(|(p, w)| w * p.residual().powi(2)).sum();
    if total > 0.0 { squares / total } else { f64::INFINITY }
}

impl<M: Motion> Solver<Correspondences<'_>, PoseState<M>> for PointToPlane {
    fn name(&self) -> &str {
        "point-to-plane ICP with scale"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<Correspondences<'_>>,
        state: PoseState<M>,
    ) -> Result<(PoseState<M>, Option<KV>), Error> {
        let Some(&pose) = state.get_param() else { return Ok((state, None)) };
        let (pose, cost) = problem.problem("pairs_count", |p| Ok(self.advance(p, &pose)))?;
        Ok((state.param(pose).cost(cost), None))
    }

    fn terminate(&mut self, _: &PoseState<M>) -> TerminationStatus {
        if self.settled {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
