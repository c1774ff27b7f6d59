//! The square root of a positive semi-definite matrix that is known as a difference, by Cholesky's method with complete
//! pivoting.
//!
//! ```text
//! A = G - YᵀY,    A ≈ RᵀR,    R of r × m
//! ```
//!
//! G holds the products of the columns of B and Y the part of them that nuisances explain, so A is what is left of the
//! columns, multiplied with each other, and R is what is left itself, in r coordinates. As a difference A has errors of
//! the rounding of G, of any sign, and may have negative eigenvalues; RᵀR is a square and has none. Columns are taken in
//! the order of the share of their squared length that is left, and the method ends where no share is above rounding:
//! such columns are wholly explained. Backward stable for semi-definite matrices (Higham, Reliable Numerical Computation
//! 1990, 161-185). Cost: r m² / 2 multiplications for R, as many for its square.

use nalgebra::DMatrix;

/// The share of a column's squared length below which what is left of it is rounding: sums over some ten thousand
/// observations and hundreds of columns.
const ROUNDING: f64 = 1e-12;

/// RᵀR for A = `left`, of which the lower triangle is read, and the diagonal of G, `lengths`.
pub(crate) fn squared(left: &DMatrix<f64>, lengths: &[f64]) -> DMatrix<f64> {
    gram(&square_root(left, lengths), lengths.len())
}

/// The rows of R.
fn square_root(left: &DMatrix<f64>, lengths: &[f64]) -> Vec<Vec<f64>> {
    let scale: Vec<f64> = lengths.iter().map(|l| if *l > 0.0 { l.sqrt() } else { 0.0 }).collect();
    let unit = |i: usize, j: usize| match scale[i] * scale[j] > 0.0 {
        true => left[(i.max(j), i.min(j))] / scale[i] / scale[j],
        false => 0.0,
    };
    let mut shares: Vec<f64> = (0..scale.len()).map(|i| unit(i, i)).collect();
    let mut open = vec![true; scale.len()];
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let largest = |shares: &[f64], open: &[bool]| {
        let left = (0..shares.len()).filter(|&i| open[i] && shares[i] > ROUNDING);
        left.max_by(|&i, &j| shares[i].total_cmp(&shares[j]).then(j.cmp(&i)))
    };
    while let Some(pivot) = largest(&shares, &open) {
        let mut row: Vec<f64> = (0..scale.len()).map(|j| unit(pivot, j)).collect();
        for earlier in &rows {
            let x = earlier[pivot];
            row.iter_mut().zip(earlier).for_each(|(entry, other)| *entry -= x * other);
        }
        let root = shares[pivot].sqrt();
        open[pivot] = false;
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = if open[j] { *entry / root } else { 0.0 };
            shares[j] -= *entry * *entry;
        }
        row[pivot] = root;
        rows.push(row);
    }
    for row in &mut rows {
        row.iter_mut().zip(&scale).for_each(|(entry, scale)| *entry *= scale);
    }
    rows
}

/// RᵀR of these rows of R, each of m entries.
pub(crate) fn gram(rows: &[Vec<f64>], m: usize) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(m, m);
    for row in rows {
        for (j, &x) in row.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            let mut column = products.column_mut(j);
            let below = column.as_mut_slice()[j..].iter_mut().zip(&row[j..]);
            below.for_each(|(sum, y)| *sum += x * y);
        }
    }
    products.fill_upper_triangle_with_lower_triangle();
    products
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DVector, SymmetricEigen};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        DMatrix::from_fn(rows, columns, |_, _| rng.random::<f64>() - 0.5)
    }

    proptest! {
        /// A matrix that is well known comes back; columns of any lengths.
        #[test]
        fn what_is_left_comes_back(seed in any::<u64>(), m in 1..30_usize, decades in 0..12_i32) {
            let mut b = random(60, m, seed);
            for (i, mut column) in b.column_iter_mut().enumerate() {
                column *= 10f64.powi((i as i32 * 7) % (decades + 1) - decades / 2);
            }
            let a = b.tr_mul(&b);
            let lengths: Vec<f64> = a.diagonal().iter().copied().collect();
            let square = squared(&a, &lengths);
            for (i, j) in (0..m).flat_map(|i| (0..m).map(move |j| (i, j))) {
                let error = (square[(i, j)] - a[(i, j)]).abs();
                prop_assert!(error <= 1e-12 * (lengths[i] * lengths[j]).sqrt(), "{i}, {j}: {error}");
            }
        }

        /// Of columns that are explained but for rounding nothing is left, and no eigenvalue is negative by more than the
        /// rounding of eigenvalues.
        #[test]
        fn never_negative(seed in any::<u64>(), rank in 0..8_usize, m in 1..25_usize, noise in -18..-10_i32) {
            let b = random(m, rank, seed);
            let share = 10f64.powi(noise);
            let spoilt = &b * b.transpose() + (random(m, m, seed ^ 1) * share);
            let square = squared(&spoilt, &vec![1.0 + rank as f64; m]);
            let l = SymmetricEigen::new(square.clone() + DMatrix::identity(m, m) * 1e-18).eigenvalues;
            prop_assert!(l.min() >= -1e-15 * m as f64 * l.max().max(1e-17), "{}", l.min());
            let x = DVector::from_fn(m, |i, _| (i as f64 * 1.7).sin());
            prop_assert!(x.dot(&(&square * &x)) >= -1e-15 * square.amax());
        }
    }

    #[test]
    fn nothing_left_is_nothing() {
        let a = DMatrix::from_diagonal(&DVector::from_vec(vec![1e-13, -1e-9, 0.0]));
        assert_eq!(squared(&a, &[1.0, 1.0, 0.0]), DMatrix::zeros(3, 3));
        assert_eq!(squared(&DMatrix::zeros(0, 0), &[]), DMatrix::zeros(0, 0));
    }
}
