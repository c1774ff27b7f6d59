//! Eigenvalues of small symmetric matrices by Jacobi's rotations (Golub and Van Loan 2013, 8.5), one pair of rows after the
//! other: slow, exact, and the same bits on every machine.

/// Eigenvalues, largest first, each with its eigenvector. `matrix` holds n rows of n numbers and is symmetric.
pub(crate) fn eigen(mut matrix: Vec<f64>, n: usize) -> Vec<(f64, Vec<f64>)> {
    const SWEEPS: usize = 30;
    // Row k of `vectors` becomes the k-th eigenvector.
    let mut vectors = vec![0.0; n * n];
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    for _ in 0..SWEEPS {
        let square = |i: usize, j: usize| matrix[i * n + j] * matrix[i * n + j];
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| square(i, j)).sum();
        let on: f64 = (0..n).map(|i| square(i, i)).sum();
        if off <= 1e-30 * on {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut matrix, &mut vectors, n, (p, q));
            }
        }
    }
    let mut pairs: Vec<(f64, Vec<f64>)> =
        (0..n).map(|i| (matrix[i * n + i], vectors[i * n..(i + 1) * n].to_vec())).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs
}

/// Makes the entry in row p and column q zero.
fn rotate(matrix: &mut [f64], vectors: &mut [f64], n: usize, (p, q): (usize, usize)) {
    let (a, b, c) = (matrix[p * n + p], matrix[p * n + q], matrix[q * n + q]);
    if b == 0.0 {
        return;
    }
    let tau = (c - a) / (2.0 * b);
    let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
    let cos = 1.0 / (1.0 + t * t).sqrt();
    let sin = t * cos;
    for k in 0..n {
        let (x, y) = (matrix[k * n + p], matrix[k * n + q]);
        (matrix[k * n + p], matrix[k * n + q]) = (cos * x - sin * y, sin * x + cos * y);
    }
    for rows in [matrix, vectors] {
        for k in 0..n {
            let (x, y) = (rows[p * n + k], rows[q * n + k]);
            (rows[p * n + k], rows[q * n + k]) = (cos * x - sin * y, sin * x + cos * y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_are_stretched_by_their_eigenvalues() {
        let n = 17;
        let entry = |i: usize, j: usize| {
            1.0 / (1.0 + (i as f64 - j as f64).powi(2)) + if i == j { i as f64 } else { 0.0 }
        };
        let matrix: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let pairs = eigen(matrix.clone(), n);
        assert!(pairs.is_sorted_by(|a, b| a.0 >= b.0));
        for (value, vector) in &pairs {
            let length: f64 = vector.iter().map(|x| x * x).sum();
            assert!((length - 1.0).abs() < 1e-12);
            for i in 0..n {
                let stretched: f64 = (0..n).map(|j| matrix[i * n + j] * vector[j]).sum();
                assert!((stretched - value * vector[i]).abs() < 1e-10, "{stretched}");
            }
        }
    }
}
