//! The upper tail of Student's t distribution, in logarithms.
//!
//! The paper's section on analysis turns a correlation ρ of k pairs into the probability that independent Gaussian
//! numbers correlate as well, by a one-sided t test with ν = k - 2 degrees of freedom:
//!
//! ```text
//! t = ρ √(ν / (1 - ρ²)),   p = Pr[T_ν ≥ t] = ½ I_x(ν/2, ½)       for ρ ≥ 0
//!                                          = 1 - ½ I_x(ν/2, ½)   for ρ < 0
//! with x = ν / (ν + t²) = 1 - ρ²
//! ```
//!
//! I is the regularised incomplete beta function. Its continued fraction is of order one and is evaluated as it is
//! (modified Lentz); its power x^(ν/2), which underflows, stays a logarithm. The fraction for I_x(a, b) converges
//! fast for x < (a + 1)/(a + b + 2); beyond, I_x(a, b) = 1 - I_{1-x}(b, a), which costs at most a digit
//! here. Cost: some ten terms for the usual tens of pairs, O(√ν) near the border for huge ν.
//!
//! Only `libm` functions are called, so that machines agree to the last bit.

use libm::{exp, lgamma, log, log1p};
use thiserror::Error;

use crate::{Correlation, LogProbability};

/// 1 - ρ² counts as at least this, the square of the spacing of doubles at 1 (about 4.9e-32).
///
/// Two slices of doubles cannot be known to agree better: below, 1 - ρ is made of rounding alone. The floor keeps ln p
/// finite for identical slices, at about (ν/2) ln 4.9e-32, and it errs on the side of caution.
const GAP_FLOOR: f64 = f64::EPSILON * f64::EPSILON;

/// |t|/√ν counts as at most this, so that its square is a double.
const RATIO_CEILING: f64 = 1e150;

/// Why there is no tail probability.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StudentError {
    /// t is not a number.
    #[error("t is not a number")]
    NotANumber,
    /// The degrees of freedom are zero, negative, infinite or not a number.
    #[error("{degrees} degrees of freedom: a positive finite number is needed")]
    Degrees {
        /// The value.
        degrees: f64,
    },
}

/// The probability that k independent Gaussian pairs correlate at least as well as `correlation`, one-sided.
///
/// ρ = 0 gives ½, negative ρ more. ln p is right to 1e-10 of itself up to a million pairs, and finite for every ρ: 1 - ρ² counts as at least
/// 2⁻¹⁰⁴ (4.9e-32), the least that slices of doubles can show.
pub fn correlation_tail(correlation: &Correlation) -> LogProbability {
    let rho = correlation.rho();
    let degrees = (correlation.pairs() - 2) as f64;
    let x = correlation.one_minus_rho_squared().max(GAP_FLOOR);
    let y = rho * rho;
    let ln_x = if y < 0.5 { log1p(-y) } else { log(x) };
    tail(degrees, Argument { x, y, ln_x }, rho >= 0.0)
}

/// Pr[T ≥ t] for Student's distribution with ν = `degrees` degrees of freedom, ν > 0 and not necessarily an integer.
///
/// t is without unit; infinite t counts as 1e150 √ν, so that the logarithm is finite. It is right to 1e-10 of itself
/// for ν up to 10^6; beyond, the error near t = 2 grows like 1e-17 ν.
///
/// # Errors
///
/// When t is NaN, or ν is not a positive finite number.
pub fn student_tail(t: f64, degrees: f64) -> Result<LogProbability, StudentError> {
    if t.is_nan() {
        return Err(StudentError::NotANumber);
    }
    if !(degrees > 0.0 && degrees.is_finite()) {
        return Err(StudentError::Degrees { degrees });
    }
    let ratio = (t.abs() / degrees.sqrt()).min(RATIO_CEILING);
    let square = ratio * ratio;
    let x = 1.0 / (1.0 + square);
    let y = square / (1.0 + square);
    Ok(tail(degrees, Argument { x, y, ln_x: -log1p(square) }, t >= 0.0))
}

