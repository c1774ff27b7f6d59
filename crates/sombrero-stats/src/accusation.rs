//! Which of many watermarks are in w*, when several may be at once: copies that were averaged.
//!
//! The mean of c copies carries Σ wᵢ / c, so that each of the c watermarks correlates with it by about 1/√c, and the
//! others are noise to it. What is known of the others can be taken away: with S, a set of other watermarks,
//!
//! ```text
//! r(v) = v - the part of v in the span of 1 and the w of S     (least squares)
//! ρ = r(w*) · r(wᵢ) / (|r(w*)| |r(wᵢ)|)                        (the partial correlation)
//! p = Pr[T ≥ ρ √(ν / (1 - ρ²))],   ν = k - 2 - |S|            (k coefficients)
//! ```
//!
//! S is chosen by forward selection among the watermarks *other than wᵢ*: the one of largest partial correlation, over
//! and over, up to the last step that is better than chance. So S is a function of w* and the others alone. Under the
//! null hypothesis, that wᵢ had no part in w*, wᵢ is Gaussian and independent of both; then r(wᵢ) has a uniform
//! direction in its subspace, and p is exact, whatever the others did, however S was chosen. Choosing S with wᵢ among
//! the candidates would break that. p is for one watermark: who looks at n of them multiplies by n.
//!
//! Cost: |S| + 7 passes over the n × k numbers, and as many again for each member of S.

use crate::{Correlation, LogProbability, best_of, correlation_tail};

/// So many watermarks are taken away at most.
const MOST: usize = 32;

/// A step of the selection counts when its p, times the number of candidates, is below this.
const CHANCE: f64 = 0.05;

/// The selection ends after so many steps in a row that do not count: the first ones may be weak, as each
/// watermark is noise to the others.
const PATIENCE: usize = 6;

/// What is left of a vector's squared length when nothing but rounding is.
const ROUNDING: f64 = 1e-24;

/// Degrees of freedom that a test should keep.
const FEWEST_DEGREES: usize = 4;

/// For each of `watermarks`, the probability that an unrelated one would fit as well what `extracted` shows beyond the
/// others. Probabilities are of each alone.
///
/// Coefficients that could not be extracted (`None`, or not finite) or exceed `limit` (in standard deviations of the
/// inserted ones; the paper drops those beyond 2.5) are left out, for all watermarks alike. Where there is nothing to
/// compare, p = 1.
///
/// ```
/// use sombrero_stats::accuse;
///
/// // Ten watermarks; the mean of the first two turns up.
/// let watermark = |i: u32| (0..40).map(|j| f64::from((i * 7919 + j * 104_729 + i * i * j) % 1009) / 291.0 - 1.73).collect();
/// let watermarks: Vec<Vec<f64>> = (1..=10).map(watermark).collect();
/// let mean: Vec<Option<f64>> = (0..40).map(|j| Some((watermarks[0][j] + watermarks[1][j]) / 2.0)).collect();
///
/// let slices: Vec<&[f64]> = watermarks.iter().map(Vec::as_slice).collect();
/// let p = accuse(&slices, &mean, 2.5);
/// assert!(p[0].log10() < -100.0 && p[1].log10() < -100.0);
/// assert!(p[2..].iter().all(|p| p.log10() > -4.0));
/// ```
///
/// # Panics
/// When a watermark is not as long as `extracted`.
pub fn accuse(watermarks: &[&[f64]], extracted: &[Option<f64>], limit: f64) -> Vec<LogProbability> {
    let kept: Vec<(usize, f64)> = extracted
        .iter()
        .enumerate()
        .filter_map(|(i, e)| e.filter(|e| e.abs() <= limit).map(|e| (i, e)))
        .collect();
    let found: Vec<f64> = kept.iter().map(|(_, e)| *e).collect();
    let pick = |w: &&[f64]| {
        assert_eq!(w.len(), extracted.len(), "a watermark has as many coefficients as were extracted");
        kept.iter().map(|(i, _)| w[*i]).collect()
    };
    let start = Residuals::new(found, watermarks.iter().map(pick).collect());

    let chosen = start.clone().select(None);
    let mut after = start.clone();
    chosen.iter().for_each(|&i| after.take_away(i));
    let mut p: Vec<LogProbability> = (0..watermarks.len()).map(|i| after.p(i)).collect();
    for &i in &chosen {
        let mut others = start.clone();
        let chosen = others.clone().select(Some(i));
        chosen.iter().for_each(|&j| others.take_away(j));
        p[i] = others.p(i);
    }
    p
}

