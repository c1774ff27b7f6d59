//! From starts to poses: a quick refinement of each, the fit as the measure, the best few refined in full.

use nalgebra::Similarity3;
use rayon::prelude::*;

use crate::candidate::{Candidate, comparable};
use crate::options::RegisterOptions;
use crate::refinement::icp::{Icp, ROUNDS};
use crate::refinement::motion::Motion;
use crate::refinement::optimizer::Run;
use crate::surface::shape::Shape;
use crate::verdict::fit::FitMeasure;
use crate::verdict::trust::{is_hopeless, is_nearly_trusted, is_promising, is_trusted};
use sombrero_progress::Progress;

/// Iterations that each start gets before it is measured.
const TRIAL_ITERATIONS: usize = 15;
/// Poses refined in full at most.
pub(crate) const REFINED: usize = 8;
/// Candidates that are asked whether more steps lead on.
const LEADING: usize = 4;
/// A shape with no more poses than so many is not asked whether it goes onto itself.
const ONE_POSE: usize = 4;
/// How far from its counterpart a sample may be in a pose that is refined in full.
const REFINED_REACH: f64 = 0.1;
/// A score up to this ends the search: nine tenths of both surfaces agree.
pub(crate) const GOOD: f64 = 0.1;
/// Difference in score by which a start is not worth a trial, when another one is good as it is.
const HOPELESS: f64 = 0.3;
/// Poses whose points are closer than this on average are the same, in units of the diagonal.
const SAME: f64 = 0.01;

/// How far from its counterpart a sample may be in a pose by landmarks, in units of the diagonal.
pub(crate) const HYPOTHESIS_REACH: f64 = 0.05;

/// What the matching of landmarks counts in [`Progress`], where a trial counts 1.
pub(crate) const MATCHING: usize = 60;
/// What the full refinement of all candidates counts.
pub(crate) const REFINING: usize = 60;
/// What a look at the symmetries counts.
pub(crate) const SYMMETRIES: usize = 20;

/// One suspect and its reference.
pub(crate) struct Search<'a> {
    pub(crate) reference: &'a Shape,
    pub(crate) suspect: &'a Shape,
    options: &'a RegisterOptions,
    icp: Icp<'a>,
    /// Steps of about one trial's time. What will have to be tried is not known beforehand: there is room for all that
    /// may be, and what was not needed counts as done.
    pub(crate) progress: Progress,
}

impl<'a> Search<'a> {
    pub(crate) fn new(
        reference: &'a Shape,
        suspect: &'a Shape,
        options: &'a RegisterOptions,
        progress: Progress,
    ) -> Self {
        Self { reference, suspect, options, icp: Icp::new(reference, suspect, &options.icp), progress }
    }

    /// Each start after a coarse round, best first, without repetitions.
    /// Samples farther than `reach` from the reference do not count.
    pub(crate) fn tried<M: Motion>(&self, starts: Vec<M>, reach: f64) -> Vec<Candidate<M>> {
        let measure = FitMeasure::coarse(self.reference, self.suspect);
        let most = TRIAL_ITERATIONS.min(self.options.icp.max_iterations);
        let trial = |start: M| {
            let run = self.icp.trial_round(start, reach, most);
            let fit = measure.of(&run.pose.map());
            self.progress.advance(1);
            Candidate { run, fit }
        };
        let count = starts.len();
        let hopeful = hopeful(&measure, starts);
        self.progress.advance(count - hopeful.len());
        self.sorted(hopeful.into_par_iter().map(trial).collect())
    }

    /// What a search without a hint ends with.
    ///
    /// Of a shape that goes onto itself in more ways than are asked for, one pose is refined: the others are its images.
    pub(crate) fn concluded<M: Motion>(
        &self,
        candidates: Vec<Candidate<M>>,
        symmetries: impl FnOnce() -> &'a [Similarity3<f64>],
    ) -> Vec<Candidate<M>> {
        let Some(best) = candidates.first().filter(|_| candidates.iter().any(|c| is_promising(&c.fit)))
        else {
            return self.given_up(&candidates);
        };
        let sure = best.fit.score <= GOOD;
        if !sure && !is_trusted(&best.fit) && !self.leads_on(&candidates) {
            return self.given_up(&candidates);
        }
        let more_than_asked = || symmetries().len() > self.options.max_alternatives;
        let one = sure && candidates.len() > ONE_POSE && more_than_asked();
        self.refined(candidates, if one { 1 } else { REFINED })
    }

    /// Whether one of the best promising candidates is about to be trusted after as many steps on few samples as it takes: shapes
    /// made of the same large planes promise, and would be refined for long to come to nothing.
    fn leads_on<M: Motion>(&self, candidates: &[Candidate<M>]) -> bool {
        let promising = candidates.iter().filter(|c| is_promising(&c.fit)).take(LEADING);
        let poses: Vec<M> = promising.map(|c| c.run.pose).collect();
        let measure = FitMeasure::coarse(self.reference, self.suspect);
        let leads = |pose: &M| {
            let run = self.icp.coarse_round(*pose, REFINED_REACH, self.options.icp.max_iterations);
            is_nearly_trusted(&measure.of(&run.pose.map()))
        };
        poses.par_iter().any(leads)
    }

