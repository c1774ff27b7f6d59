//! Point-to-plane ICP with uniform scale (Chen and Medioni 1992, `chen1992`; section 5 of the paper).
//!
//! ```text
//! repeat  pairs   ← closest points of the reference to the suspect's samples     (pairs.rs)
//!         weights ← rejection and Tukey's biweight                               (pairs.rs)
//!         pose    ← Gauss-Newton step in 7 unknowns ∘ pose                       (step.rs)
//! until   the step is small against the pose's own uncertainty, or iterations run out
//! ```
//!
//! run by argmin as a [`Solver`]. A coarse round on few samples comes first, a fine round on many follows
//! from where it ended. Pairs go from the suspect to the reference only, so a cropped suspect needs no
//! special care; what the suspect has and the reference has not is rejected by distance.
//!
//! Cost: an iteration is one closest-point query a sample, O(samples · log triangles).

use argmin::core::{
    Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};
use nalgebra::{Point3, Similarity3};

use crate::affine_map::AffineMap;
use crate::error::{RegistrationError, Side};
use crate::judge::Judge;
use crate::motion::Motion;
use crate::pairs::{self, Pair, Policy, Weights};
use crate::reference::Reference;
use crate::register::{Pose, Registration};
use crate::sample::{Sample, samples};
use crate::shape::{Shape, to_unit};
use sombrero_progress::Progress;

/// Samples of a trial.
const TRIAL_SAMPLES: usize = 500;
/// How far from its counterpart a sample may be in a rough pose, in units of the diagonal.
pub(crate) const ROUGH_REACH: f64 = 0.3;
/// Least [`IcpOptions::relative_tolerance`] of all rounds but the last.
const COARSE_TOLERANCE: f64 = 0.3;
/// Coarse, fine and uniform.
pub(crate) const ROUNDS: usize = 3;
/// Steps below this move nothing but rounding errors, in units of the diagonal.
const SMALLEST_STEP: f64 = 1e-13;

/// Samples, stopping rule and outlier policy of [`align`].
#[derive(Debug, Clone, PartialEq)]
pub struct IcpOptions {
    /// Points of the suspect in the coarse round, 100 to 10⁷. Default 2 000.
    pub coarse_samples: usize,
    /// Points of the suspect in the fine round, 100 to 10⁷. Default 20 000.
    pub samples: usize,
    /// Iterations at most, coarse and fine round together, and again for the last one. Default 60.
    pub max_iterations: usize,
    /// Stop when a step moves the suspect by less than this fraction of its standard error, which is the
    /// residual over the square root of the number of samples. Default 0.03.
    pub relative_tolerance: f64,
    /// Drop pairs farther apart than this many median pair distances; `None` keeps all. Default `Some(4.0)`.
    pub rejection: Option<f64>,
    /// Width of Tukey's biweight in the fine round, in standard deviations of the residual estimated from
    /// their median; `None` weights all pairs alike. Default `Some(5.0)`.
    pub tukey: Option<f64>,
    /// A last round in which all pairs closer than this fraction of the reference's diagonal weigh alike;
    /// `None` leaves it out. Default `Some(0.02)`.
    ///
    /// Robust weights find the pose among outliers. But where the suspect differs everywhere a little, as by a
    /// watermark whose functions have no mean, they prefer the parts that happen to fit, and plain least
    /// squares is nearer to the truth.
    pub uniform_reach: Option<f64>,
}

impl Default for IcpOptions {
    fn default() -> Self {
        Self {
            coarse_samples: 2_000,
            samples: 20_000,
            max_iterations: 60,
            relative_tolerance: 0.03,
            rejection: Some(4.0),
            tukey: Some(5.0),
            uniform_reach: Some(0.02),
        }
    }
}

