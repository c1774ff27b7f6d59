//! Summaries for tables: the median of repeated runs, and how well a rate is known from counts.
//!
//! Wilson's score interval for s successes in n trials, with z the Gaussian quantile of (1 + confidence)/2, holds the
//! rates q that the count does not contradict, |s/n - q| ≤ z √(q (1 - q)/n):
//!
//! ```text
//! q = (s + z²/2 ± z √(s (n - s)/n + z²/4)) / (n + z²)
//! ```
//!
//! It behaves at s = 0 and s = n, where calibration of small probabilities lives.

use statrs::function::erf::erf_inv;

/// A range of rates.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Interval {
    /// Lower end, at least 0.
    pub low: f64,
    /// Upper end, at most 1.
    pub high: f64,
}

impl Interval {
    /// Whether a rate lies inside, ends included.
    pub fn contains(&self, rate: f64) -> bool {
        self.low <= rate && rate <= self.high
    }
}

/// Two-sided confidence interval of a rate of which `successes` in `trials` were seen; `confidence` such as 0.95.
///
/// `None` without trials, with more successes than trials, or with a confidence outside of (0, 1).
pub fn wilson_interval(successes: usize, trials: usize, confidence: f64) -> Option<Interval> {
    if trials == 0 || successes > trials || !(confidence > 0.0 && confidence < 1.0) {
        return None;
    }
    let z = std::f64::consts::SQRT_2 * erf_inv(confidence);
    let (s, n) = (successes as f64, trials as f64);
    let half_width = z * (s * (n - s) / n + 0.25 * z * z).sqrt();
    let centre = s + 0.5 * z * z;
    let end = |numerator: f64| (numerator / (n + z * z)).clamp(0.0, 1.0);
    // At the two extremes an end is exactly 0 or 1, which rounding would miss.
    let low = if successes == 0 { 0.0 } else { end(centre - half_width) };
    let high = if successes == trials { 1.0 } else { end(centre + half_width) };
    Some(Interval { low, high })
}

/// The middle value, or the mean of the two middle ones; `None` of no values or with a NaN among them.
pub fn median(values: &[f64]) -> Option<f64> {
    if values.is_empty() || values.iter().any(|v| v.is_nan()) {
        return None;
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
    // Halves first: the sum of two large doubles may overflow. Equal values need no arithmetic, and
    // infinities of both signs would give NaN, which is no value.
    let middle = if low == high { low } else { 0.5 * low + 0.5 * high };
    (!middle.is_nan()).then_some(middle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_intervals() {
        // z = 1.959964 at 95 %: (3.8415/2 ± …)/(n + 3.8415)
        let none = wilson_interval(0, 10, 0.95).unwrap();
        assert_eq!(none.low, 0.0);
        assert!((none.high - 3.841_458_820_694 / 13.841_458_820_694).abs() < 1e-9, "{none:?}");
        let half = wilson_interval(50, 100, 0.95).unwrap();
        assert!((half.low - 0.403_831_5).abs() < 1e-6 && (half.high - 0.596_168_5).abs() < 1e-6, "{half:?}");
        let all = wilson_interval(7, 7, 0.99).unwrap();
        assert_eq!(all.high, 1.0);
        assert!(all.contains(0.9) && !all.contains(0.1));
    }

    #[test]
    fn senseless_questions() {
        assert_eq!(wilson_interval(0, 0, 0.95), None);
        assert_eq!(wilson_interval(2, 1, 0.95), None);
        for confidence in [0.0, 1.0, f64::NAN] {
            assert_eq!(wilson_interval(1, 2, confidence), None);
        }
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[1.0, f64::NAN]), None);
        assert_eq!(median(&[f64::NEG_INFINITY, f64::INFINITY]), None);
    }

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[f64::MAX, f64::MAX]), Some(f64::MAX));
        assert_eq!(median(&[f64::NEG_INFINITY, f64::NEG_INFINITY]), Some(f64::NEG_INFINITY));
    }

    proptest! {
        #[test]
        fn interval_holds_the_rate(n in 1_usize..100_000, share in 0.0..=1.0, confidence in 0.01..0.9999) {
            let s = (share * n as f64) as usize;
            let interval = wilson_interval(s, n, confidence).unwrap();
            prop_assert!(interval.contains(s as f64 / n as f64));
            prop_assert!(0.0 <= interval.low && interval.high <= 1.0);
        }
    }
}