    /// Refines those that may yet turn out best; the answer has the best first, and those that the fit cannot
    /// tell from it. `most` are refined.
    pub(crate) fn refined<M: Motion>(
        &self,
        mut candidates: Vec<Candidate<M>>,
        most: usize,
    ) -> Vec<Candidate<M>> {
        candidates = comparable(candidates);
        candidates.truncate(most.min(REFINED));
        self.progress.at_most_left(REFINING + SYMMETRIES);
        let round = REFINING / (candidates.len().max(1) * ROUNDS);
        let measure = self.fine_measure();
        let refine = |candidate: Candidate<M>| {
            let left = self.options.icp.max_iterations.saturating_sub(candidate.run.iterations);
            let mut run =
                self.icp.all_rounds(candidate.run.pose, REFINED_REACH, left, || self.progress.advance(round));
            run.iterations += candidate.run.iterations;
            Candidate { run, fit: measure.of(&run.pose.map()) }
        };
        comparable(self.sorted(candidates.into_par_iter().map(refine).collect()))
    }

    /// The best of candidates that cannot be trusted, after some more steps where these may yet change that: a full refinement
    /// would take long to find nothing.
    pub(crate) fn given_up<M: Motion>(&self, candidates: &[Candidate<M>]) -> Vec<Candidate<M>> {
        let finish = |candidate: &Candidate<M>| {
            if is_hopeless(&candidate.fit) {
                return *candidate;
            }
            let pose = candidate.run.pose;
            let mut run = self.icp.coarse_round(pose, REFINED_REACH, self.options.icp.max_iterations);
            run.iterations += candidate.run.iterations;
            Candidate { run, fit: self.fine_measure().of(&run.pose.map()) }
        };
        candidates.first().map(finish).into_iter().collect()
    }

    /// Few samples, but steps until nothing moves any more; of more than `most` starts, as those of a ball are, few steps: which of
    /// endlessly many poses they end in does not matter, and none of them would come to rest.
    pub(crate) fn settled<M: Motion>(&self, starts: Vec<M>, most: usize) -> Vec<Candidate<M>> {
        let measure = FitMeasure::coarse(self.reference, self.suspect);
        let endless = starts.len() > most;
        let settle = |start: M| {
            let run = match endless {
                true => self.icp.trial_round(start, REFINED_REACH, TRIAL_ITERATIONS),
                false => self.icp.coarse_round(start, REFINED_REACH, self.options.icp.max_iterations),
            };
            Candidate { run, fit: measure.of(&run.pose.map()) }
        };
        starts.into_par_iter().map(settle).collect()
    }

    /// The candidates with the images of the best one under the symmetries of the reference, as far as there is room.
    pub(crate) fn with_symmetries<M: Motion>(
        &self,
        mut candidates: Vec<Candidate<M>>,
        symmetries: impl FnOnce() -> &'a [Similarity3<f64>],
    ) -> Vec<Candidate<M>> {
        self.progress.at_most_left(SYMMETRIES);
        let Some(&best) = candidates.first() else { return candidates };
        // Finding them takes time, which nothing but a right pose is worth.
        let symmetries = if is_trusted(&best.fit) { symmetries() } else { &[] };
        if symmetries.is_empty() {
            return candidates;
        }
        let measure = self.fine_measure();
        let image = |symmetry: &Similarity3<f64>| {
            let pose = M::of(symmetry).after(&best.run.pose);
            Candidate { run: Run { pose, ..best.run }, fit: measure.of(&pose.map()) }
        };
        let room = symmetries.len().min(self.options.max_alternatives);
        candidates.extend(symmetries[..room].par_iter().map(image).collect::<Vec<_>>());
        comparable(self.sorted(candidates))
    }

    /// Whether two poses put the suspect to different places.
    pub(crate) fn is_other<M: Motion>(&self, a: &M, b: &M) -> bool {
        self.apart(a, b) > SAME
    }

    fn fine_measure(&self) -> FitMeasure<'a> {
        FitMeasure::fine(self.reference, self.suspect, self.options.icp.samples)
    }

    /// Best first; of candidates in the same place, the best.
    pub(crate) fn sorted<M: Motion>(&self, mut candidates: Vec<Candidate<M>>) -> Vec<Candidate<M>> {
        candidates.sort_by(|a, b| a.fit.score.total_cmp(&b.fit.score));
        let mut kept: Vec<Candidate<M>> = Vec::new();
        for candidate in candidates {
            if kept.iter().all(|k| self.is_other(&k.run.pose, &candidate.run.pose)) {
                kept.push(candidate);
            }
        }
        kept
    }

    /// Root mean square distance between the suspect in two poses.
    fn apart<M: Motion>(&self, a: &M, b: &M) -> f64 {
        let (a, b) = (a.map(), b.map());
        let samples = self.icp.coarse.iter().step_by(16);
        let count = samples.len().max(1) as f64;
        let squared = |p| (a.point(p) - b.point(p)).norm_squared();
        (samples.map(|s| squared(&s.point)).sum::<f64>() / count).sqrt()
    }
}

/// The starts that are worth a trial: all of them, unless one fits so well that others need not be asked.
fn hopeful<M: Motion>(measure: &FitMeasure, starts: Vec<M>) -> Vec<M> {
    let scores: Vec<f64> = starts.par_iter().map(|start| measure.of(&start.map()).score).collect();
    let best = scores.iter().copied().fold(1.0, f64::min);
    let limit = if best <= GOOD { best + HOPELESS } else { f64::INFINITY };
    starts.into_iter().zip(scores).filter(|(_, score)| *score <= limit).map(|(start, _)| start).collect()
}