/// x in (0, 1], y = 1 - x and ln x, each without the rounding of the others.
#[derive(Clone, Copy)]
struct Argument {
    x: f64,
    y: f64,
    ln_x: f64,
}

fn tail(degrees: f64, at: Argument, upper: bool) -> LogProbability {
    let ln_half = ln_incomplete_beta(0.5 * degrees, at) - std::f64::consts::LN_2;
    LogProbability::from_ln(if upper { ln_half } else { log1p(-exp(ln_half)) })
}

/// ln I_x(a, ½).
fn ln_incomplete_beta(a: f64, at: Argument) -> f64 {
    let ln_power = a * at.ln_x + 0.5 * log(at.y) - ln_beta_half(a);
    if at.x < (a + 1.0) / (a + 2.5) {
        ln_power - log(a * beta_fraction(a, 0.5, at.x))
    } else {
        log1p(-exp(ln_power) / (0.5 * beta_fraction(0.5, a, at.y)))
    }
}

/// ln B(a, ½) = ln Γ(½) + ln Γ(a) - ln Γ(a + ½).
fn ln_beta_half(a: f64) -> f64 {
    // ln Γ(½) = ½ ln π
    0.5 * log(std::f64::consts::PI) - ln_gamma_half_step(a)
}

/// ln Γ(a + ½) - ln Γ(a).
fn ln_gamma_half_step(a: f64) -> f64 {
    if a < 20.0 {
        return lgamma(a + 0.5) - lgamma(a);
    }
    // Both logarithms grow like a ln a and their difference like ½ ln a, so for large a the difference
    // is taken from its asymptotic series; the first term left out is below 1e-16 at a = 20.
    let s = 1.0 / (a * a);
    let series =
        -1.0 / 8.0 + s * (1.0 / 192.0 + s * (-1.0 / 640.0 + s * (17.0 / 14336.0 - s * (31.0 / 18432.0))));
    0.5 * log(a) + series / a
}

