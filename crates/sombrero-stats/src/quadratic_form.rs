//! The lower tail of a weighted sum of squares of Gaussian numbers, in logarithms.
//!
//! For independent g_k ~ N(0, 1) let X = Σ λ_k (g_k - c_k)² with λ_k > 0. With y_k = 2 s λ_k the logarithm of its
//! Laplace transform and the first two derivatives of that are
//!
//! ```text
//! ln E exp(-s X) = -½ Σ [ln(1 + y) + c² y/(1 + y)]
//! M(s)           = Σ λ/(1 + y) + λ c²/(1 + y)²              (mean of X tilted by exp(-s X); falls from E X to 0)
//! -M'(s)         = Σ 2 λ²/(1 + y)² + 4 λ² c²/(1 + y)³       (its variance)
//! ```
//!
//! **The bound** is Chernoff's (Ann. Math. Statist. 23, 1952). For every s ≥ 0, by Markov's inequality,
//!
//! ```text
//! ln Pr[X ≤ x] ≤ s x + ln E exp(-s X)
//! ```
//!
//! It is smallest where M(s) = x, but it holds at any s: an optimiser that stops early loosens it and cannot break it.
//!
//! The saddlepoint value beside it is in `saddlepoint.rs`. Only ratios of the λ matter; they are divided by the largest.
//!
//! Only `libm` functions are called, so that machines agree to the last bit.

use libm::{log1p, sqrt};

use crate::LogProbability;
use crate::saddlepoint::{self, Exponents};

/// x counts as at least this share of the mean of X: coefficients given as doubles cannot be known to agree better,
/// and the logarithm of the tail stays finite.
const AGREEMENT_FLOOR: f64 = f64::EPSILON * f64::EPSILON;

/// Above the mean, s stays above this. The pole is at -½; here the tail is 1 to all digits.
const LOWEST_TILT: f64 = -0.4995;

/// The largest tilt that [`QuadraticForm::quantile_of_bound`] considers.
const LARGEST_TILT: f64 = 1e300;

/// One direction.
#[derive(Debug, Clone, Copy)]
struct Term {
    /// λ in (0, 1].
    weight: f64,
    /// c².
    shift: f64,
}

/// X = Σ λ_k (g_k - c_k)², with the largest λ equal to 1.
#[derive(Debug, Clone)]
pub(crate) struct QuadraticForm {
    terms: Vec<Term>,
    mean: f64,
    variance: f64,
    /// Σ c².
    shifts: f64,
}

/// Both answers about Pr[X ≤ x].
#[derive(Debug, Clone, Copy)]
pub(crate) struct LowerTail {
    pub(crate) bound: LogProbability,
    pub(crate) saddlepoint: LogProbability,
}

impl QuadraticForm {
    /// From pairs (λ, c) with λ in [0, 1], the largest 1 (or all 0); zeros are left out.
    pub(crate) fn new(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let terms: Vec<Term> =
            pairs.filter(|(l, _)| *l > 0.0).map(|(l, c)| Term { weight: l, shift: c * c }).collect();
        let sum = |f: fn(&Term) -> f64| terms.iter().map(f).sum::<f64>();
        let mean = sum(|t| t.weight * (1.0 + t.shift));
        let variance = sum(|t| t.weight * t.weight * (2.0 + 4.0 * t.shift));
        let shifts = sum(|t| t.shift);
        Self { terms, mean, variance, shifts }
    }

    /// How many directions count.
    pub(crate) fn rank(&self) -> usize {
        self.terms.len()
    }

    /// Pr[X ≤ x] for x ≥ 0; NaN claims nothing.
    pub(crate) fn lower_tail(&self, x: f64) -> LowerTail {
        let certain = LowerTail { bound: LogProbability::ONE, saddlepoint: LogProbability::ONE };
        if self.terms.is_empty() || !x.is_finite() || !self.mean.is_finite() {
            return certain;
        }
        let x = x.max(AGREEMENT_FLOOR * self.mean);
        let Some(tilt) = self.tilt_at(x) else { return certain };
        let bound = if tilt > 0.0 { self.chernoff(x, tilt) } else { LogProbability::ONE };
        let tilt = saddlepoint::away_from_mean(tilt);
        let saddlepoint = self.exponents(tilt).lugannani_rice(tilt > 0.0);
        LowerTail { bound, saddlepoint: if saddlepoint < bound { saddlepoint } else { bound } }
    }

