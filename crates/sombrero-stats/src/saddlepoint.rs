//! The saddlepoint value of the lower tail of X = Σ λ_k (g_k - c_k)², in logarithms.
//!
//! It is that of Lugannani and Rice (Adv. Appl. Prob. 12, 1980), which Kuonen (Biometrika 86, 1999) recommends for
//! quadratic forms, there in its variant by Barndorff-Nielsen. With s such that x is the mean M(s) of X tilted by
//! exp(-s X) (`quadratic_form.rs`; negative for x beyond the mean), y_k = 2 s λ_k, a² = -2 (s x + ln E exp(-s X)),
//! b² = -s² M'(s) and both roots of the sign of s,
//!
//! ```text
//! Pr[X ≤ x] ≈ Φ(-a) + φ(a) (1/b - 1/a) = φ(a) [R(a) + 1/b - 1/a],   R(a) = Φ(-a)/φ(a), Mills' ratio
//! ```
//!
//! As it stands this underflows in the tail and is ∞ - ∞ at the mean. In z = y/(1 + y) everything is a sum of terms
//! of one sign:
//!
//! ```text
//! a²      = Σ [-ln(1 - z) - z]        + c² z²
//! b²      = Σ z²/2                    + c² z² (1 - z)
//! a² - b² = Σ [-ln(1 - z) - z - z²/2] + c² z³
//! 1/b - 1/a = (a² - b²) / (a b (a + b))
//! ```
//!
//! The difference then keeps its digits through the mean (its limit is a sixth of the skewness of X) and is never
//! negative, so that ln p = -a²/2 - ½ ln 2π + ln[R(a) + 1/b - 1/a] needs no special case.
//!
//! Only `libm` functions are called, so that machines agree to the last bit.

use libm::{erfc, exp, log, log1p, sqrt};

use crate::LogProbability;

/// ½ ln 2π.
const HALF_LN_TWO_PI: f64 = 0.918_938_533_204_672_8;

/// An s near 0 gives the limit at the mean.
pub(crate) fn away_from_mean(tilt: f64) -> f64 {
    if tilt.abs() < 1e-40 { 1e-40 } else { tilt }
}

/// The quantities of the formula at one s.
pub(crate) struct Exponents {
    pub(crate) a_squared: f64,
    b_squared: f64,
    /// a² - b².
    difference: f64,
}

impl Exponents {
    /// From pairs (y, c²), one for each direction.
    pub(crate) fn new(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut sum = Self { a_squared: 0.0, b_squared: 0.0, difference: 0.0 };
        for (y, shift) in pairs {
            let shrink = 1.0 / (1.0 + y);
            let z = y * shrink;
            let (square, remainder) = (z * z, log_remainder(z, shrink));
            sum.a_squared += remainder + (0.5 + shift) * square;
            sum.b_squared += (0.5 + shift * shrink) * square;
            sum.difference += remainder + shift * square * z;
        }
        sum
    }

    /// ln Pr[X ≤ x]; `below` tells whether x is below the mean, which is where s is positive.
    pub(crate) fn lugannani_rice(&self, below: bool) -> LogProbability {
        let Self { a_squared, b_squared, difference } = *self;
        let (a, b) = (sqrt(a_squared), sqrt(b_squared));
        let correction = (difference / (a * b * (a + b))).abs();
        let ln_density = -0.5 * a_squared - HALF_LN_TWO_PI;
        if below {
            LogProbability::from_ln(ln_density + log(mills_ratio(a) + correction))
        } else {
            LogProbability::from_ln(log1p(-exp(ln_density) * (mills_ratio(a) - correction)))
        }
    }
}

/// -ln(1 - z) - z - z²/2 with 1 - z given too: Σ z^j/j from j = 3.
fn log_remainder(z: f64, one_minus: f64) -> f64 {
    if z.abs() > 0.2 {
        return -log(one_minus) - z - 0.5 * z * z;
    }
    // 0.2^22 is below the rounding of the first term.
    let series = (3..=25).rev().fold(0.0, |sum, j| sum * z + 1.0 / f64::from(j));
    series * z * z * z
}

/// R(a) = Φ(-a)/φ(a) for a ≥ 0; beyond 25 by its asymptotic series, right to 1e-13 there.
fn mills_ratio(a: f64) -> f64 {
    if a < 25.0 {
        // √(π/2)
        1.253_314_137_315_500_3 * exp(0.5 * a * a) * erfc(a * std::f64::consts::FRAC_1_SQRT_2)
    } else {
        let q = 1.0 / (a * a);
        (1.0 - q * (1.0 - 3.0 * q * (1.0 - 5.0 * q * (1.0 - 7.0 * q)))) / a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mills_ratio_is_continuous() {
        let (near, far) = (mills_ratio(25.0 - 1e-12), mills_ratio(25.0));
        assert!((near / far - 1.0).abs() < 1e-11, "{}", near / far - 1.0);
        assert!((mills_ratio(0.0) - 1.253_314_137_315_5).abs() < 1e-13);
        for z in [-0.2_f64, 0.2] {
            let (series, direct) = (log_remainder(z, 1.0 - z), -(1.0 - z).ln() - z - 0.5 * z * z);
            assert!((series / direct - 1.0).abs() < 1e-12);
        }
    }
}
