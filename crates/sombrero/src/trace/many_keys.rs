//! The examiner for many keys: each is tested alone, and beside those that the others show.

use crate::detect::DetectError;
use nalgebra::Affine3;
use rayon::prelude::*;
use sombrero_extraction::Estimate;
use sombrero_search::{Examiner, Hypothesis, Stages};
use sombrero_stats::{KeyTests, LogProbability, accuse};

/// The best test of one key so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Score {
    pub(super) p: LogProbability,
    pub(super) correlation: f64,
    pub(super) beside_others: bool,
}

/// Looks for many watermarks at once.
#[derive(Clone)]
pub(super) struct ManyKeys<'a> {
    watermarks: Vec<&'a [f64]>,
    /// One for each watermark.
    pub(super) scores: Vec<Score>,
    /// The best p of all, and the estimate in which it was.
    pub(super) best: LogProbability,
    pub(super) clearest: Option<(Estimate, Option<Affine3<f64>>)>,
}

impl<'a> ManyKeys<'a> {
    pub(super) fn new(watermarks: Vec<&'a [f64]>) -> Self {
        let none = Score { p: LogProbability::ONE, correlation: 0.0, beside_others: false };
        let scores = vec![none; watermarks.len()];
        Self { watermarks, scores, best: LogProbability::ONE, clearest: None }
    }
}

impl Examiner for ManyKeys<'_> {
    type Error = DetectError;
    /// Those of one key, and one beside the others.
    const TESTS: usize = KeyTests::COUNT + 1;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError> {
        let scores = seconds.time("tests", || {
            let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)?;
            let alone = |w: &&[f64]| {
                let compared = tests.compare(w)?;
                let correlation = compared.correlation;
                Ok::<_, DetectError>(Score { p: compared.best(), correlation, beside_others: false })
            };
            let mut scores = self.watermarks.par_iter().map(alone).collect::<Result<Vec<_>, _>>()?;
            let beside = accuse(&self.watermarks, tests.ellipsoid())?;
            for (score, p) in scores.iter_mut().zip(beside) {
                if p < score.p {
                    *score = Score { p, beside_others: true, ..*score };
                }
            }
            Ok::<_, DetectError>(scores)
        })?;
        let best = scores.iter().map(|score| score.p).fold(LogProbability::ONE, smaller);
        if self.clearest.is_none() || best < self.best {
            (self.best, self.clearest) = (best, Some((estimate.clone(), hypothesis.pose)));
        }
        for (known, score) in self.scores.iter_mut().zip(scores) {
            if score.p < known.p {
                *known = score;
            }
        }
        Ok(())
    }

    /// Of the watermark that suits best.
    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> Result<LogProbability, DetectError> {
        let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)?;
        let alone = |w: &&[f64]| {
            let own: Vec<f64> = functions.iter().map(|&i| w[i]).collect();
            Ok::<_, DetectError>(tests.compare(&own)?.best())
        };
        let all = self.watermarks.par_iter().map(alone).collect::<Result<Vec<_>, _>>()?;
        Ok(all.into_iter().fold(LogProbability::ONE, smaller))
    }

    fn best(&self) -> Option<LogProbability> {
        self.clearest.as_ref().map(|_| self.best)
    }

    fn watermarks(&self) -> usize {
        self.watermarks.len()
    }
}

fn smaller(a: LogProbability, b: LogProbability) -> LogProbability {
    if b < a { b } else { a }
}
