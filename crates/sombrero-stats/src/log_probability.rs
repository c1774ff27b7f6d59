//! A probability stored as its natural logarithm.

use std::fmt;

use libm::{exp, log};

/// A probability p in (0, 1], kept as ln p so that it cannot underflow.
///
/// ln p is always finite and never positive. Ordering is that of the probabilities: the smallest is the
/// strongest evidence.
///
/// Shown as `0.034` down to a thousandth, then as `1.2e-17`, and as `10^-4321.5` where doubles end.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "Ln"))]
pub struct LogProbability {
    ln: f64,
}

/// What is read, before it is held to the limits.
#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct Ln {
    ln: f64,
}

#[cfg(feature = "serde")]
impl From<Ln> for LogProbability {
    fn from(Ln { ln }: Ln) -> Self {
        Self::from_ln(ln)
    }
}

impl LogProbability {
    /// Certainty: p = 1, "no evidence" as the result of a test.
    pub const ONE: Self = Self { ln: 0.0 };

    /// From ln p. A positive value or NaN becomes p = 1, the answer that claims nothing; -∞ becomes the
    /// smallest finite logarithm.
    pub fn from_ln(ln: f64) -> Self {
        if ln < 0.0 { Self { ln: ln.max(f64::MIN) } } else { Self::ONE }
    }

    /// From log10 p, with the limits of [`from_ln`](Self::from_ln).
    pub fn from_log10(log10: f64) -> Self {
        Self::from_ln(log10 * std::f64::consts::LN_10)
    }

    /// From p itself. Above 1 or NaN becomes 1; zero and below become the smallest finite logarithm.
    pub fn from_p(p: f64) -> Self {
        if p <= 0.0 { Self { ln: f64::MIN } } else { Self::from_ln(log(p)) }
    }

    /// ln p, finite and not above 0.
    pub fn ln(self) -> f64 {
        self.ln
    }

    /// log10 p, finite and not above 0.
    pub fn log10(self) -> f64 {
        self.ln / std::f64::consts::LN_10
    }

    /// p as a double: 0 once p is below the smallest one, near 10^-323.
    pub fn p(self) -> f64 {
        exp(self.ln)
    }
}

impl fmt::Display for LogProbability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let p = self.p();
        if p >= 1e-3 {
            f.pad(&format!("{p:.3}"))
        } else if p >= f64::MIN_POSITIVE {
            f.pad(&format!("{p:.1e}"))
        } else {
            f.pad(&format!("10^{:.1}", self.log10()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displays_all_ranges() {
        let show = |log10| LogProbability::from_log10(log10).to_string();
        assert_eq!(show(0.0), "1.000");
        assert_eq!(show(-1.5), "0.032");
        assert_eq!(show(-16.92), "1.2e-17");
        assert_eq!(show(-4321.5), "10^-4321.5");
        assert_eq!(format!("[{:>9}]", LogProbability::from_log10(-16.92)), "[  1.2e-17]");
    }

    #[test]
    fn stays_finite_and_in_range() {
        assert_eq!(LogProbability::from_ln(f64::NAN), LogProbability::ONE);
        assert_eq!(LogProbability::from_ln(0.1), LogProbability::ONE);
        assert_eq!(LogProbability::from_p(f64::NAN), LogProbability::ONE);
        assert!(LogProbability::from_ln(f64::NEG_INFINITY).ln().is_finite());
        assert!(LogProbability::from_log10(f64::NEG_INFINITY).log10().is_finite());
        assert!(LogProbability::from_p(0.0).log10() < -1e300);
        assert_eq!(LogProbability::from_log10(-1e4).p(), 0.0);
    }

    #[test]
    fn round_trips() {
        assert!((LogProbability::from_p(0.25).p() - 0.25).abs() < 1e-15);
        assert!((LogProbability::from_log10(-12345.0).log10() + 12345.0).abs() < 1e-11);
        assert!(LogProbability::from_log10(-20.0) < LogProbability::from_log10(-19.0));
    }
}