    /// The largest x whose bound does not exceed p: ∞ for p = 1, -∞ where no x is small enough.
    pub(crate) fn quantile_of_bound(&self, p: LogProbability) -> f64 {
        if p == LogProbability::ONE {
            return f64::INFINITY;
        }
        // In terms of s the bound is -a²/2, which falls as s grows; x follows from s.
        let reached = |tilt: f64| -0.5 * self.exponents(tilt).a_squared <= p.ln();
        if self.terms.is_empty() || !reached(LARGEST_TILT) {
            return f64::NEG_INFINITY;
        }
        let (mut low, mut high) = (1e-40, LARGEST_TILT);
        for _ in 0..200 {
            let tilt = middle(low, high);
            if tilt <= low || tilt >= high {
                break;
            }
            *(if reached(tilt) { &mut high } else { &mut low }) = tilt;
        }
        let x = self.tilted(high).mean;
        if x < AGREEMENT_FLOOR * self.mean { f64::NEG_INFINITY } else { x }
    }

    /// s x + ln E exp(-s X), an upper bound on ln Pr[X ≤ x] for every s ≥ 0, and more than its rounding on top: the two
    /// parts are sums of positive terms and may nearly cancel.
    fn chernoff(&self, x: f64, tilt: f64) -> LogProbability {
        let transform: f64 = self
            .terms
            .iter()
            .map(|t| {
                let y = 2.0 * tilt * t.weight;
                log1p(y) + t.shift * (y / (1.0 + y))
            })
            .sum();
        let (plus, minus) = (tilt * x, 0.5 * transform);
        let rounding = f64::EPSILON * (self.terms.len() + 8) as f64 * (plus + minus);
        LogProbability::from_ln(plus - minus + rounding)
    }

    /// The s with M(s) = x > 0; `None` when x is so far above the mean that the tail is 1.
    fn tilt_at(&self, x: f64) -> Option<f64> {
        // One Newton step on 1/M, which is nearly linear, from s = 0.
        let start = (self.mean / x) * (self.mean - x) / self.variance;
        if x < self.mean {
            // M is convex, so that Newton's first step on it stays below the root. Above, λ/(1 + y) ≤ 1/2s and
            // λ/(1 + y)² ≤ 1/8s.
            let low = (self.mean - x) / self.variance;
            let high = (0.5 * self.terms.len() as f64 + 0.125 * self.shifts) / x;
            Some(self.solve(x, start, low, high.max(low)))
        } else if x > self.mean {
            let reached = self.tilted(LOWEST_TILT).mean > x;
            reached.then(|| self.solve(x, start, LOWEST_TILT, 0.0))
        } else {
            Some(0.0)
        }
    }

    /// Newton's method on 1/M within a bracket; a step that leaves it, or gains less than a half, is replaced by a
    /// bisection.
    fn solve(&self, x: f64, start: f64, mut low: f64, mut high: f64) -> f64 {
        let mut tilt = if low < start && start < high { start } else { middle(low, high) };
        let mut last_miss = f64::INFINITY;
        for _ in 0..100 {
            let Tilted { mean, slope } = self.tilted(tilt);
            let miss = (mean / x - 1.0).abs();
            if miss <= 1e-14 {
                break;
            }
            *(if mean > x { &mut low } else { &mut high }) = tilt;
            let newton = tilt * (1.0 + (mean / x) * (mean - x) / slope);
            let trusted = miss <= 0.5 * last_miss && low < newton && newton < high;
            let next = if trusted { newton } else { middle(low, high) };
            last_miss = miss;
            if (next - tilt).abs() <= 1e-14 * tilt.abs() {
                break;
            }
            tilt = next;
        }
        tilt
    }

