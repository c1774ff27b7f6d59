//! The largest eigenvalues of a symmetric operator by Lanczos's method, every vector made orthogonal to all before.

use crate::envelope::dot;
use crate::jacobi::eigen;

/// Up to `wanted` eigenpairs, largest first, from `steps` applications of an operator on `n` numbers. They are those of
/// a Krylov space: the leading ones are exact, the last ones mixtures of eigenvectors.
pub(crate) fn largest(
    n: usize,
    wanted: usize,
    steps: usize,
    apply: impl Fn(&[f64]) -> Vec<f64>,
) -> Vec<(f64, Vec<f64>)> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let (mut alphas, mut betas) = (Vec::new(), Vec::new());
    let mut next = start(n);
    for _ in 0..steps.min(n) {
        let norm = dot(&next, &next).sqrt();
        if norm <= 1e-12 * alphas.iter().fold(0.0_f64, |a, b: &f64| a.max(b.abs())) || norm == 0.0 {
            break;
        }
        if !basis.is_empty() {
            betas.push(norm);
        }
        next.iter_mut().for_each(|x| *x /= norm);
        basis.push(next);
        let last = &basis[basis.len() - 1];
        next = apply(last);
        alphas.push(dot(last, &next));
        // Twice is enough.
        for _ in 0..2 {
            for v in &basis {
                let along = dot(v, &next);
                next.iter_mut().zip(v).for_each(|(x, v)| *x -= along * v);
            }
        }
    }
    let k = basis.len();
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => alphas[i],
        1 => betas[i.min(j)],
        _ => 0.0,
    };
    let pairs = eigen((0..k * k).map(|at| entry(at / k, at % k)).collect(), k);
    let vector = |(value, factors): (f64, Vec<f64>)| {
        let mut x = vec![0.0; n];
        for (factor, v) in factors.iter().zip(&basis) {
            x.iter_mut().zip(v).for_each(|(x, v)| *x += factor * v);
        }
        (value, x)
    };
    pairs.into_iter().take(wanted).map(vector).collect()
}

/// Numbers between -1 and 1 without a pattern.
fn start(n: usize) -> Vec<f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    };
    (0..n).map(|_| next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_largest_of_known_eigenvalues() {
        let values: Vec<f64> = (0..50).map(|i| 100.0 / (1.0 + f64::from(i))).collect();
        let found = largest(50, 5, 30, |x| x.iter().zip(&values).map(|(x, v)| x * v).collect());
        for (i, (value, vector)) in found.iter().enumerate() {
            assert!((value - values[i]).abs() < 1e-9 * values[0]);
            assert!((vector[i].abs() - 1.0).abs() < 1e-6);
        }
    }
}
