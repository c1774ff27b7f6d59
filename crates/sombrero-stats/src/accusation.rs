//! Which of many watermarks are in w*, when several may be at once: copies that were averaged.
//!
//! The mean of c copies carries Σ wᵢ / c: each mark weakly, and the others are noise to it. Extraction gives w* with the
//! precision P of its errors. In the coordinates of P's eigenvectors, with eigenvalues l,
//!
//! ```text
//! w*_k ~ N(0, τ² + 1/l_k)           what all marks together and the errors leave of w* (τ² = 1/c for c copies)
//! g_k  = 1 / (τ² + 1/l_k)           how much coordinate k counts; τ² is the likeliest for w*
//! r    = w* - W_S β                 with β that minimises Σ g_k r_k², for a set S of other watermarks
//! u_k  = g_k r_k                    what is left to explain, weighed; orthogonal to all of S
//! v    = wᵢ without its part in the span of S
//! ρ    = v · u / (|v| |u|)
//! p    = Pr[T ≥ ρ √(ν / (1 - ρ²))],   ν = n - |S| - 1   (n coordinates with l > 0)
//! ```
//!
//! S is chosen by forward selection among the watermarks *other than wᵢ*: the one of largest ρ, over and over, up to the
//! last step that is better than chance. So S, τ² and u are functions of w*, P and the others alone. Under the null
//! hypothesis, that wᵢ had no part in w*, wᵢ is Gaussian and independent of all three; then v has a uniform direction in
//! its subspace, and p is exact, whatever the others did, however S was chosen, however wrong P is. Choosing S with wᵢ
//! among the candidates would break that. p is for one watermark: who looks at n of them multiplies by n.
//!
//! Cost: an eigendecomposition, a product of the watermarks with an m × m matrix, |S| + 7 passes over the n × m numbers,
//! and as many passes again for each member of S.

use crate::{Correlation, Ellipsoid, EllipsoidError, LogProbability, best_of, correlation_tail};
use nalgebra::{DMatrix, DVector};

/// So many watermarks are taken away at most.
const MOST: usize = 32;

/// A step of the selection counts when its p, times the number of candidates, is below this.
const CHANCE: f64 = 0.05;

/// The selection ends after so many steps in a row that do not count: the first ones may be weak, as each
/// watermark is noise to the others.
const PATIENCE: usize = 6;

/// What is left of a vector's squared length when nothing but rounding is.
const ROUNDING: f64 = 1e-24;

/// Eigenvalues below this share of the largest one are 0: directions that the suspect does not show.
const KNOWN: f64 = 1e-12;

/// Degrees of freedom that a test should keep.
const FEWEST_DEGREES: usize = 4;

/// Values of τ² that are tried: from the mean of 4096 copies to a whole mark under structured errors.
const VARIANCES: std::ops::RangeInclusive<i32> = -24..=4;

/// For each of `watermarks`, the probability that an unrelated one would fit as well what `extracted` shows beyond the
/// others. Probabilities are of each alone.
///
/// `extracted` is w* with its precision, as one test of one watermark takes it too. Where there is nothing to compare,
/// p = 1.
///
/// # Errors
/// [`EllipsoidError`] when a watermark has another length than w* or a value that is not finite.
///
/// ```
/// use nalgebra::DMatrix;
/// use sombrero_stats::{Ellipsoid, accuse};
///
/// // Ten watermarks; the mean of the first two turns up, known to ±0.01.
/// let watermark = |i: u32| (0..40).map(|j| f64::from((i * 7919 + j * 104_729 + i * i * j) % 1009) / 291.0 - 1.73).collect();
/// let watermarks: Vec<Vec<f64>> = (1..=10).map(watermark).collect();
/// let mean: Vec<f64> = (0..40).map(|j| (watermarks[0][j] + watermarks[1][j]) / 2.0).collect();
/// let extracted = Ellipsoid::new(&mean, &(DMatrix::identity(40, 40) * 1e4))?;
///
/// let slices: Vec<&[f64]> = watermarks.iter().map(Vec::as_slice).collect();
/// let p = accuse(&slices, &extracted)?;
/// assert!(p[0].log10() < -50.0 && p[1].log10() < -50.0);
/// assert!(p[2..].iter().all(|p| p.log10() > -4.0));
/// # Ok::<(), sombrero_stats::EllipsoidError>(())
/// ```
pub fn accuse(watermarks: &[&[f64]], extracted: &Ellipsoid) -> Result<Vec<LogProbability>, EllipsoidError> {
    watermarks.iter().try_for_each(|w| extracted.check(w))?;
    let precisions = extracted.precisions();
    let largest = precisions.iter().copied().fold(0.0, f64::max);
    let known: Vec<usize> = (0..precisions.len()).filter(|&k| precisions[k] > KNOWN * largest).collect();
    if known.is_empty() {
        return Ok(vec![LogProbability::ONE; watermarks.len()]);
    }
    let axes = extracted.axes().columns(&known);
    let start = Residuals {
        found: axes.tr_mul(extracted.centre()),
        errors: DVector::from_iterator(known.len(), known.iter().map(|&k| 1.0 / precisions[k])),
        watermarks: watermarks
            .iter()
            .map(|w| Residual::new(axes.tr_mul(&DVector::from_column_slice(w))))
            .collect(),
        away: Vec::new(),
        directions: Vec::new(),
    };

    let chosen = start.clone().select(None);
    let mut p = start.after(&chosen).all();
    for &i in &chosen {
        let others = start.clone().select(Some(i));
        let after = start.after(&others);
        p[i] = after.p(i, &after.left());
    }
    Ok(p)
}