    fn tilted(&self, tilt: f64) -> Tilted {
        let mut sum = Tilted { mean: 0.0, slope: 0.0 };
        for t in &self.terms {
            let y = 2.0 * tilt * t.weight;
            let shrink = 1.0 / (1.0 + y);
            let (z, weight, shift) = (y * shrink, t.weight * shrink, t.shift * shrink);
            sum.mean += weight * (1.0 + shift);
            sum.slope += weight * z * (1.0 + 2.0 * shift);
        }
        sum
    }
    fn exponents(&self, tilt: f64) -> Exponents {
        Exponents::new(self.terms.iter().map(|t| (2.0 * tilt * t.weight, t.shift)))
    }
}

/// X tilted by exp(-s X).
struct Tilted {
    /// M(s).
    mean: f64,
    /// -s M'(s).
    slope: f64,
}

/// The geometric mean of two positive numbers, the arithmetic mean of others.
fn middle(low: f64, high: f64) -> f64 {
    if low > 0.0 { sqrt(low) * sqrt(high) } else { 0.5 * (low + high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    use statrs::function::erf;
    use statrs::function::gamma::ln_gamma;

    /// ln Pr[X ≤ x] for k equal weights and no shift: `(x/2)^(k/2) e^(-x/2) / Γ(k/2 + 1) · Σ (x/2)^j / ((k/2 + 1) … (k/2 + j))`.
    fn ln_chi_square(k: usize, x: f64) -> f64 {
        let (shape, half) = (0.5 * k as f64, 0.5 * x);
        let (mut term, mut sum) = (1.0, 1.0);
        for j in 1..2000 {
            term *= half / (shape + f64::from(j));
            sum += term;
        }
        shape * half.ln() - half - ln_gamma(shape + 1.0) + sum.ln()
    }

    fn equal(k: usize) -> QuadraticForm {
        QuadraticForm::new((0..k).map(|_| (1.0, 0.0)))
    }

    fn uneven(k: usize, decades: f64, rng: &mut impl Rng) -> Vec<(f64, f64)> {
        (0..k)
            .map(|i| {
                let weight = if i == 0 { 1.0 } else { 10_f64.powf(-decades * rng.random::<f64>()) };
                let c: f64 = StandardNormal.sample(rng);
                (weight, 1.5 * c)
            })
            .collect()
    }

    #[test]
    fn the_reference_is_right() {
        for (k, x) in [(2, 0.3), (7, 2.0), (50, 30.0), (50, 60.0)] {
            let exact = ChiSquared::new(k as f64).unwrap().cdf(x);
            assert!((ln_chi_square(k, x) - exact.ln()).abs() < 1e-10);
        }
    }

    /// Saddlepoint over exact probability: within 17 % for one degree of freedom, 1/(6k) for k of them.
    #[test]
    fn chi_square_down_to_very_small_probabilities() {
        for k in [1, 2, 5, 20, 50, 400] {
            let form = equal(k);
            for exponent in 0..100 {
                let x = 0.95 * k as f64 * 10_f64.powf(-0.3 * f64::from(exponent));
                let exact = ln_chi_square(k, x);
                let tail = form.lower_tail(x);
                let (bound, ratio) = (tail.bound.ln(), (tail.saddlepoint.ln() - exact).exp());
                assert!(bound >= exact, "{k}, {x}: {bound} below {exact}");
                // Chernoff's bound is off by √(π k) at most when the weights are equal.
                assert!(bound < exact + 0.5 * (4.0 * k as f64).ln() + 0.7, "{k}, {x}: {bound} {exact}");
                assert!((ratio - 1.0).abs() < 0.18 / k as f64, "{k}, {x}: {ratio}");
            }
        }
        assert!(equal(400).lower_tail(1e-22).saddlepoint.ln() < -5000.0);
    }

    /// Imhof (Biometrika 48, 1961), table 1: 0.6, 0.3 and 0.1 times squares; upper tails at 0.1, 0.7 and 2.
    #[test]
    fn imhofs_example_on_both_sides_of_the_mean() {
        let form = QuadraticForm::new([(1.0, 0.0), (0.5, 0.0), (1.0 / 6.0, 0.0)].into_iter());
        for (x, upper) in [(0.1, 0.9458), (0.7, 0.5064), (2.0, 0.1240)] {
            let p = form.lower_tail(x / 0.6).saddlepoint.p();
            assert!((p / (1.0 - upper) - 1.0).abs() < 0.1, "{x}: {p}");
        }
    }

    /// One direction: Pr[(g - c)² ≤ x] = Φ(c + √x) - Φ(c - √x).
    #[test]
    fn one_direction() {
        for c in [0.0, 0.5, 2.0, -3.0] {
            let form = QuadraticForm::new([(1.0, c)].into_iter());
            for x in [1e-6_f64, 1e-3, 0.1, 0.5, 1.0, 2.0, 5.0] {
                let normal = |x: f64| 0.5 * erf::erfc(-x / 2_f64.sqrt());
                let exact = normal(c + x.sqrt()) - normal(c - x.sqrt());
                let tail = form.lower_tail(x);
                assert!(tail.bound.p() >= exact, "{c}, {x}: {} {exact}", tail.bound.p());
                let ratio = tail.saddlepoint.p() / exact;
                assert!((0.9..1.2).contains(&ratio), "{c}, {x}: {ratio}");
            }
        }
    }

    /// A centre far out, where s x and the transform nearly cancel: Pr[(g - c)² ≤ (c - q)²] ≈ Φ(-q).
    #[test]
    fn distant_centres_are_not_taken_for_evidence() {
        for c in [1e3, 1e6, 1e9, 1e12] {
            let form = QuadraticForm::new([(1.0, c), (1e-3, 0.7 * c), (1e-20, c)].into_iter());
            let at = |q: f64| form.lower_tail(form.mean - q * form.variance.sqrt());
            assert!(at(0.01).bound.p() > 0.99 && at(-1.0).bound == LogProbability::ONE);
            let (tail, exact) = (at(3.0), 0.5 * erf::erfc(3.0 / 2_f64.sqrt()));
            assert!(tail.bound.p() > exact, "{c}");
            assert!(
                (tail.saddlepoint.p() / exact - 1.0).abs() < 0.02,
                "{c}: {}",
                tail.saddlepoint.p() / exact
            );
        }
    }

    /// As x goes to 0, p goes to the volume of the ellipsoid times the Gaussian density at its centre.
    #[test]
    fn far_tail_of_uneven_weights() {
        let pairs = uneven(60, 6.0, &mut ChaCha8Rng::seed_from_u64(3));
        let form = QuadraticForm::new(pairs.iter().copied());
        let x = 1e-16_f64;
        let exact = 30.0 * (0.5 * x).ln()
            - ln_gamma(31.0)
            - pairs.iter().map(|(l, c)| 0.5 * (l.ln() + c * c)).sum::<f64>();
        let tail = form.lower_tail(x);
        assert!((tail.saddlepoint.ln() - exact - 1.0 / 360.0).abs() < 1e-4, "{:?} {exact}", tail);
        assert!(tail.bound.ln() > exact && tail.bound.ln() < exact + 3.0);
    }

    #[test]
    fn smooth_and_increasing_through_the_mean() {
        let form = QuadraticForm::new(uneven(20, 3.0, &mut ChaCha8Rng::seed_from_u64(4)).into_iter());
        let mut last = form.lower_tail(0.5 * form.mean);
        for i in -3000..=3000 {
            let step = f64::from(i);
            let x = form.mean * (1.0 + 1e-9 * step * step * step / 2.7e2);
            if x <= 0.5 * form.mean {
                continue;
            }
            let tail = form.lower_tail(x);
            assert!(tail.bound.ln() >= last.bound.ln() - 1e-12, "{x}");
            assert!(tail.saddlepoint.ln() >= last.saddlepoint.ln() - 1e-12, "{x}");
            assert!(i == -3000 || tail.saddlepoint.p() - last.saddlepoint.p() < 0.05, "{x}");
            last = tail;
        }
        let at = |x: f64| form.lower_tail(x).saddlepoint.p();
        let (below, mean, above) =
            (at(form.mean * (1.0 - 1e-7)), at(form.mean), at(form.mean * (1.0 + 1e-7)));
        assert!((below - mean).abs() < 1e-6 && (above - mean).abs() < 1e-6);
        assert!(mean > 0.5 && mean < 0.7);
        assert_eq!(at(1e9 * form.mean), 1.0);
    }

    #[test]
    fn monotone_from_nothing_to_everything() {
        let form = QuadraticForm::new(uneven(30, 60.0, &mut ChaCha8Rng::seed_from_u64(5)).into_iter());
        let mut last = form.lower_tail(0.0);
        assert!(last.bound.ln() > -1e5);
        for i in -3300..50 {
            let tail = form.lower_tail(10_f64.powf(0.1 * f64::from(i)));
            let slack = 1e-12 * last.bound.ln().abs();
            assert!(tail.bound.ln() >= last.bound.ln() - slack);
            assert!(tail.saddlepoint.ln() >= last.saddlepoint.ln() - slack);
            assert!(tail.saddlepoint <= tail.bound);
            last = tail;
        }
        assert_eq!(last.bound, LogProbability::ONE);
    }

    /// The solver reaches the minimum for weights over sixty decades: no s near it does better.
    #[test]
    fn the_bound_is_the_best_of_its_kind() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for round in 0..200 {
            let form = QuadraticForm::new(uneven(12, f64::from(round % 7) * 10.0, &mut rng).into_iter());
            let x = form.mean * 10_f64.powf(-25.0 * rng.random::<f64>());
            let tilt = form.tilt_at(x).unwrap();
            let best = form.chernoff(x, tilt);
            for factor in [1e-3, 0.9, 0.999, 1.001, 1.1, 1e3] {
                let other = form.chernoff(x, tilt * factor);
                assert!(best.ln() <= other.ln() + 1e-11 * (1.0 + other.ln().abs()), "{round}, {factor}");
            }
            assert!((form.tilted(tilt).mean / x - 1.0).abs() < 1e-10, "{round}");
        }
    }

    /// At M(s) = x the bound is -a²/2, here from positive terms alone: rounding never takes it below.
    #[test]
    fn rounding_loosens_the_bound() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        for round in 0..500 {
            let form = QuadraticForm::new(uneven(1 + round % 60, 9.0, &mut rng).into_iter());
            let tilt = 10_f64.powf(-6.0 + 20.0 * rng.random::<f64>());
            let (bound, exact) =
                (form.chernoff(form.tilted(tilt).mean, tilt), form.exponents(tilt).a_squared);
            assert!(bound == LogProbability::ONE || bound.ln() > -0.5 * exact, "{round}, {tilt}");
            assert!(bound.ln() + 0.5 * exact < 1e-10, "{round}, {tilt}");
        }
    }

    #[test]
    fn slope_is_the_derivative() {
        let form = QuadraticForm::new(uneven(9, 4.0, &mut ChaCha8Rng::seed_from_u64(9)).into_iter());
        for tilt in [-0.4, -0.1, 1e-3, 0.5, 30.0, 1e6] {
            let step = 1e-5;
            let rise = form.tilted(tilt * (1.0 + step)).mean - form.tilted(tilt * (1.0 - step)).mean;
            assert!((-0.5 * rise / step / form.tilted(tilt).slope - 1.0).abs() < 1e-6, "{tilt}");
        }
    }

    #[test]
    fn quantiles_invert_the_bound() {
        let form = QuadraticForm::new(uneven(25, 8.0, &mut ChaCha8Rng::seed_from_u64(7)).into_iter());
        for log10 in [-0.01, -1.0, -3.0, -10.0, -100.0, -300.0] {
            let p = LogProbability::from_log10(log10);
            let x = form.quantile_of_bound(p);
            assert!((form.lower_tail(x).bound.log10() / log10 - 1.0).abs() < 1e-10, "{log10}");
        }
        assert_eq!(form.quantile_of_bound(LogProbability::ONE), f64::INFINITY);
        assert_eq!(form.quantile_of_bound(LogProbability::from_log10(-1e5)), f64::NEG_INFINITY);
        assert_eq!(equal(0).quantile_of_bound(LogProbability::from_p(0.5)), f64::NEG_INFINITY);
    }
}
