//! The price of choosing: the best of k tests counts k-fold (Bonferroni).
//!
//! ```text
//! log10 p' = min(0, log10 p + log10 k)
//! ```
//!
//! The probability that at least one of k tests scores p by chance is at most k p, however the tests depend on each
//! other. The paper tries one; whoever tries several registrations or extractions pays here.

use libm::log;

use crate::LogProbability;

/// The best of several tests.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Selection {
    /// Which one it was.
    pub index: usize,
    /// Its probability, corrected for the choice.
    pub p: LogProbability,
}

/// `p`, the best of `k` tests, corrected for the choice. `k` counts every test made, also those forgotten
/// since; 0 counts as 1.
pub fn best_of(p: LogProbability, k: usize) -> LogProbability {
    LogProbability::from_ln(p.ln() + log(k.max(1) as f64))
}

/// Picks the smallest of `tests`, the first of equals, and corrects it for the choice; `None` of none.
pub fn select(tests: &[LogProbability]) -> Option<Selection> {
    let (index, best) = tests.iter().enumerate().min_by(|a, b| a.1.ln().total_cmp(&b.1.ln()))?;
    Some(Selection { index, p: best_of(*best, tests.len()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrects_and_caps() {
        let p = LogProbability::from_log10(-20.0);
        assert!((best_of(p, 100).log10() + 18.0).abs() < 1e-12);
        assert_eq!(best_of(p, 1), p);
        assert_eq!(best_of(p, 0), p);
        assert_eq!(best_of(LogProbability::from_p(0.5), 3), LogProbability::ONE);
        assert!((best_of(LogProbability::from_log10(-1e4), 10).log10() + 9999.0).abs() < 1e-9);
    }

    #[test]
    fn selects_the_smallest() {
        let tests = [-1.0, -7.0, -7.0, 0.0].map(LogProbability::from_log10);
        let best = select(&tests).unwrap();
        assert_eq!(best.index, 1);
        assert!((best.p.p() / 4e-7 - 1.0).abs() < 1e-12);
        assert_eq!(select(&[]), None);
    }
}
