//! Cholesky factors of symmetric matrices of which each row is stored from its first entry to the diagonal
//! (Jennings 1966). No pattern has to be found beforehand, and all work is products of consecutive numbers.
//!
//! Sums run in an order that is written down here, eight at a time: the same bits on every machine.

use rayon::prelude::*;

/// The lower triangle of a symmetric matrix.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    /// The column of each row's first entry.
    first: Vec<usize>,
    /// Where each row starts in `values`, and where the last one ends.
    starts: Vec<usize>,
    values: Vec<f64>,
}

impl Envelope {
    /// Zeros, with row i reaching from column `first[i]` to i.
    pub(crate) fn zeros(first: Vec<usize>) -> Self {
        let mut starts = vec![0];
        for (i, &f) in first.iter().enumerate() {
            starts.push(starts[i] + i - f + 1);
        }
        let values = vec![0.0; starts[first.len()]];
        Self { first, starts, values }
    }

    pub(crate) fn len(&self) -> usize {
        self.first.len()
    }

    /// Adds to the entry in row `i` and column `j`, which must lie in the envelope.
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = (i.max(j), i.min(j));
        self.values[self.starts[i] + j - self.first[i]] += value;
    }

    pub(crate) fn diagonal(&self, i: usize) -> f64 {
        self.values[self.starts[i + 1] - 1]
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.values[self.starts[i]..self.starts[i + 1]]
    }

    /// L with L Lᵀ = self; rows without a positive pivot get one so large that they count for nothing.
    pub(crate) fn factor(mut self) -> Factor {
        for i in 0..self.len() {
            let first = self.first[i];
            let (done, rest) = self.values.split_at_mut(self.starts[i]);
            let row = &mut rest[..i - first + 1];
            for j in first..i {
                let start = self.first[j].max(first);
                let other = &done[self.starts[j] + start - self.first[j]..self.starts[j + 1]];
                let (before, pivot) = other.split_at(other.len() - 1);
                let sum = dot(&row[start - first..j - first], before);
                row[j - first] = (row[j - first] - sum) / pivot[0];
            }
            let (before, diagonal) = row.split_at_mut(i - first);
            let pivot = diagonal[0] - dot(before, before);
            diagonal[0] = if pivot > 1e-14 * diagonal[0].abs() { pivot.sqrt() } else { 1e150 };
        }
        Factor(self)
    }
}

/// A lower triangular matrix.
#[derive(Debug, Clone)]
pub(crate) struct Factor(Envelope);

impl Factor {
    /// x := L⁻¹ x.
    pub(crate) fn solve_lower(&self, x: &mut [f64]) {
        self.solve_lower_from(0, x);
    }

    /// The same for an x that is zero before `start`.
    fn solve_lower_from(&self, start: usize, x: &mut [f64]) {
        let l = &self.0;
        for i in start..l.len() {
            let (row, first) = (l.row(i), l.first[i]);
            // Eight sums at a time: eight zeros change none of them.
            let zeros = start.saturating_sub(first) / 8 * 8;
            let sum = dot(&row[zeros..row.len() - 1], &x[first + zeros..i]);
            x[i] = (x[i] - sum) / row[row.len() - 1];
        }
    }

    /// x := L⁻ᵀ x.
    pub(crate) fn solve_upper(&self, x: &mut [f64]) {
        let l = &self.0;
        for i in (0..l.len()).rev() {
            let row = l.row(i);
            let value = x[i] / row[row.len() - 1];
            x[i] = value;
            x[l.first[i]..i].iter_mut().zip(row).for_each(|(x, l)| *x -= value * l);
        }
    }
}

impl Factor {
    /// The diagonal of (L Lᵀ)⁻¹: squared lengths of the columns of L⁻¹.
    pub(crate) fn inverse_diagonal(&self) -> Vec<f64> {
        let n = self.0.len();
        let column = |i: usize| {
            let mut x = vec![0.0; n];
            x[i] = 1.0;
            self.solve_lower_from(i, &mut x);
            dot(&x[i..], &x[i..])
        };
        (0..n).into_par_iter().map(column).collect()
    }
}

/// Σ a_k b_k, as eight sums that are added up at the end.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_eights, a_rest) = a.as_chunks::<8>();
    let (b_eights, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a_eights.iter().zip(b_eights) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + b) + (c + d)) + ((e + f) + (g + h)) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn solves_what_a_dense_factor_solves() {
        let n = 60;
        let first: Vec<usize> = (0..n).map(|i: usize| i.saturating_sub(1 + (i * 7) % 13)).collect();
        let mut matrix = Envelope::zeros(first.clone());
        let mut dense = DMatrix::<f64>::zeros(n, n);
        for i in 0..n {
            for j in first[i]..=i {
                let value = if i == j { 30.0 } else { ((i * 31 + j * 17) % 11) as f64 / 5.0 - 1.0 };
                matrix.add(j, i, value);
                (dense[(i, j)], dense[(j, i)]) = (value, value);
            }
        }
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let factor = matrix.factor();
        let mut solved = x.clone();
        factor.solve_lower(&mut solved);
        factor.solve_upper(&mut solved);
        let expected = dense.cholesky().unwrap().solve(&DVector::from_vec(x));
        for (a, b) in solved.iter().zip(expected.iter()) {
            assert!((a - b).abs() < 1e-12);
        }
        // What is zero at first may be passed over, to the bit.
        for start in 0..n {
            let mut all: Vec<f64> = (0..n).map(|i| if i < start { 0.0 } else { (i as f64).cos() }).collect();
            let mut rest = all.clone();
            factor.solve_lower(&mut all);
            factor.solve_lower_from(start, &mut rest);
            assert_eq!(all, rest, "{start}");
        }
    }
}