impl IcpOptions {
    pub(crate) fn check(&self) -> Result<(), RegistrationError> {
        let within = |option, value: f64, least: f64, most: f64, range| {
            let inside = (least..=most).contains(&value);
            if inside { Ok(()) } else { Err(RegistrationError::Option { option, value, range }) }
        };
        within("coarse_samples", self.coarse_samples as f64, 100.0, 1e7, "from 100 to 10000000")?;
        within("samples", self.samples as f64, 100.0, 1e7, "from 100 to 10000000")?;
        within("relative_tolerance", self.relative_tolerance, 0.0, 1e6, "from 0 to 1e6")?;
        within("rejection", self.rejection.unwrap_or(1.0), 1.0, f64::MAX, "at least 1")?;
        within("tukey", self.tukey.unwrap_or(1.0), 1.0, f64::MAX, "at least 1")?;
        within("uniform_reach", self.uniform_reach.unwrap_or(0.0), 0.0, 1.0, "from 0 to 1")
    }
}

/// Brings the suspect onto the reference from a rough pose, which may be off by some 20 degrees, a tenth
/// of the size and a tenth of the scale.
///
/// `start` maps suspect to reference, in model units. The suspect may show only a part of the reference.
///
/// # Errors
/// [`RegistrationError`] when the suspect has no shape, the start is no similarity, or an option is out of
/// range. Running out of iterations is told by [`Registration::converged`].
pub fn align(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    start: &Similarity3<f64>,
    options: &IcpOptions,
) -> Result<Registration, RegistrationError> {
    options.check()?;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let start = to_unit(&reference.shape, &suspect, start).ok_or(RegistrationError::Start { index: 0 })?;
    let icp = Icp::new(&reference.shape, &suspect, options);
    let progress = Progress::new("registration", ROUNDS);
    let run = icp.all_rounds(start, ROUGH_REACH, options.max_iterations, || progress.advance(1));
    let judge = Judge::fine(&reference.shape, &suspect, options);
    let fit = judge.fit(&run.pose.map());
    let pose = Pose::new(&reference.shape, &suspect, &run.pose, &fit)?;
    Ok(Registration::new(pose, &fit, run.iterations, run.converged, Vec::new()))
}

/// Samples of one suspect, for any number of starts.
pub(crate) struct Icp<'a> {
    reference: &'a Shape,
    options: &'a IcpOptions,
    pub(crate) coarse: Vec<Sample>,
    trial: Vec<Sample>,
    fine: Vec<Sample>,
}

