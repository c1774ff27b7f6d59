//! One round's minimisation by argmin's nonlinear conjugate gradient.
//!
//! The variables are x_j = √h_j v_j*, where h_j is about the second derivative of E by v_j*: in them a
//! vertex that many samples hold and one that only springs hold are equally stiff, and the line search,
//! which always tries the step 1 first, finds it of the right size.
//!
//! The best point is kept outside of the solver, since a line search that can improve nothing more ends in
//! an error, and conjugate gradient has no stopping rule but the number of iterations: it is wrapped.

use std::cell::RefCell;

use argmin::core::{
    CostFunction, Error, Executor, Gradient, IterState, KV, Problem, Solver, State, TerminationReason,
    TerminationStatus,
};
use argmin::solver::conjugategradient::NonlinearConjugateGradient;
use argmin::solver::conjugategradient::beta::PolakRibierePlus;
use argmin::solver::linesearch::MoreThuenteLineSearch;
use nalgebra::Vector3;

use crate::energy::Energy;
use crate::field::Field;

/// Evaluations allowed for each iteration, on average: two or three are usual, but a search along the edge of
/// a turning face may take any number.
const EVALUATIONS: usize = 5;

/// Sufficient decrease and curvature of the line search. With a curvature of 0.1 it takes more evaluations and
/// gains nothing; with 0.8 the fit of a large mesh ends up a little worse.
const WOLFE: (f64, f64) = (1e-4, 0.4);

/// An iteration that lowers the energy by less than this fraction is the last one of its round.
const DECREASE: f64 = 1e-5;

/// Moves `points` downhill, for `iterations` at most; returns how many it took. `say` is told how many are over.
pub(crate) fn minimise(
    energy: &Energy<'_>,
    points: &mut [Vector3<f64>],
    iterations: usize,
    say: impl Fn(usize),
) -> usize {
    let roots: Vec<f64> = energy.curvatures().into_iter().map(f64::sqrt).collect();
    let start = points.iter().zip(&roots).flat_map(|(p, r)| [p.x * r, p.y * r, p.z * r]).collect();
    let memory = RefCell::new(Memory::new(Field(start), EVALUATIONS * iterations));
    loop {
        let before = memory.borrow().best_cost;
        let left = iterations - memory.borrow().iterations;
        // An error says that the line search found no way down; what was found before is in the memory.
        let _ = run(Objective { energy, roots: &roots, memory: &memory }, left, &say);
        let memory = memory.borrow();
        // From the best point, straight downhill, there may be a way where the conjugate direction had none.
        let settled = memory.best_cost >= (1.0 - DECREASE) * before;
        if settled || memory.iterations >= iterations || memory.evaluations >= memory.budget {
            break;
        }
    }
    let memory = memory.into_inner();
    unscale(&memory.best.0, &roots, points);
    memory.iterations
}

fn run(objective: Objective<'_>, iterations: usize, say: &dyn Fn(usize)) -> Result<(), Error> {
    let search = MoreThuenteLineSearch::new().with_c(WOLFE.0, WOLFE.1)?;
    let memory = objective.memory;
    let start = memory.borrow().best.clone();
    let inner = NonlinearConjugateGradient::new(search, PolakRibierePlus::new());
    let solver = Settling { inner, memory, previous: f64::INFINITY, say };
    let configured =
        |state: IterState<Field, Field, (), (), (), f64>| state.param(start).max_iters(iterations as u64);
    Executor::new(objective, solver).configure(configured).timer(false).run()?;
    Ok(())
}

fn unscale(x: &[f64], roots: &[f64], points: &mut [Vector3<f64>]) {
    for ((p, x), r) in points.iter_mut().zip(x.as_chunks::<3>().0).zip(roots) {
        *p = Vector3::from(*x) / *r;
    }
}

/// What outlives the solver.
struct Memory {
    best: Field,
    best_cost: f64,
    /// The last point, with its value and gradient: argmin asks for them one by one and repeatedly.
    last: Field,
    cost: f64,
    gradient: Field,
    evaluations: usize,
    /// Evaluations allowed.
    budget: usize,
    iterations: usize,
    /// Room to compute in.
    points: Vec<Vector3<f64>>,
    slopes: Vec<Vector3<f64>>,
}

impl Memory {
    fn new(start: Field, budget: usize) -> Self {
        let zeros = vec![Vector3::zeros(); start.0.len() / 3];
        Self {
            best: start,
            best_cost: f64::INFINITY,
            last: Field::default(),
            cost: f64::INFINITY,
            gradient: Field::default(),
            evaluations: 0,
            budget,
            iterations: 0,
            points: zeros.clone(),
            slopes: zeros,
        }
    }
}

struct Objective<'a> {
    energy: &'a Energy<'a>,
    /// √h.
    roots: &'a [f64],
    memory: &'a RefCell<Memory>,
}

impl Objective<'_> {
    fn visit(&self, x: &Field) -> Result<(), Error> {
        let mut guard = self.memory.borrow_mut();
        let memory = &mut *guard;
        if memory.last == *x {
            return Ok(());
        }
        if memory.evaluations >= memory.budget {
            return Err(Error::msg("no more evaluations"));
        }
        memory.evaluations += 1;
        unscale(&x.0, self.roots, &mut memory.points);
        memory.cost = self.energy.evaluate(&memory.points, &mut memory.slopes).total();
        memory.gradient.0.clear();
        let scaled = memory.slopes.iter().zip(self.roots).flat_map(|(g, r)| [g.x / r, g.y / r, g.z / r]);
        memory.gradient.0.extend(scaled);
        memory.last.clone_from(x);
        // A comparison with NaN is false.
        if memory.cost < memory.best_cost {
            memory.best_cost = memory.cost;
            memory.best.clone_from(&memory.last);
        }
        Ok(())
    }
}

impl CostFunction for Objective<'_> {
    type Param = Field;
    type Output = f64;

    fn cost(&self, x: &Field) -> Result<f64, Error> {
        self.visit(x)?;
        Ok(self.memory.borrow().cost)
    }
}

impl Gradient for Objective<'_> {
    type Param = Field;
    type Gradient = Field;

    fn gradient(&self, x: &Field) -> Result<Field, Error> {
        self.visit(x)?;
        Ok(self.memory.borrow().gradient.clone())
    }
}

/// A solver that stops when the energy hardly falls.
struct Settling<'a, S> {
    inner: S,
    memory: &'a RefCell<Memory>,
    previous: f64,
    say: &'a dyn Fn(usize),
}

impl<O, I: State<Float = f64>, S: Solver<O, I>> Solver<O, I> for Settling<'_, S> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        self.inner.init(problem, state)
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        let before = self.memory.borrow().iterations;
        (self.say)(before);
        self.memory.borrow_mut().iterations = before + 1;
        self.inner.next_iter(problem, state)
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        let cost = state.get_cost();
        let settled = self.previous - cost <= DECREASE * cost;
        self.previous = cost;
        if settled {
            return TerminationStatus::Terminated(TerminationReason::SolverConverged);
        }
        self.inner.terminate(state)
    }
}
