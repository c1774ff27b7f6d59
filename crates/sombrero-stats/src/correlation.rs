//! Pearson's correlation, with its distances from 1 and -1 to full relative precision.
//!
//! With a and b centred and â = a/‖a‖, b̂ = b/‖b‖ (the paper's section on analysis):
//!
//! ```text
//! ρ     = â · b̂ = Σ aᵢ bᵢ / (‖a‖ ‖b‖)
//! 1 - ρ = ½ ‖â - b̂‖²
//! 1 + ρ = ½ ‖â + b̂‖²
//! ```
//!
//! The t test needs 1 - ρ² = (1 - ρ)(1 + ρ). Where the watermark was found almost untouched, ρ rounds to 1 and the
//! textbook formula loses every digit, while the squared difference of two nearly equal unit vectors keeps
//! them: an error δ in either norm enters as δ², not as δ.
//!
//! Next to 1 even those digits run out, since each â and b̂ is rounded by itself. There the line through the pairs is fitted,
//! and what it leaves is summed up,
//!
//! ```text
//! 1 - ρ² = Σ (bᵢ - α - β aᵢ)² / ‖b‖²   with β = a · b / ‖a‖², α such that the sum of the residuals is 0
//! ```
//!
//! with the rounding of each product and sum carried along (Dekker, Numer. Math. 18, 1971) and the fit repeated on the
//! residuals: all digits that the values have. Cost: a few passes over the data.

use libm::{fma, ilogb, scalbn};
use thiserror::Error;

/// Nearer to 1 than this ρ is computed from residuals: rounding takes the digits beyond the eleventh of a larger gap.
const NEAR: f64 = 1e-10;

/// Pearson's correlation ρ of k pairs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Correlation {
    rho: f64,
    one_minus: f64,
    one_plus: f64,
    pairs: usize,
}

/// One of two slices that an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The first argument.
    First,
    /// The second argument.
    Second,
}

/// Why there is no correlation.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CorrelationError {
    /// The slices do not pair up.
    #[error("cannot pair {first} values with {second}")]
    Lengths {
        /// Length of the first slice.
        first: usize,
        /// Length of the second slice.
        second: usize,
    },
    /// Two points always lie on a line, so that fewer than three pairs say nothing.
    #[error("{pairs} pairs are too few: a correlation needs three")]
    TooFew {
        /// How many pairs there were.
        pairs: usize,
    },
    /// A value is infinite or not a number.
    #[error("value {index} of the {side:?} slice is not finite")]
    NotFinite {
        /// The slice that holds it.
        side: Side,
        /// Its place there.
        index: usize,
    },
    /// All values of a slice are the same, which leaves ρ = 0/0.
    #[error("all values of the {side:?} slice are equal")]
    Constant {
        /// The slice without variance.
        side: Side,
    },
    /// A given ρ is outside of [-1, 1] or not a number.
    #[error("{rho} is no correlation: it must lie between -1 and 1")]
    OutOfRange {
        /// The value.
        rho: f64,
    },
}

impl Correlation {
    /// Correlates two slices of equal length k ≥ 3; units cancel.
    ///
    /// # Errors
    ///
    /// When lengths differ, there are fewer than three pairs, a value is not finite, or a slice is constant.
    pub fn of(first: &[f64], second: &[f64]) -> Result<Self, CorrelationError> {
        if first.len() != second.len() {
            return Err(CorrelationError::Lengths { first: first.len(), second: second.len() });
        }
        if first.len() < 3 {
            return Err(CorrelationError::TooFew { pairs: first.len() });
        }
        let a = centred_unit(first, Side::First)?;
        let b = centred_unit(second, Side::Second)?;
        let correlation = Self::of_unit_vectors(&a, &b);
        let gap = correlation.one_minus.min(correlation.one_plus);
        Ok(if gap < NEAR { correlation.with_residuals(first, second) } else { correlation })
    }