/// Where a run ended, in the unit frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run<M> {
    pub(crate) pose: M,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
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
        let policy = Policy { rejection: self.options.rejection, reach, ..Policy::all(0.1) };
        self.run(&self.trial, start, PointToPlane::new(policy, COARSE_TOLERANCE), max_iterations)
    }

    /// From a rough pose.
    pub(crate) fn coarse_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let IcpOptions { rejection, tukey, relative_tolerance, .. } = *self.options;
        let solver = PointToPlane::new(
            Policy { rejection, tukey, reach, ..Policy::all(0.05) },
            relative_tolerance.max(COARSE_TOLERANCE),
        );
        self.run(&self.coarse, start, solver, max_iterations)
    }

    /// From where the coarse round ended.
    fn fine_round<M: Motion>(&self, start: M, reach: f64, max_iterations: usize) -> Run<M> {
        let IcpOptions { rejection, tukey, relative_tolerance, .. } = *self.options;
        let policy = Policy { rejection, tukey, reach, ..Policy::all(0.005) };
        let solver = PointToPlane::new(policy, relative_tolerance);
        self.run(&self.fine, start, solver, max_iterations)
    }

    /// All pairs within reach alike, from where the fine round ended.
    fn uniform_round<M: Motion>(&self, start: Run<M>, reach: f64, max_iterations: usize) -> Run<M> {
        let solver = PointToPlane::new(Policy { reach, ..Policy::all(0.0) }, self.options.relative_tolerance);
        let run = self.run(&self.fine, start.pose, solver, max_iterations);
        Run { iterations: start.iterations + run.iterations, ..run }
    }

    /// One after the other; `done` is called after each of the [`ROUNDS`].
    pub(crate) fn all_rounds<M: Motion>(
        &self,
        start: M,
        reach: f64,
        max_iterations: usize,
        done: impl Fn(),
    ) -> Run<M> {
        let coarse = self.coarse_round(start, reach, max_iterations.div_ceil(2));
        done();
        let fine = self.fine_round(coarse.pose, reach, max_iterations - coarse.iterations);
        done();
        let fine = Run { iterations: coarse.iterations + fine.iterations, ..fine };
        let last = match self.options.uniform_reach {
            Some(reach) => self.uniform_round(fine, reach, max_iterations),
            None => fine,
        };
        done();
        last
    }

    fn run<M: Motion>(&self, samples: &[Sample], start: M, solver: PointToPlane, most: usize) -> Run<M> {
        let problem = Correspondences { reference: self.reference, samples };
        let configure = |state: PoseState<M>| state.param(start).max_iters(most as u64);
        // The solver has no way to fail; staying at the start is what a failure would mean.
        let result = Executor::new(problem, solver).configure(configure).run().ok();
        let mut run = Run { pose: start, iterations: 0, converged: false };
        if let Some(state) = result.as_ref().map(|r| r.state()) {
            run.pose = state.get_param().copied().unwrap_or(start);
            run.iterations = state.get_iter() as usize;
            run.converged =
                matches!(state.get_termination_reason(), Some(TerminationReason::SolverConverged));
        }
        run
    }
}

/// What argmin carries from iteration to iteration: a pose and its cost, no derivatives.
type PoseState<M> = IterState<M, (), (), (), (), f64>;

/// The problem: a surface to lie on and samples that should.
struct Correspondences<'a> {
    reference: &'a Shape,
    samples: &'a [Sample],
}

/// The solver: an ICP step an iteration.
struct PointToPlane {
    /// Its floor is halved by each step.
    policy: Policy,
    /// Length of the last step, in standard errors.
    tolerance: f64,
    /// Faces of the last closest points, where the next search starts.
    faces: Vec<u32>,
    /// Whether the last step was small enough.
    settled: bool,
}

impl PointToPlane {
    fn new(policy: Policy, tolerance: f64) -> Self {
        Self { policy, tolerance, faces: Vec::new(), settled: false }
    }

    /// The pose after one step from `pose`, and the weighted mean square residual before it.
    fn advance<M: Motion>(&mut self, problem: &Correspondences, pose: &M) -> (M, f64) {
        let pairs = pairs::find(problem.reference, problem.samples, &pose.map(), &mut self.faces);
        let Weights { values, floored } = self.policy.weights(&pairs);
        let change = M::step(&pairs, &values);
        let cost = mean_square_residual(&pairs, &values);
        let motion = root_mean_square_motion(&pairs, &change.map());
        let standard_error = (cost / pairs.len().max(1) as f64).sqrt();
        self.settled = motion <= SMALLEST_STEP || !floored && motion <= self.tolerance * standard_error;
        self.policy.floor /= 2.0;
        (change.after(pose), cost)
    }
}

/// Infinite when no pair has weight.
fn mean_square_residual(pairs: &[Pair], weights: &[f64]) -> f64 {
    let total: f64 = weights.iter().sum();
    let squares: f64 = pairs.iter().zip(weights).map(|(p, w)| w * p.residual().powi(2)).sum();
    if total > 0.0 { squares / total } else { f64::INFINITY }
}