/// w* and all watermarks in P's coordinates, and what was taken away.
#[derive(Clone)]
struct Residuals {
    /// w*, whole.
    found: DVector<f64>,
    /// 1/l.
    errors: DVector<f64>,
    /// Without their parts in the span of S.
    watermarks: Vec<Residual>,
    /// S, in the order in which it was chosen, and an orthogonal basis of its span.
    away: Vec<usize>,
    directions: Vec<DVector<f64>>,
}

impl Residuals {
    /// Forward selection among all but `left_out`, up to the last step that counts.
    fn select(mut self, left_out: Option<usize>) -> Vec<usize> {
        let (mut counted, mut idle) = (0, 0);
        while self.away.len() < MOST && self.degrees() > FEWEST_DEGREES && idle < PATIENCE {
            let left = self.left();
            let candidates =
                (0..self.watermarks.len()).filter(|i| Some(*i) != left_out && !self.away.contains(i));
            let best =
                candidates.filter_map(|i| Some((i, self.rho(i, &left)?))).max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((best, _)) = best else { break };
            let counts = best_of(self.p(best, &left), self.watermarks.len()).p() < CHANCE;
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

    /// What is left when these are taken away.
    fn after(&self, chosen: &[usize]) -> Self {
        let mut after = self.clone();
        chosen.iter().for_each(|&i| after.take_away(i));
        after
    }

    fn take_away(&mut self, index: usize) {
        let direction = self.watermarks[index].rest.clone();
        self.away.push(index);
        let square = direction.norm_squared();
        if self.watermarks[index].square_or_zero() == 0.0 {
            return;
        }
        for Residual { rest, .. } in &mut self.watermarks {
            let share = rest.dot(&direction) / square;
            rest.axpy(-share, &direction, 1.0);
        }
        self.directions.push(direction / square.sqrt());
    }

    /// u; 0 where w* is explained but for rounding.
    fn left(&self) -> DVector<f64> {
        // τ² of what S leaves, which takes a first guess of what it leaves.
        let guess = self.unexplained(&self.weights(&self.found));
        let weights = self.weights(&guess);
        let rest = self.unexplained(&weights);
        if rest.norm_squared() > ROUNDING * self.found.norm_squared() {
            rest.component_mul(&weights)
        } else {
            rest * 0.0
        }
    }

    /// r, for these weights g.
    fn unexplained(&self, weights: &DVector<f64>) -> DVector<f64> {
        if self.directions.is_empty() {
            return self.found.clone();
        }
        let span = DMatrix::from_columns(&self.directions);
        let mut weighed = span.clone();
        weighed.column_iter_mut().for_each(|mut column| column.component_mul_assign(weights));
        let normal = weighed.tr_mul(&span);
        // Positive definite: g > 0, and the basis is orthogonal.
        let beta = normal.cholesky().map(|solver| solver.solve(&weighed.tr_mul(&self.found)));
        beta.map_or_else(|| self.found.clone(), |beta| &self.found - span * beta)
    }

    /// g for the likeliest τ².
    fn weights(&self, rest: &DVector<f64>) -> DVector<f64> {
        let variances = VARIANCES.map(|half| libm::exp2(0.5 * f64::from(half)));
        let cost = |variance: &f64| -> f64 {
            let term = |(r, e): (&f64, &f64)| libm::log(variance + e) + r * r / (variance + e);
            rest.iter().zip(self.errors.iter()).map(term).sum()
        };
        let best = variances.map(|v| (cost(&v), v)).min_by(|a, b| a.0.total_cmp(&b.0));
        let variance = best.map_or(1.0, |(_, variance)| variance);
        self.errors.map(|e| 1.0 / (variance + e))
    }

    /// ν, or 0.
    fn degrees(&self) -> usize {
        self.found.len().saturating_sub(1 + self.directions.len())
    }

    /// ρ; none where nothing is left to compare.
    fn rho(&self, index: usize, left: &DVector<f64>) -> Option<f64> {
        let w = &self.watermarks[index];
        let rho = w.rest.dot(left) / (w.square_or_zero() * left.norm_squared()).sqrt();
        rho.is_finite().then(|| rho.clamp(-1.0, 1.0))
    }

    fn p(&self, index: usize, left: &DVector<f64>) -> LogProbability {
        let degrees = self.degrees();
        let rho = self.rho(index, left).filter(|_| degrees > 0);
        let correlation = rho.and_then(|rho| Correlation::from_rho(rho, degrees + 2).ok());
        correlation.map_or(LogProbability::ONE, |c| correlation_tail(&c))
    }

    fn all(&self) -> Vec<LogProbability> {
        let left = self.left();
        (0..self.watermarks.len()).map(|i| self.p(i, &left)).collect()
    }
}

/// A vector of which parts were taken away.
#[derive(Clone)]
struct Residual {
    rest: DVector<f64>,
    /// Its squared length when it was whole.
    square: f64,
}

impl Residual {
    fn new(whole: DVector<f64>) -> Self {
        Self { square: whole.norm_squared(), rest: whole }
    }

    /// The squared length that is left. Two copies of one watermark leave rounding errors of each other, which are
    /// no evidence.
    fn square_or_zero(&self) -> f64 {
        let square = self.rest.norm_squared();
        if square > ROUNDING * self.square { square } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wilson_interval;
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn watermarks(count: usize, m: usize, rng: &mut impl Rng) -> Vec<Vec<f64>> {
        (0..count).map(|_| StandardNormal.sample_iter(&mut *rng).take(m).collect()).collect()
    }

    /// The mean of the first `leakers` with errors of these sizes, and its precision.
    fn mixed(
        all: &[Vec<f64>],
        leakers: usize,
        errors: &[f64],
        rng: &mut impl Rng,
    ) -> (Vec<f64>, DMatrix<f64>) {
        let at = |j: usize| all[..leakers].iter().map(|w| w[j]).sum::<f64>() / leakers as f64;
        let mut noise = || -> f64 { StandardNormal.sample(&mut *rng) };
        let found = errors.iter().enumerate().map(|(j, e)| at(j) + e * noise()).collect();
        let precision = DVector::from_iterator(errors.len(), errors.iter().map(|e| 1.0 / (e * e)));
        (found, DMatrix::from_diagonal(&precision))
    }

    fn accused(all: &[Vec<f64>], found: &[f64], precision: &DMatrix<f64>) -> Vec<f64> {
        let slices: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        accuse(&slices, &Ellipsoid::new(found, precision).unwrap())
            .unwrap()
            .iter()
            .map(|p| p.log10())
            .collect()
    }

    /// Correlation alone gives each of ten p = 1e-5 or so, of which a thousand candidates leave nothing.
    #[test]
    fn ten_of_a_thousand_are_told_from_the_innocent() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let all = watermarks(1000, 200, &mut rng);
        for leakers in [1, 2, 3, 5, 10] {
            let (found, precision) = mixed(&all, leakers, &[0.02; 200], &mut rng);
            let p = accused(&all, &found, &precision);
            let (guilty, innocent) = p.split_at(leakers);
            assert!(guilty.iter().all(|p| *p < -50.0), "{leakers}: {guilty:?}");
            assert!(innocent.iter().all(|p| *p > -6.0), "{leakers}");
        }
    }

    /// Half of the coefficients are buried: without weights they would bury the others.
    #[test]
    fn what_is_known_badly_counts_little() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let all = watermarks(1000, 200, &mut rng);
        let errors: Vec<f64> = (0..200).map(|j| if j % 2 == 0 { 0.15 } else { 4.0 }).collect();
        let (found, precision) = mixed(&all, 3, &errors, &mut rng);
        let p = accused(&all, &found, &precision);
        assert!(p[..3].iter().all(|p| *p < -9.0), "{:?}", &p[..3]);
        assert!(p[3..].iter().all(|p| *p > -6.0));
    }

    /// What p promises, in a hard case: the candidate is compared beside leakers who are found, coefficients are few,
    /// and the precision is wrong.
    #[test]
    fn the_innocent_score_p_as_often_as_p_says() {
        const TRIALS: usize = 4000;
        let p: Vec<f64> = (0..TRIALS)
            .map(|trial| {
                let mut rng = ChaCha8Rng::seed_from_u64(trial as u64);
                let all = watermarks(7, 20, &mut rng);
                let errors: Vec<f64> = (0..20).map(|j| 0.05 + 0.05 * f64::from(j)).collect();
                let (found, precision) = mixed(&all, 3, &errors, &mut rng);
                let spoilt: Vec<f64> =
                    found.iter().enumerate().map(|(j, x)| x + f64::from(j as u32 % 3)).collect();
                // Any fixed innocent; here the last one.
                10_f64.powf(accused(&all, &spoilt, &precision)[6])
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
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut all = watermarks(6, 50, &mut rng);
        all[1] = all[0].clone();
        let p = accused(&all, &all[0].clone(), &DMatrix::identity(50, 50));
        assert_eq!(p[..2], [0.0, 0.0]);
    }

    #[test]
    fn nothing_to_compare_is_no_evidence() {
        let w = [0.3, -1.0, 0.8, 1.5];
        let ask = |watermarks: &[&[f64]], found: &[f64], precision: DMatrix<f64>| {
            accuse(watermarks, &Ellipsoid::new(found, &precision).unwrap())
        };
        let ones = Ok(vec![LogProbability::ONE; 2]);
        assert_eq!(ask(&[&w, &w], &[0.5; 4], DMatrix::zeros(4, 4)), ones);
        assert_eq!(ask(&[&w, &w], &[0.0; 4], DMatrix::identity(4, 4)), ones);
        assert_eq!(ask(&[], &[1.0], DMatrix::identity(1, 1)), Ok(vec![]));
        assert_eq!(ask(&[&[]], &[], DMatrix::zeros(0, 0)), Ok(vec![LogProbability::ONE]));
    }

    /// Coefficients that the suspect does not show leave rows of zeros, at which the decomposition once ended in NaN: the
    /// others are told from the innocent as if those were not there.
    #[test]
    fn rows_of_zeros_change_nothing() {
        for (m, seed) in [(12, 1), (60, 2), (200, 3), (200, 4)] {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let shown: Vec<usize> = (0..m).filter(|i| i % 3 == 0).collect();
            let (all, n) = (watermarks(9, m, &mut rng), shown.len());
            let turn = DMatrix::from_vec(n, n, watermarks(1, n * n, &mut rng).remove(0)).qr().q();
            let l = DVector::from_fn(n, |i, _| if i == 0 { 2e4 } else { 10_f64.powi(4 - i as i32 / 3) });
            let small = &turn * DMatrix::from_diagonal(&l) * turn.transpose();
            let mut whole = DMatrix::zeros(m, m);
            for (a, &i) in shown.iter().enumerate() {
                shown.iter().enumerate().for_each(|(b, &j)| whole[(i, j)] = small[(a, b)]);
            }
            let errors = watermarks(1, m, &mut rng).remove(0);
            let mean = |i: usize| (all[0][i] + all[1][i]) / 2.0 + 0.05 * errors[i];
            let found: Vec<f64> = (0..m).map(|i| if i % 3 == 0 { mean(i) } else { 0.0 }).collect();
            let with = accused(&all, &found, &whole);
            let pick = |w: &[f64]| shown.iter().map(|&i| w[i]).collect::<Vec<f64>>();
            let without = accused(&all.iter().map(|w| pick(w)).collect::<Vec<_>>(), &pick(&found), &small);
            for (a, b) in with.iter().zip(&without) {
                assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{m}: {a} and {b}");
            }
        }
    }

    #[test]
    fn senseless_questions() {
        let one = Ellipsoid::new(&[1.0], &DMatrix::identity(1, 1)).unwrap();
        let lengths = EllipsoidError::Lengths { watermark: 2, centre: 1 };
        assert_eq!(accuse(&[&[0.0, 1.0]], &one), Err(lengths));
        let damaged = EllipsoidError::WatermarkNotFinite { index: 0 };
        assert_eq!(accuse(&[&[f64::NAN]], &one), Err(damaged));
    }

    proptest! {
        #[test]
        fn the_order_of_candidates_does_not_matter(seed in any::<u64>(), leakers in 1..5_usize) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let all = watermarks(11, 40, &mut rng);
            let (found, precision) = mixed(&all, leakers, &[0.1; 40], &mut rng);
            let p = accused(&all, &found, &precision);
            let mut turned = all;
            turned.rotate_left(4);
            let mut q = accused(&turned, &found, &precision);
            q.rotate_right(4);
            for (p, q) in p.iter().zip(&q) {
                prop_assert!((p - q).abs() <= 1e-6 * p.abs().max(1.0), "{p} {q}");
            }
        }

        #[test]
        fn any_numbers_are_answered(
            found in proptest::collection::vec(any::<f64>(), 0..12),
            precision in proptest::num::f64::ANY,
            count in 0..5_usize,
        ) {
            let all = watermarks(count, found.len(), &mut ChaCha8Rng::seed_from_u64(1));
            let slices: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
            let precision = DMatrix::identity(found.len(), found.len()) * precision;
            if let Ok(p) = Ellipsoid::new(&found, &precision).and_then(|e| accuse(&slices, &e)) {
                prop_assert!(p.iter().all(|p| p.log10().is_finite()));
            }
        }
    }
}
