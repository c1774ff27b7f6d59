//! One estimate from those of parts that were placed one by one.
//!
//! Each part c gives w*_c and its precision P_c of the functions that reach it, with its own motion solved for. Their errors are
//! independent, so what they know adds up:
//!
//! ```text
//! P = Σ_c S_cᵀ P_c S_c,    P w* = Σ_c S_cᵀ P_c w*_c,    S_c picks the functions of part c
//! ```
//!
//! Parts may be known to very different accuracy, so the solution is one in units in which P has a unit diagonal.

use crate::answer::Answer;
use crate::extractor::Estimate;
use nalgebra::{DMatrix, DVector, Point3};

impl Estimate {
    /// The estimate of `coefficients` numbers that those of some parts make together: for each part the functions that it knows
    /// of, and what it says of them. `positions` and `present` are for all vertices of the original.
    ///
    /// # Panics
    /// When a part names a function that is not there, or not one for each of its coefficients.
    pub fn pooled(
        coefficients: usize,
        parts: &[(&[usize], &Self)],
        positions: Vec<Point3<f64>>,
        present: Vec<bool>,
    ) -> Self {
        let mut precision = DMatrix::zeros(coefficients, coefficients);
        let mut score = DVector::zeros(coefficients);
        for (functions, part) in parts {
            assert_eq!(functions.len(), part.coefficients.len(), "a function for each coefficient");
            let known = &part.precision * DVector::from_column_slice(&part.coefficients);
            for (i, &row) in functions.iter().enumerate() {
                score[row] += known[i];
                for (j, &column) in functions.iter().enumerate() {
                    precision[(row, column)] += part.precision[(i, j)];
                }
            }
        }
        let Answer { coefficients, errors, precision } = Answer::in_own_units(precision, score);
        let mean = |value: fn(&Self) -> f64| {
            parts.iter().map(|(_, part)| value(part)).sum::<f64>() / parts.len().max(1) as f64
        };
        Self {
            coefficients,
            standard_errors: errors,
            precision,
            positions,
            present,
            residual_rms: mean(|part| part.residual_rms * part.residual_rms).sqrt(),
            used: mean(|part| part.used),
            iterations: parts.iter().map(|(_, part)| part.iterations).max().unwrap_or(0),
            converged: parts.iter().all(|(_, part)| part.converged),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(coefficients: &[f64], precision: DMatrix<f64>) -> Estimate {
        let error = |p: &f64| if *p > 0.0 { 1.0 / p.sqrt() } else { f64::INFINITY };
        Estimate {
            coefficients: coefficients.to_vec(),
            standard_errors: precision.diagonal().iter().map(error).collect(),
            precision,
            positions: Vec::new(),
            present: Vec::new(),
            residual_rms: 0.5,
            used: 1.0,
            iterations: 3,
            converged: true,
        }
    }

    #[test]
    fn what_two_parts_know_of_a_function_is_weighed_by_precision() {
        let a = part(&[1.0, 0.5], DMatrix::from_diagonal(&DVector::from_vec(vec![3.0, 1.0])));
        let b = part(&[2.0], DMatrix::identity(1, 1));
        let both = Estimate::pooled(4, &[(&[0, 2], &a), (&[0], &b)], Vec::new(), Vec::new());
        // (3 · 1 + 1 · 2) / 4 at the function that both know.
        for (found, right) in both.coefficients.iter().zip([1.25, 0.0, 0.5, 0.0]) {
            assert!((found - right).abs() < 1e-12, "{:?}", both.coefficients);
        }
        assert!((both.precision[(0, 0)] - 4.0).abs() < 1e-12 && both.precision[(1, 1)] == 0.0);
        assert!((both.standard_errors[0] - 0.5).abs() < 1e-12);
        assert_eq!(both.known().iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true, false]);
    }

    #[test]
    fn a_part_that_is_known_by_far_better_does_not_hide_the_others() {
        let exact = part(&[-0.7], DMatrix::identity(1, 1) * 1e12);
        let rough = part(&[0.3, 1.1], DMatrix::from_row_slice(2, 2, &[2.0, 0.5, 0.5, 1.0]));
        let both = Estimate::pooled(3, &[(&[1], &exact), (&[0, 2], &rough)], Vec::new(), Vec::new());
        for (found, right) in both.coefficients.iter().zip([0.3, -0.7, 1.1]) {
            assert!((found - right).abs() < 1e-9, "{:?}", both.coefficients);
        }
        assert!((both.precision[(0, 2)] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn no_part_knows_nothing() {
        let none = Estimate::pooled(2, &[], Vec::new(), Vec::new());
        assert_eq!(none.known(), [None, None]);
        assert_eq!(none.precision, DMatrix::zeros(2, 2));
    }
}
