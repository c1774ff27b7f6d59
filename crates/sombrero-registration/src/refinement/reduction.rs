//! The reduction: many weighted pairs to the few numbers of one Gauss-Newton step.
//!
//! To first order a change x of the pose, N numbers about the centre c of the pairs, changes the residual of pair i to
//! rᵢ + aᵢ · x. The sum to be minimised and its normal equations are
//!
//! ```text
//! Σ wᵢ (rᵢ + aᵢ · x)²,    (Σ wᵢ aᵢ aᵢᵀ + λ 1) x = -Σ wᵢ rᵢ aᵢ.
//! ```
//!
//! Directions that the pairs leave open have eigenvalue zero: Levenberg's damping λ holds them still, and costs the
//! others nothing that a further step would not mend.

use nalgebra::{Cholesky, SMatrix, SVector, Vector3};

use crate::refinement::pairs::Pair;

/// The step x, N numbers; `None` when the pairs ask for nothing. `row` gives a of a pair, `damping` is λ relative to
/// the mean of the diagonal.
pub(crate) fn reduce<const N: usize>(
    pairs: &[Pair],
    weights: &[f64],
    damping: f64,
    row: impl Fn(&Pair) -> SVector<f64, N>,
) -> Option<SVector<f64, N>> {
    let mut matrix = SMatrix::<f64, N, N>::zeros();
    let mut right = SVector::<f64, N>::zeros();
    for (pair, &w) in pairs.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
        let row = row(pair);
        matrix.syger(w, &row, &row, 1.0);
        right.axpy(-w * pair.residual(), &row, 1.0);
    }
    let damping = (matrix.trace() / N as f64 * damping).max(f64::MIN_POSITIVE);
    matrix += SMatrix::identity() * damping;
    Some(Cholesky::new(matrix)?.solve(&right))
}

/// Where the pairs' weights balance; `None` without weight.
pub(crate) fn weighted_centre(pairs: &[Pair], weights: &[f64]) -> Option<Vector3<f64>> {
    let total: f64 = weights.iter().sum();
    let sum: Vector3<f64> = pairs.iter().zip(weights).map(|(pair, w)| pair.p.coords * *w).sum();
    (total > 0.0).then(|| sum / total)
}