/// 1 + d₁/(1 + d₂/(1 + …)), for which I_x(a, b) = x^a (1 - x)^b / (a B(a, b)) / fraction, where
///
/// ```text
/// d₂ₘ₊₁ = -(a + m)(a + b + m) x / ((a + 2m)(a + 2m + 1))
/// d₂ₘ   = m (b - m) x / ((a + 2m - 1)(a + 2m))
/// ```
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let term = |n: u32| {
        let m = f64::from(n / 2);
        let end = a + f64::from(n);
        let numerator = if n % 2 == 1 { -(a + m) * (a + b + m) } else { m * (b - m) };
        // For odd n = 2m + 1 the denominator (a + 2m)(a + 2m + 1) is (a + n - 1)(a + n), as for even n.
        numerator * x / ((end - 1.0) * end)
    };
    // Lentz divides by partial values that may pass through zero on their way.
    let away_from_zero = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut value, mut c, mut d) = (1.0, 1.0, 0.0);
    for n in 1..=TERMS {
        let term = term(n);
        d = 1.0 / away_from_zero(1.0 + term * d);
        c = away_from_zero(1.0 + term / c);
        value *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// Enough terms for 10^9 degrees of freedom at the slowest point; more terms would not help, see [`student_tail`].
const TERMS: u32 = 200_000;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    fn close(got: LogProbability, ln: f64) {
        let error = (got.ln() - ln).abs();
        assert!(error <= 1e-10 * ln.abs() + 1e-300, "ln p is {}, not {ln}: error {error:e}", got.ln());
    }

    /// ν = 2 and ν = 4 pairs have polynomial tails: ½(1 - ρ) and ¼(1 - ρ)²(2 + ρ); ν = 1 has asin(√(1 - ρ²))/π.
    #[test]
    fn closed_forms_of_the_correlation() {
        for exponent in 0..52 {
            let gap = libm::scalbn(0.7, -exponent);
            let rho = 1.0 - gap;
            let gap = 1.0 - rho; // what is left after rounding
            let tail = |pairs| correlation_tail(&Correlation::from_rho(rho, pairs).unwrap());
            close(tail(3), log(libm::asin((gap * (2.0 - gap)).sqrt()) / std::f64::consts::PI));
            close(tail(4), log(0.5 * gap));
            close(tail(6), 2.0 * log(gap) + log((2.0 + rho) / 4.0));
        }
    }

    /// For even ν = 2a the tail is that of a binomial: Σ_{j ≥ a} C(2a - 1, j) z^j (1 - z)^(2a-1-j), z = (1 - ρ)/2.
    #[test]
    fn binomial_sums_deep_in_the_tail() {
        for (a, rho) in [(24, 0.3), (24, 0.999), (24, 1.0 - 1e-13), (99, 0.9), (400, 0.5), (5000, 0.999)] {
            let n = 2 * a - 1;
            let z = 0.5 * (1.0 - rho);
            // Ratios to the first term, whose binomial coefficient is a product.
            let ln_first: f64 = (1..=a).map(|i| log(f64::from(n - a + i) / f64::from(i))).sum::<f64>()
                + f64::from(a) * log(z)
                + f64::from(a - 1) * log1p(-z);
            let (mut sum, mut ratio) = (1.0, 1.0);
            for j in a..n {
                ratio *= f64::from(n - j) / f64::from(j + 1) * z / (1.0 - z);
                sum += ratio;
            }
            let got = correlation_tail(&Correlation::from_rho(rho, 2 * a as usize + 2).unwrap());
            close(got, ln_first + log(sum));
        }
    }

    #[test]
    fn closed_forms_of_t() {
        let pi = std::f64::consts::PI;
        for t in [1e-9, 0.1, 0.7, 1.0, 1.5, 3.0, 1e3, 1e8, 1e60] {
            close(student_tail(t, 1.0).unwrap(), log(libm::atan(1.0 / t) / pi));
            close(student_tail(-t, 1.0).unwrap(), log1p(-libm::atan(1.0 / t) / pi));
            let s = 2.0 + t * t;
            close(student_tail(t, 2.0).unwrap(), log(1.0 / (s * (1.0 + t / s.sqrt()))));
        }
    }

    #[test]
    fn agrees_with_statrs() {
        for degrees in [1.0, 2.0, 3.0, 5.0, 10.0, 28.5, 48.0, 98.0, 200.0] {
            let reference = StudentsT::new(0.0, 1.0, degrees).unwrap();
            for step in 1..160 {
                let t = 0.125 * f64::from(step);
                let sf = reference.sf(t);
                let got = student_tail(t, degrees).unwrap().ln();
                // Where statrs has taken 1 - (1 - p) it has fewer digits than we.
                assert!((got - sf.ln()).abs() < 1e-10 * sf.ln().abs(), "{degrees} {t}: {got} {}", sf.ln());
            }
        }
    }

    #[test]
    fn both_doors_lead_to_the_same_room() {
        for rho in [-0.999, -0.5, -0.01, 0.0, 0.01, 0.3, 0.8, 0.9999] {
            for pairs in [3, 4, 7, 50, 1000] {
                let nu = (pairs - 2) as f64;
                let t = rho * (nu / ((1.0 - rho) * (1.0 + rho))).sqrt();
                let got = correlation_tail(&Correlation::from_rho(rho, pairs).unwrap());
                close(got, student_tail(t, nu).unwrap().ln());
            }
        }
    }

    #[test]
    fn finite_everywhere() {
        let same = Correlation::from_rho(1.0, 50).unwrap();
        let log10 = correlation_tail(&same).log10();
        // (24 ln 2^-104 + ln of a factor near 1/30) / ln 10
        assert!((-753.5..-752.0).contains(&log10), "{log10}");
        let opposite = Correlation::from_rho(-1.0, 50).unwrap();
        assert_eq!(correlation_tail(&opposite), LogProbability::ONE);
        let deep = correlation_tail(&Correlation::from_rho(1.0 - 1e-12, 2000).unwrap()).log10();
        assert!(deep < -10_000.0 && deep.is_finite());
        for nu in [1e-3, 1.0, 48.0, 1e9] {
            for t in [f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 0.0, -0.0, 1.0] {
                assert!(student_tail(t, nu).unwrap().ln().is_finite());
            }
        }
        assert!((student_tail(0.0, 7.0).unwrap().p() - 0.5).abs() < 1e-15);
    }

    /// With many degrees of freedom the distribution is Gaussian: Pr[Z ≥ 3] and Pr[Z ≥ 1.5].
    #[test]
    fn gaussian_limit() {
        for (t, p) in [(3.0, 1.349898031630095e-3), (1.5, 6.680720126885807e-2)] {
            assert!((student_tail(t, 1e9).unwrap().p() / p - 1.0).abs() < 1e-7);
        }
    }

    #[test]
    fn golden_values() {
        let log10 = |rho, pairs| correlation_tail(&Correlation::from_rho(rho, pairs).unwrap()).log10();
        for (rho, pairs, expected) in GOLDEN {
            assert!(
                (log10(rho, pairs) / expected - 1.0_f64).abs() < 1e-12,
                "{rho} {pairs}: {}",
                log10(rho, pairs)
            );
        }
    }

    /// From the binomial sum above in exact rational arithmetic.
    const GOLDEN: [(f64, usize, f64); 4] = [
        (0.5, 50, -3.962_548_657_616_282_6),
        (0.9375, 50, -23.220_211_087_083_17),
        (0.996_093_75, 102, -106.801_460_845_471_18),
        (-0.25, 50, -0.017_717_399_534_165_186),
    ];

    #[test]
    fn half_step_of_gamma_is_continuous() {
        for a in [19.5, 19.999, 20.0, 25.0, 60.0] {
            assert!((ln_gamma_half_step(a) - (lgamma(a + 0.5) - lgamma(a))).abs() < 2e-13);
        }
        // The exact step from a to a + 1 is ln a, in two halves.
        for a in [20.0, 33.5, 1e4, 1e8] {
            assert!((ln_gamma_half_step(a) + ln_gamma_half_step(a + 0.5) - log(a)).abs() < 1e-14 * log(a));
        }
    }

    #[test]
    fn senseless_questions() {
        assert_eq!(student_tail(f64::NAN, 3.0), Err(StudentError::NotANumber));
        assert!(student_tail(1.0, 0.0).is_err());
        assert!(student_tail(1.0, f64::NAN).is_err());
        assert!(student_tail(1.0, f64::INFINITY).is_err());
    }

    proptest! {
        #[test]
        fn falls_with_rho(a in -1.0..1.0, b in -1.0..1.0, pairs in 3_usize..300) {
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            prop_assume!(high - low > 1e-9);
            let tail = |rho| correlation_tail(&Correlation::from_rho(rho, pairs).unwrap());
            prop_assert!(tail(high) <= tail(low));
        }

        #[test]
        fn both_tails_sum_to_one(rho in -1.0..1.0, pairs in 3_usize..300) {
            let p = |rho| correlation_tail(&Correlation::from_rho(rho, pairs).unwrap()).p();
            prop_assert!((p(rho) + p(-rho) - 1.0).abs() < 1e-13);
        }

        #[test]
        fn any_bits_are_answered(t in any::<f64>(), degrees in 1e-300..1e8) {
            if let Ok(p) = student_tail(t, degrees) {
                prop_assert!(p.ln().is_finite());
            }
        }
    }
}