    /// From a value of ρ in [-1, 1]; 1 - ρ then has only the digits that ρ has.
    ///
    /// # Errors
    ///
    /// When `rho` is outside of [-1, 1], or `pairs` is below three.
    pub fn from_rho(rho: f64, pairs: usize) -> Result<Self, CorrelationError> {
        if pairs < 3 {
            return Err(CorrelationError::TooFew { pairs });
        }
        if !(-1.0..=1.0).contains(&rho) {
            return Err(CorrelationError::OutOfRange { rho });
        }
        Ok(Self { rho, one_minus: 1.0 - rho, one_plus: 1.0 + rho, pairs })
    }

    fn of_unit_vectors(a: &[f64], b: &[f64]) -> Self {
        let pairs = a.len();
        let sum = |term: fn(f64, f64) -> f64| a.iter().zip(b).map(|(&x, &y)| term(x, y)).sum::<f64>();
        let rho = sum(|x, y| x * y).clamp(-1.0, 1.0);
        // The small one of the two gaps is measured; the other is near 2 and follows from it.
        if rho >= 0.0 {
            let gap = (0.5 * sum(|x, y| (x - y) * (x - y))).min(1.0);
            Self { rho, one_minus: gap, one_plus: 2.0 - gap, pairs }
        } else {
            let gap = (0.5 * sum(|x, y| (x + y) * (x + y))).min(1.0);
            Self { rho, one_minus: 2.0 - gap, one_plus: gap, pairs }
        }
    }

    /// The same with the small one of the two gaps from the residuals of a fitted line.
    fn with_residuals(self, first: &[f64], second: &[f64]) -> Self {
        let sign = if self.rho < 0.0 { -1.0 } else { 1.0 };
        let (a, mut b) = (near_one(first), near_one(second));
        b.iter_mut().for_each(|x| *x *= sign);
        let rest = unexplained(&a, &b);
        let gap = rest / (1.0 + (1.0 - rest).sqrt());
        let (one_minus, one_plus) = if sign > 0.0 { (gap, 2.0 - gap) } else { (2.0 - gap, gap) };
        Self { one_minus, one_plus, ..self }
    }

    /// ρ in [-1, 1].
    pub fn rho(&self) -> f64 {
        self.rho
    }

    /// 1 - ρ in [0, 2], precise where ρ is near 1.
    pub fn one_minus_rho(&self) -> f64 {
        self.one_minus
    }

    /// 1 + ρ in [0, 2], precise where ρ is near -1.
    pub fn one_plus_rho(&self) -> f64 {
        self.one_plus
    }

    /// 1 - ρ² in [0, 1], precise at both ends.
    pub fn one_minus_rho_squared(&self) -> f64 {
        (self.one_minus * self.one_plus).min(1.0)
    }

    /// How many pairs were correlated, at least three.
    pub fn pairs(&self) -> usize {
        self.pairs
    }
}

