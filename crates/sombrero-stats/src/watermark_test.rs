//! The paper's test (its section on analysis): is w, which was inserted, in w*, which was extracted?
//!
//! ```text
//! keep i where w*ᵢ is known and |w*ᵢ| ≤ 2.5
//! ρ = correlation of w and w* over the k kept pairs
//! p = Pr[T ≥ ρ √(ν / (1 - ρ²))],   ν = k - 2
//! ```
//!
//! Which pairs are kept depends on w* alone, so that p stays exact: under the null hypothesis the kept part of w is
//! still a vector of independent Gaussian numbers.

use thiserror::Error;

use crate::{Correlation, CorrelationError, LogProbability, correlation_tail};

/// Outlier policy of [`watermark_test`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WatermarkTestOptions {
    /// Drop extracted coefficients whose absolute value exceeds this many standard deviations of the
    /// inserted ones; `None` keeps all. Default `Some(2.5)`, as in the paper: of a clean watermark it costs 1.24 %.
    pub outlier_threshold: Option<f64>,
}

impl Default for WatermarkTestOptions {
    fn default() -> Self {
        Self { outlier_threshold: Some(2.5) }
    }
}

/// Answer of [`watermark_test`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct WatermarkTest {
    /// Probability that a random watermark correlates as well; 1 when too little was left to compare.
    pub p: LogProbability,
    /// The correlation; `None` when fewer than three pairs were kept or one side of them was constant.
    pub correlation: Option<Correlation>,
    /// How many coefficients were compared.
    pub used: usize,
    /// How many could not be extracted (`None`, or not finite).
    pub missing: usize,
    /// How many were dropped for their size.
    pub outliers: usize,
}

impl WatermarkTest {
    /// log10 of the probability, finite and not above 0.
    pub fn log10_p(&self) -> f64 {
        self.p.log10()
    }

    /// ρ, or 0 where there is none.
    pub fn rho(&self) -> f64 {
        self.correlation.map_or(0.0, |c| c.rho())
    }
}

/// Why there is no test.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WatermarkTestError {
    /// The two watermarks do not pair up.
    #[error("{inserted} inserted coefficients against {extracted} extracted ones")]
    Lengths {
        /// Length of w.
        inserted: usize,
        /// Length of w*.
        extracted: usize,
    },
    /// An inserted coefficient is infinite or not a number: the key is damaged.
    #[error("inserted coefficient {index} is not finite")]
    InsertedNotFinite {
        /// Its place in w.
        index: usize,
    },
    /// The outlier threshold is negative or not a number.
    #[error("{threshold} is no outlier threshold: it must not be negative")]
    Threshold {
        /// The value.
        threshold: f64,
    },
}

/// Compares m inserted coefficients with m extracted ones, in units of the inserted ones' standard deviation.
///
/// An extracted coefficient of `None` could not be had (its part of the mesh is missing); one that is not
/// finite counts as missing too. Fewer than three kept pairs, or a constant side, are no error but no evidence: p = 1.
///
/// # Errors
///
/// When lengths differ, an inserted coefficient is not finite, or the threshold is negative or NaN.
pub fn watermark_test(
    inserted: &[f64],
    extracted: &[Option<f64>],
    options: &WatermarkTestOptions,
) -> Result<WatermarkTest, WatermarkTestError> {
    if inserted.len() != extracted.len() {
        return Err(WatermarkTestError::Lengths { inserted: inserted.len(), extracted: extracted.len() });
    }
    if let Some(index) = inserted.iter().position(|w| !w.is_finite()) {
        return Err(WatermarkTestError::InsertedNotFinite { index });
    }
    let threshold = options.outlier_threshold.unwrap_or(f64::INFINITY);
    if threshold.is_nan() || threshold < 0.0 {
        return Err(WatermarkTestError::Threshold { threshold });
    }

    let known: Vec<(f64, f64)> = inserted
        .iter()
        .zip(extracted)
        .filter_map(|(&w, &e)| e.filter(|e| e.is_finite()).map(|e| (w, e)))
        .collect();
    let (w, e): (Vec<f64>, Vec<f64>) = known.iter().copied().filter(|(_, e)| e.abs() <= threshold).unzip();
    let correlation = correlation_if_any(&w, &e);
    Ok(WatermarkTest {
        p: correlation.as_ref().map_or(LogProbability::ONE, correlation_tail),
        correlation,
        used: w.len(),
        missing: inserted.len() - known.len(),
        outliers: known.len() - w.len(),
    })
}