/// w* and all watermarks without their parts in the span of 1 and of what was taken away.
#[derive(Clone)]
struct Residuals {
    found: Residual,
    watermarks: Vec<Residual>,
    /// Which are taken away, in order.
    away: Vec<usize>,
}

impl Residuals {
    fn new(found: Vec<f64>, watermarks: Vec<Vec<f64>>) -> Self {
        let ones = vec![1.0; found.len()];
        let watermarks = watermarks.into_iter().map(Residual::new).collect();
        let mut residuals = Self { found: Residual::new(found), watermarks, away: Vec::new() };
        residuals.remove(&ones);
        residuals
    }

    /// Forward selection among all but `left_out`, up to the last step that counts.
    fn select(mut self, left_out: Option<usize>) -> Vec<usize> {
        let (mut counted, mut idle) = (0, 0);
        while self.away.len() < MOST && self.degrees() > FEWEST_DEGREES && idle < PATIENCE {
            let candidates =
                (0..self.watermarks.len()).filter(|i| Some(*i) != left_out && !self.away.contains(i));
            let best = candidates.filter_map(|i| Some((i, self.rho(i)?))).max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((best, _)) = best else { break };
            let counts = best_of(self.p(best), self.watermarks.len()).p() < CHANCE;
            self.take_away(best);
            if counts {
                (counted, idle) = (self.away.len(), 0);
            } else {
                idle += 1;
            }
        }
        self.away.truncate(counted);
        self.away
    }

    fn take_away(&mut self, index: usize) {
        let direction = self.watermarks[index].rest.clone();
        self.remove(&direction);
        self.away.push(index);
    }

    /// Makes everything orthogonal to `direction`.
    fn remove(&mut self, direction: &[f64]) {
        let square = dot(direction, direction);
        if square == 0.0 {
            return;
        }
        for Residual { rest, .. } in std::iter::once(&mut self.found).chain(&mut self.watermarks) {
            let share = dot(rest, direction) / square;
            rest.iter_mut().zip(direction).for_each(|(x, d)| *x -= share * d);
        }
    }

    /// ν, or 0.
    fn degrees(&self) -> usize {
        self.found.rest.len().saturating_sub(2 + self.away.len())
    }

    /// The partial correlation; none where nothing is left to correlate.
    fn rho(&self, index: usize) -> Option<f64> {
        let w = &self.watermarks[index];
        let lengths = (w.square_or_zero() * self.found.square_or_zero()).sqrt();
        let rho = dot(&w.rest, &self.found.rest) / lengths;
        rho.is_finite().then(|| rho.clamp(-1.0, 1.0))
    }

    fn p(&self, index: usize) -> LogProbability {
        let degrees = self.degrees();
        let rho = self.rho(index).filter(|_| degrees > 0);
        let correlation = rho.and_then(|rho| Correlation::from_rho(rho, degrees + 2).ok());
        correlation.map_or(LogProbability::ONE, |c| correlation_tail(&c))
    }
}

/// A vector of which parts were taken away.
#[derive(Clone)]
struct Residual {
    rest: Vec<f64>,
    /// Its squared length when it was whole.
    square: f64,
}

impl Residual {
    fn new(whole: Vec<f64>) -> Self {
        Self { square: dot(&whole, &whole), rest: whole }
    }

    /// The squared length that is left. Two copies of one watermark leave rounding errors of each other, which are
    /// no evidence.
    fn square_or_zero(&self) -> f64 {
        let square = dot(&self.rest, &self.rest);
        if square > ROUNDING * self.square { square } else { 0.0 }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wilson_interval;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn watermarks(count: usize, m: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample_iter(&mut rng).take(m).collect()).collect()
    }