/// 1 - ρ² of values that lie nearly on a line: the share of ‖b‖² that the line does not explain.
fn unexplained(a: &[f64], b: &[f64]) -> f64 {
    let centred = |values: &[f64]| {
        let mut values = values.to_vec();
        subtract_mean(&mut values);
        values
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let (a0, b0) = (centred(a), centred(b));
    let slope = dot(&a0, &b0) / dot(&a0, &a0);
    let shift = mean(b) - slope * mean(a);
    let residual = |(&x, &y): (&f64, &f64)| {
        let product = slope * x;
        let product_rounding = fma(slope, x, -product);
        let difference = y - product;
        // Knuth's exact sum of two numbers.
        let back = difference - y;
        let difference_rounding = (y - (difference - back)) - (product + back);
        (difference - shift) + (difference_rounding - product_rounding)
    };
    let mut rest: Vec<f64> = a.iter().zip(b).map(residual).collect();
    // What rounding left of the line.
    subtract_mean(&mut rest);
    let slope = dot(&rest, &a0) / dot(&a0, &a0);
    rest.iter_mut().zip(&a0).for_each(|(rest, a)| *rest -= slope * a);
    (dot(&rest, &rest) / dot(&b0, &b0)).min(1.0)
}

/// The values less their mean, at length one.
fn centred_unit(values: &[f64], side: Side) -> Result<Vec<f64>, CorrelationError> {
    if let Some(index) = values.iter().position(|x| !x.is_finite()) {
        return Err(CorrelationError::NotFinite { side, index });
    }
    if values.iter().all(|x| *x == values[0]) {
        return Err(CorrelationError::Constant { side });
    }
    let mut a = near_one(values);
    // The second pass takes away what rounding left of the mean in the first.
    subtract_mean(&mut a);
    subtract_mean(&mut a);
    // Once more, so that the squares of a tiny spread do not underflow.
    let mut a = near_one(&a);
    let norm = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    a.iter_mut().for_each(|x| *x /= norm);
    Ok(a)
}

/// The values times the power of two that brings the largest between 1 and 2: exact, and no sum overflows.
fn near_one(values: &[f64]) -> Vec<f64> {
    let largest = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let exponent = if largest > 0.0 { ilogb(largest) } else { 0 };
    values.iter().map(|&x| scalbn(x, -exponent)).collect()
}

fn subtract_mean(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|x| *x -= mean);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_value() {
        // Centred: (-2, -1, 0, 1, 2) and (-2, 0, -1, 2, 1): dot 8, squared norms 10 and 10.
        let r = Correlation::of(&[1.0, 2.0, 3.0, 4.0, 5.0], &[1.0, 3.0, 2.0, 5.0, 4.0]).unwrap();
        assert!((r.rho() - 0.8).abs() < 1e-15);
        assert!((r.one_minus_rho() - 0.2).abs() < 1e-15);
        assert!((r.one_plus_rho() - 1.8).abs() < 1e-15);
        assert_eq!(r.pairs(), 5);
    }

    /// b = a + εz with z centred, of a's length and at right angles to it: ρ = 1/√(1 + ε²), so 1 - ρ ≈ ε²/2.
    #[test]
    fn digits_survive_next_to_one() {
        let a = [1.0, -1.0, 1.0, -1.0];
        let z = [1.0, 1.0, -1.0, -1.0];
        for exponent in 5..=50 {
            let epsilon = scalbn(1.0, -exponent);
            let b: Vec<f64> = a.iter().zip(z).map(|(a, z)| a + epsilon * z).collect();
            let e2 = epsilon * epsilon;
            let root = (1.0 + e2).sqrt();
            let expected = e2 / (root * (1.0 + root));
            let near = Correlation::of(&a, &b).unwrap();
            assert!((near.one_minus_rho() / expected - 1.0).abs() < 1e-9, "{exponent}: {near:?}");
            let opposite: Vec<f64> = b.iter().map(|x| -x).collect();
            let far = Correlation::of(&a, &opposite).unwrap();
            assert_eq!(far.one_plus_rho(), near.one_minus_rho());
            assert_eq!(far.one_minus_rho_squared(), near.one_minus_rho_squared());
        }
    }

    /// Nearly a line with the values of the test below, and 1 - ρ².
    const GOLDEN: [([f64; 6], f64); 5] = [
        (
            [0.1000003, 0.6999989, -0.29999909999999996, 2.2000002000000003, -1.8999993, 0.4499992],
            2.987648326047643e-13,
        ),
        (
            [
                0.10000000000003001,
                0.6999999999998899,
                -0.29999999999991,
                2.20000000000002,
                -1.89999999999993,
                0.44999999999992,
            ],
            2.9873726833470824e-27,
        ),
        (
            [
                0.10000000000000091,
                0.6999999999999966,
                -0.29999999999999727,
                2.2000000000000006,
                -1.899999999999998,
                0.4499999999999976,
            ],
            2.636570530811394e-30,
        ),
        (
            [
                5.1000000000003,
                5.699999999998901,
                4.7000000000009,
                7.2000000000002,
                3.1000000000007,
                5.4499999999992,
            ],
            2.9857795588625768e-25,
        ),
        (
            [
                -0.16999999999999701,
                0.009999999999988981,
                -0.28999999999999104,
                0.460000000000002,
                -0.769999999999993,
                -0.065000000000008,
            ],
            3.3040615892778373e-28,
        ),
    ];

    /// 1 - ρ² in exact fractions of the same doubles.
    #[test]
    fn digits_survive_where_unit_vectors_are_rounded() {
        let a = [0.1, 0.7, -0.3, 2.2, -1.9, 0.45];
        for (b, exact) in GOLDEN {
            for sign in [1.0, -1.0] {
                let b = b.map(|x| sign * x);
                let rest = Correlation::of(&a, &b).unwrap().one_minus_rho_squared();
                assert!((rest / exact - 1.0).abs() < 1e-12, "{rest:e} {exact:e}");
            }
        }
    }

    #[test]
    fn a_vector_with_itself() {
        let a = [0.1, 0.7, -0.3, 2.2];
        let r = Correlation::of(&a, &a).unwrap();
        assert_eq!((r.one_minus_rho(), r.one_plus_rho()), (0.0, 2.0));
    }

    #[test]
    fn extreme_sizes() {
        let big = [f64::MAX, -f64::MAX, 0.0, f64::MAX];
        let tiny = [f64::from_bits(2), 0.0, f64::from_bits(1), f64::from_bits(2)];
        let r = Correlation::of(&big, &tiny).unwrap();
        let plain = Correlation::of(&[1.0, -1.0, 0.0, 1.0], &[2.0, 0.0, 1.0, 2.0]).unwrap();
        assert!((r.rho() - plain.rho()).abs() < 1e-15);
    }

    #[test]
    fn senseless_questions() {
        let a = [1.0, 2.0, 4.0];
        assert_eq!(Correlation::of(&a, &a[1..]), Err(CorrelationError::Lengths { first: 3, second: 2 }));
        assert_eq!(Correlation::of(&a[1..], &a[1..]), Err(CorrelationError::TooFew { pairs: 2 }));
        assert_eq!(Correlation::of(&[], &[]), Err(CorrelationError::TooFew { pairs: 0 }));
        let constant = Err(CorrelationError::Constant { side: Side::Second });
        assert_eq!(Correlation::of(&a, &[0.1; 3]), constant);
        let nan = Err(CorrelationError::NotFinite { side: Side::First, index: 1 });
        assert_eq!(Correlation::of(&[0.0, f64::NAN, 1.0], &a), nan);
        assert_eq!(Correlation::from_rho(1.5, 9), Err(CorrelationError::OutOfRange { rho: 1.5 }));
        assert!(Correlation::from_rho(f64::NAN, 9).is_err());
        assert!(Correlation::from_rho(0.5, 2).is_err());
    }

    fn pairs() -> impl Strategy<Value = Vec<(f64, f64)>> {
        proptest::collection::vec((-3.0..3.0, -3.0..3.0), 3..40)
    }

    proptest! {
        #[test]
        fn shift_and_scale_change_nothing(pairs in pairs(), shift in -10.0..10.0, scale in 0.01..100.0) {
            let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let moved: Vec<f64> = a.iter().map(|x| shift + scale * x).collect();
            let mirrored: Vec<f64> = a.iter().map(|x| shift - scale * x).collect();
            let r = Correlation::of(&a, &b).unwrap();
            prop_assert!((Correlation::of(&moved, &b).unwrap().rho() - r.rho()).abs() < 1e-9);
            prop_assert!((Correlation::of(&mirrored, &b).unwrap().rho() + r.rho()).abs() < 1e-9);
        }

        #[test]
        fn symmetric_and_consistent(pairs in pairs()) {
            let (a, b): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            let r = Correlation::of(&a, &b).unwrap();
            prop_assert_eq!(r, Correlation::of(&b, &a).unwrap());
            prop_assert!((r.one_minus_rho() - (1.0 - r.rho())).abs() < 1e-14);
            prop_assert!((r.one_plus_rho() - (1.0 + r.rho())).abs() < 1e-14);
        }

        #[test]
        fn any_bits_are_answered(bits in proptest::collection::vec((any::<f64>(), any::<f64>()), 0..8)) {
            let (a, b): (Vec<f64>, Vec<f64>) = bits.into_iter().unzip();
            if let Ok(r) = Correlation::of(&a, &b) {
                prop_assert!((-1.0..=1.0).contains(&r.rho()));
                prop_assert!((0.0..=1.0).contains(&r.one_minus_rho_squared()));
            }
        }
    }
}
