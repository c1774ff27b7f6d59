//! w* without the prior, its precision, and how well each coefficient is known.
//!
//! ```text
//! P = RᵀR = Q diag(l) Qᵀ,    w* = Σ_k q_k (q_kᵀ (P w*)) / l_k    over the directions that are determined
//! ```
//!
//! A direction is not determined when l is within rounding of 0, or when w* lies further out along it than any watermark:
//! such a value is an error that was magnified, or was made to be one, and says nothing about w.

use crate::square_root::{gram, squared};
use crate::system::Solution;
use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

/// Eigenvalues of P below this share of the largest are undetermined directions.
const RANK_TOLERANCE: f64 = 1e-10;
/// Share of a coefficient (squared) in undetermined directions beyond which it counts as unknown.
const LARGEST_UNDETERMINED: f64 = 1e-3;
/// No watermark lies further out in any direction, in standard deviations: a Gaussian number exceeds 40 with a
/// probability of 1e-349.
const FURTHEST: f64 = 1e3;

/// The answer of a fit.
pub(crate) struct Answer {
    /// w*; 0 in undetermined directions.
    pub(crate) coefficients: Vec<f64>,
    /// Standard errors for s² = 1; infinite where a direction that matters is undetermined.
    pub(crate) errors: Vec<f64>,
    /// P for s² = 1.
    pub(crate) precision: DMatrix<f64>,
}

impl Answer {
    pub(crate) fn new(solution: &Solution) -> Self {
        Self::of(squared(&solution.left, &solution.lengths), &solution.score)
    }

    /// From P and P w*, in units in which the diagonal of P is 1: coefficients that are known to different accuracy are
    /// then told alike from those that are not known.
    pub(crate) fn in_own_units(mut precision: DMatrix<f64>, mut score: DVector<f64>) -> Self {
        let unit = precision.diagonal().map(|p| if p > 0.0 { p.sqrt() } else { 1.0 });
        let m = unit.len();
        (0..m)
            .flat_map(|j| (0..m).map(move |i| (i, j)))
            .for_each(|(i, j)| precision[(i, j)] /= unit[i] * unit[j]);
        score.component_div_assign(&unit);
        let mut answer = Self::scaled(precision, &score, &unit);
        (0..m)
            .flat_map(|j| (0..m).map(move |i| (i, j)))
            .for_each(|(i, j)| answer.precision[(i, j)] *= unit[i] * unit[j]);
        answer
    }

    fn of(precision: DMatrix<f64>, score: &DVector<f64>) -> Self {
        let unit = DVector::repeat(score.len(), 1.0);
        Self::scaled(precision, score, &unit)
    }

    /// `precision` and `score` are in units of `unit`, as the answer's precision is; coefficients and errors are not.
    fn scaled(precision: DMatrix<f64>, score: &DVector<f64>, unit: &DVector<f64>) -> Self {
        let m = score.len();
        let eigen = eigen(precision.clone());
        let smallest = RANK_TOLERANCE * eigen.eigenvalues.max();
        let seen = |k: usize| eigen.eigenvalues[k] > smallest && eigen.eigenvalues[k] > 0.0;
        let (mut coefficients, mut errors, mut unknown) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        let mut too_far = vec![false; m];
        for (k, axis) in eigen.eigenvectors.column_iter().enumerate() {
            let reciprocal = if seen(k) { 1.0 / eigen.eigenvalues[k] } else { 0.0 };
            let along = axis.dot(score) * reciprocal;
            // How far out w* lies along it, in units of w.
            let length: f64 = axis.iter().zip(unit).map(|(x, unit)| (x / unit).powi(2)).sum();
            too_far[k] = (along * length.sqrt()).abs() > FURTHEST;
            let known = seen(k) && !too_far[k];
            let (along, variance) = if known { (along, reciprocal) } else { (0.0, 0.0) };
            for (i, x) in axis.iter().enumerate() {
                coefficients[i] += x * along / unit[i];
                errors[i] += x * x * variance / (unit[i] * unit[i]);
                unknown[i] += if known { 0.0 } else { x * x };
            }
        }
        for ((error, unknown), w) in errors.iter_mut().zip(unknown).zip(&coefficients) {
            let known = unknown <= LARGEST_UNDETERMINED && w.abs() <= FURTHEST;
            *error = if known { error.sqrt() } else { f64::INFINITY };
        }
        let precision = if too_far.contains(&true) { without(&eigen, &too_far) } else { precision };
        Self { coefficients, errors, precision }
    }
}

/// P without these directions: a square again.
fn without(eigen: &SymmetricEigen<f64, Dyn>, left_out: &[bool]) -> DMatrix<f64> {
    let kept = (0..left_out.len()).filter(|&k| !left_out[k] && eigen.eigenvalues[k] > 0.0);
    let root =
        |k: usize| eigen.eigenvectors.column(k).iter().map(|x| x * eigen.eigenvalues[k].sqrt()).collect();
    gram(&kept.map(root).collect::<Vec<_>>(), left_out.len())
}

/// Eigenvalues and eigenvectors of a symmetric, positive semi-definite matrix.
///
/// nalgebra's iteration can end in NaN when rows are zero, as those of coefficients that the suspect does not show
/// are. Such a row is an eigenvector's own: a diagonal entry far below what counts as zero keeps it apart.
pub(crate) fn eigen(mut matrix: DMatrix<f64>) -> SymmetricEigen<f64, Dyn> {
    let tiny = 1e-18 * matrix.amax();
    for i in 0..matrix.nrows() {
        if matrix.row(i).amax() == 0.0 {
            matrix[(i, i)] = tiny;
        }
    }
    SymmetricEigen::new(matrix)
}