fn root_mean_square_motion(pairs: &[Pair], change: &AffineMap) -> f64 {
    let squares: f64 = pairs.iter().map(|pair| (change.point(&pair.p) - pair.p).norm_squared()).sum();
    (squares / pairs.len().max(1) as f64).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Vector3};
    use proptest::prelude::*;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    /// Turned by `degrees` about an axis through the centre, shifted by 3 % of the size, 5 % larger.
    fn rough(soup: &Soup, axis: Vector3<f64>, degrees: f64) -> Similarity3<f64> {
        let bounds = soup.bounding_box().unwrap();
        let centre = Translation3::from(nalgebra::center(&bounds.min, &bounds.max).coords);
        let shift = axis.yzx().normalize() * (0.03 * bounds.largest_side());
        let turn = axis.normalize() * degrees.to_radians();
        centre * Similarity3::new(shift, turn, 1.05) * centre.inverse()
    }

    /// Without the triangles that reach into the right third.
    fn cropped(soup: &Soup) -> Soup {
        let bounds = soup.bounding_box().unwrap();
        let limit = bounds.max.x - bounds.sides().x / 3.0;
        let keeps = |t: &[u32; 3]| t.iter().all(|&v| soup.points[v as usize].x <= limit);
        Soup::new(soup.points.clone(), soup.triangles.iter().copied().filter(keeps).collect())
    }

    fn largest_error(soup: &Soup, found: &Similarity3<f64>) -> f64 {
        let side = soup.bounding_box().unwrap().largest_side();
        soup.points.iter().map(|p| (found * p - p).norm()).fold(0.0, f64::max) / side
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn a_cropped_suspect_finds_its_place(
            soup in prop::sample::select(vec![shapes::part(3), shapes::bust(16), shapes::bumpy_sphere(1500)]),
            axis in prop::array::uniform3(0.1..1.0_f64),
            degrees in -10.0..10.0_f64,
        ) {
            let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
            let suspect = cropped(&soup);
            let start = rough(&soup, Vector3::from(axis), degrees);
            let found =
                align(&reference, &suspect.points, &suspect.triangles, &start, &IcpOptions::default()).unwrap();
            prop_assert!(found.converged);
            prop_assert!(found.overlap < 0.85 && found.suspect_overlap > 0.98);
            prop_assert!(largest_error(&soup, &found.reference_from_suspect) < 1e-9);
        }
    }

    #[test]
    fn added_geometry_does_not_pull() {
        let soup = shapes::bumpy_sphere(1500);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let mut suspect = soup.clone();
        let first = suspect.points.len() as u32;
        let sheet = shapes::open_sheet(10, 10);
        suspect.points.extend(sheet.points.iter().map(|p| p - Vector3::new(0.75, 0.5, 1.6)));
        suspect.triangles.extend(sheet.triangles.iter().map(|t| t.map(|v| v + first)));
        let start = rough(&soup, Vector3::new(1.0, 2.0, -1.0), 5.0);
        let found =
            align(&reference, &suspect.points, &suspect.triangles, &start, &IcpOptions::default()).unwrap();
        assert!(largest_error(&soup, &found.reference_from_suspect) < 1e-9);
        assert!(found.suspect_overlap < 0.95 && found.overlap > 0.99);
    }

    #[test]
    fn running_out_is_told() {
        let soup = shapes::part(1);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let start = rough(&soup, Vector3::x(), 8.0);
        let options = IcpOptions { max_iterations: 1, uniform_reach: None, ..IcpOptions::default() };
        let found = align(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
        assert!(!found.converged && found.iterations == 1);
    }

    #[test]
    fn options_are_checked() {
        let soup = shapes::part(1);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        for options in [
            IcpOptions { samples: 0, ..IcpOptions::default() },
            IcpOptions { relative_tolerance: f64::NAN, ..IcpOptions::default() },
            IcpOptions { rejection: Some(0.5), ..IcpOptions::default() },
            IcpOptions { tukey: Some(-1.0), ..IcpOptions::default() },
        ] {
            let answer = align(&reference, &soup.points, &soup.triangles, &Similarity3::identity(), &options);
            assert!(matches!(answer, Err(RegistrationError::Option { .. })), "{options:?}");
        }
    }
}