    /// The mean of the first `leakers`, and some noise.
    fn mixed(all: &[Vec<f64>], leakers: usize, noise: f64) -> Vec<Option<f64>> {
        let noisy = &all[all.len() - 1];
        let at = |j: usize| all[..leakers].iter().map(|w| w[j]).sum::<f64>() / leakers as f64;
        (0..noisy.len()).map(|j| Some(at(j) + noise * noisy[j])).collect()
    }

    fn accused(all: &[Vec<f64>], extracted: &[Option<f64>]) -> Vec<f64> {
        let candidates: Vec<&[f64]> = all[..all.len() - 1].iter().map(Vec::as_slice).collect();
        accuse(&candidates, extracted, 2.5).iter().map(|p| p.log10()).collect()
    }

    /// Correlation alone gives each of ten p = 1e-5 or so, of which a thousand candidates leave nothing.
    #[test]
    fn ten_of_a_thousand_are_told_from_the_innocent() {
        for leakers in [1, 2, 3, 5, 10] {
            let all = watermarks(1001, 200, 7);
            let p = accused(&all, &mixed(&all, leakers, 0.02));
            let (guilty, innocent) = p.split_at(leakers);
            assert!(guilty.iter().all(|p| *p < -50.0), "{leakers}: {guilty:?}");
            assert!(innocent.iter().all(|p| *p > -6.0), "{leakers}");
        }
    }

    /// What p promises, in the worst case that is known: the candidate is compared beside leakers who are found, and
    /// coefficients are few.
    #[test]
    fn the_innocent_score_p_as_often_as_p_says() {
        const TRIALS: usize = 4000;
        let p: Vec<f64> = (0..TRIALS)
            .map(|trial| {
                let all = watermarks(8, 20, trial as u64);
                let p = accused(&all, &mixed(&all, 3, 0.3));
                // Any fixed innocent; here the last one.
                10_f64.powf(p[6])
            })
            .collect();
        for nominal in [0.5, 0.1, 0.01] {
            let hits = p.iter().filter(|p| **p <= nominal).count();
            let interval = wilson_interval(hits, TRIALS, 0.999).unwrap();
            assert!(interval.contains(nominal), "{hits} of {TRIALS} at {nominal}: {interval:?}");
        }
    }

    #[test]
    fn copies_of_a_watermark_are_no_evidence_against_each_other() {
        let mut all = watermarks(6, 50, 3);
        all[1] = all[0].clone();
        let p = accused(&all, &mixed(&all, 1, 0.0));
        assert_eq!(p[..2], [0.0, 0.0]);
    }

    #[test]
    fn nothing_to_compare_is_no_evidence() {
        let w = [0.3, -1.0, 0.8, 1.5];
        for extracted in [vec![None; 4], vec![Some(9.0); 4], vec![Some(0.5); 4], vec![Some(f64::NAN); 4]] {
            assert_eq!(accuse(&[&w, &w], &extracted, 2.5), [LogProbability::ONE; 2], "{extracted:?}");
        }
        assert_eq!(accuse(&[], &[Some(1.0)], 2.5), []);
        assert_eq!(accuse(&[&[]], &[], 2.5), [LogProbability::ONE]);
    }

    proptest! {
        #[test]
        fn the_order_of_candidates_does_not_matter(seed in any::<u64>(), leakers in 1..5_usize) {
            let all = watermarks(12, 40, seed);
            let extracted = mixed(&all, leakers, 0.1);
            let p = accused(&all, &extracted);
            let mut turned = all.clone();
            turned[..11].rotate_left(4);
            let mut q = accused(&turned, &extracted);
            q.rotate_right(4);
            for (p, q) in p.iter().zip(&q) {
                prop_assert!((p - q).abs() <= 1e-6 * p.abs().max(1.0), "{p} {q}");
            }
        }

        #[test]
        fn any_bits_are_answered(
            extracted in proptest::collection::vec(any::<Option<f64>>(), 0..12),
            count in 0..5_usize,
        ) {
            let all = watermarks(count, extracted.len(), 1);
            let slices: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
            let p = accuse(&slices, &extracted, f64::INFINITY);
            prop_assert!(p.iter().all(|p| p.log10().is_finite()));
        }
    }
}