fn correlation_if_any(w: &[f64], e: &[f64]) -> Option<Correlation> {
    match Correlation::of(w, e) {
        Ok(correlation) => Some(correlation),
        // Lengths and values were checked before, so that too few and constant are all that is left.
        Err(CorrelationError::TooFew { .. } | CorrelationError::Constant { .. }) => None,
        Err(_) => None,
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

    fn gaussian(m: usize, rng: &mut impl Rng) -> Vec<f64> {
        StandardNormal.sample_iter(rng).take(m).collect()
    }

    fn some(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().copied().map(Some).collect()
    }

    fn test(w: &[f64], e: &[Option<f64>]) -> WatermarkTest {
        watermark_test(w, e, &WatermarkTestOptions::default()).unwrap()
    }

    #[test]
    fn a_clean_copy_is_certain() {
        let w = gaussian(50, &mut ChaCha8Rng::seed_from_u64(1));
        let result = test(&w, &some(&w));
        assert!(result.log10_p() < -600.0 && result.log10_p().is_finite());
        assert_eq!(result.used + result.outliers, 50);
    }

    #[test]
    fn noise_costs_evidence() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let (w, noise) = (gaussian(50, &mut rng), gaussian(50, &mut rng));
        let noisy = |s: f64| some(&w.iter().zip(&noise).map(|(w, n)| w + s * n).collect::<Vec<_>>());
        let levels = [1e-9, 1e-3, 0.1, 1.0].map(|s| test(&w, &noisy(s)).log10_p());
        assert!(levels.is_sorted(), "{levels:?}");
        assert!(levels[3] < -4.0, "{levels:?}");
    }

    #[test]
    fn missing_and_outliers_are_left_out() {
        let w = [0.5, -0.5, 1.0, -1.0, 0.2, 0.0, 0.3];
        let clean = [Some(0.6), Some(-0.4), Some(0.8), Some(-1.0)];
        let mut e = clean.to_vec();
        e.extend([None, Some(f64::NAN), Some(-2.6)]);
        let result = test(&w, &e);
        assert_eq!((result.used, result.missing, result.outliers), (4, 2, 1));
        assert_eq!(result.p, test(&w[..4], &clean).p);
        let all = watermark_test(&w, &e, &WatermarkTestOptions { outlier_threshold: None }).unwrap();
        assert_eq!((all.used, all.outliers), (5, 0));
        assert_eq!(test(&[1.0, 2.0, 0.0], &[Some(2.5), Some(-2.5), Some(0.0)]).used, 3);
    }

    #[test]
    fn no_evidence_is_an_answer() {
        let w = [0.5, -0.5, 1.0];
        for e in [
            [None, None, None],
            [Some(0.1), Some(0.2), None],
            [Some(0.4), Some(0.4), Some(0.4)],
            [Some(3.0), Some(9.0), Some(f64::INFINITY)],
        ] {
            let result = test(&w, &e);
            assert_eq!((result.log10_p(), result.correlation, result.rho()), (0.0, None, 0.0));
        }
        assert_eq!(test(&[], &[]).used, 0);
        assert_eq!(test(&[1.0; 3], &some(&w)).p, LogProbability::ONE);
    }

    #[test]
    fn senseless_questions() {
        let options = WatermarkTestOptions::default();
        let lengths = WatermarkTestError::Lengths { inserted: 1, extracted: 0 };
        assert_eq!(watermark_test(&[1.0], &[], &options), Err(lengths));
        let damaged = WatermarkTestError::InsertedNotFinite { index: 0 };
        assert_eq!(watermark_test(&[f64::NAN], &[None], &options), Err(damaged));
        for threshold in [f64::NAN, -1.0] {
            let options = WatermarkTestOptions { outlier_threshold: Some(threshold) };
            assert!(watermark_test(&[], &[], &options).is_err());
        }
    }

    /// What "p" promises: of random keys, a share p scores p or better, here against one far from Gaussian vector.
    #[test]
    fn calibrated_against_ten_thousand_keys() {
        const KEYS: usize = 10_000;
        let mut extracted: Vec<Option<f64>> =
            (0..50).map(|i| Some(0.05 * f64::from(i * i % 37) - 0.4)).collect();
        (extracted[7], extracted[8], extracted[9]) = (None, Some(40.0), Some(2.4));
        let mut rng = ChaCha8Rng::seed_from_u64(1999);
        let p: Vec<f64> = (0..KEYS).map(|_| test(&gaussian(50, &mut rng), &extracted).p.p()).collect();
        for nominal in [0.5, 0.1, 0.01, 0.001] {
            let hits = p.iter().filter(|p| **p <= nominal).count();
            let interval = wilson_interval(hits, KEYS, 0.999).unwrap();
            assert!(interval.contains(nominal), "{hits} of {KEYS} at {nominal}: {interval:?}");
        }
    }

    proptest! {
        #[test]
        fn any_bits_are_answered(
            pairs in proptest::collection::vec((-4.0..4.0, any::<Option<f64>>()), 0..12),
        ) {
            let (w, e): (Vec<f64>, Vec<Option<f64>>) = pairs.into_iter().unzip();
            for outlier_threshold in [None, Some(2.5)] {
                let result = watermark_test(&w, &e, &WatermarkTestOptions { outlier_threshold }).unwrap();
                prop_assert!(result.log10_p() <= 0.0 && result.log10_p().is_finite());
                prop_assert_eq!(result.used + result.missing + result.outliers, w.len());
            }
        }
    }
}
