//! The axes of an ellipsoid: P = Q diag(l) Qᵀ, in whose coordinates its directions are independent.
//!
//! **How near to orthogonal Q is** decides what may be claimed from it, since a claimant may choose P and w*. Let R be
//! the matrix that stands for Qᵀ in doubles and δ ≥ |R Rᵀ - 1|. By its polar decomposition R = S U with U orthogonal and
//! |S - 1| ≤ δ, so U w, of which R w stands for, is as Gaussian as w is; and with the rounding of the m products of a row
//! (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.1),
//!
//! ```text
//! |fl(R w)_k - (U w)_k| ≤ η |w|,    η = δ + (1 + δ) γ_m,    γ_m = m u / (1 - m u),    u = 2⁻⁵³
//! ```
//!
//! The error is one of w alone, however large w* is, as long as w is rotated before w* is subtracted. δ is measured, not
//! taken from what the iteration should reach.
//!
//! All that is special about the decomposition stands here, once: rows of zeros, which would end the iteration in NaN;
//! rounding around 0, which is no knowledge; diagonal matrices, which need no rotation and may span any range.

use libm::{hypot, sqrt};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::ellipsoid_error::EllipsoidError;

/// P may be asymmetric or have negative eigenvalues by this share of its largest entry or eigenvalue.
const TOLERANCE: f64 = 1e-8;

/// P = Q diag(l) Qᵀ.
#[derive(Debug, Clone)]
pub(crate) struct Axes {
    /// Qᵀ; `None` for the identity.
    rotation: Option<DMatrix<f64>>,
    /// l, none negative.
    precisions: DVector<f64>,
    /// η; 0 for the identity.
    rounding: f64,
}

impl Axes {
    /// Of a symmetric, positive semi-definite matrix; rounding noise around 0 is cleared.
    pub(crate) fn new(precision: &DMatrix<f64>) -> Result<Self, EllipsoidError> {
        let m = precision.nrows();
        if is_diagonal(precision) {
            return Self::with_rounding_cleared(None, precision.diagonal(), (0.0, 0.0));
        }
        let mut symmetric = DMatrix::from_fn(m, m, |i, j| 0.5 * precision[(i, j)] + 0.5 * precision[(j, i)]);
        keep_zero_rows_apart(&mut symmetric);
        let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, 1000 * m)
            .ok_or(EllipsoidError::Decomposition)?;
        let noise = m as f64 * f64::EPSILON;
        let deviation = deviation_from_orthogonal(&eigen.eigenvectors);
        let rounding = deviation + (1.0 + deviation) * gamma(m);
        Self::with_rounding_cleared(
            Some(eigen.eigenvectors.transpose()),
            eigen.eigenvalues,
            (noise, rounding),
        )
    }

    /// Eigenvalues up to `noise` times the largest one are 0.
    fn with_rounding_cleared(
        rotation: Option<DMatrix<f64>>,
        mut precisions: DVector<f64>,
        (noise, rounding): (f64, f64),
    ) -> Result<Self, EllipsoidError> {
        if let Some(&eigenvalue) = precisions.iter().find(|l| !l.is_finite()) {
            return Err(EllipsoidError::NotPositive { eigenvalue });
        }
        let largest = precisions.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
        if let Some(&eigenvalue) = precisions.iter().find(|l| **l < -TOLERANCE * largest) {
            return Err(EllipsoidError::NotPositive { eigenvalue });
        }
        precisions.apply(|l| {
            if *l <= noise * largest {
                *l = 0.0;
            }
        });
        Ok(Self { rotation, precisions, rounding })
    }

    /// l in no particular order.
    pub(crate) fn precisions(&self) -> &[f64] {
        self.precisions.as_slice()
    }

    pub(crate) fn largest_precision(&self) -> f64 {
        self.precisions.iter().fold(0.0, |m, l| l.max(m))
    }

    /// Qᵀ x.
    pub(crate) fn rotated(&self, x: DVector<f64>) -> DVector<f64> {
        match &self.rotation {
            Some(q) => q * x,
            None => x,
        }
    }

    /// The eigenvectors of these directions, one a column.
    pub(crate) fn columns(&self, directions: &[usize]) -> DMatrix<f64> {
        let m = self.precisions.len();
        match &self.rotation {
            Some(q) => q.select_rows(directions).transpose(),
            None => DMatrix::from_fn(m, directions.len(), |i, k| f64::from(u8::from(i == directions[k]))),
        }
    }

    /// No knowledge along the directions where c, in these coordinates, is beyond `furthest`.
    pub(crate) fn forget_beyond(&mut self, centre: &DVector<f64>, furthest: f64) {
        for (l, c) in self.precisions.iter_mut().zip(centre.iter()) {
            // A NaN is as little known.
            if c.is_nan() || c.abs() > furthest {
                *l = 0.0;
            }
        }
    }

    /// At least Σ l_k ((U w)_k - c_k)² over the largest l, and more only by rounding.
    pub(crate) fn relative_distance(&self, w: DVector<f64>, centre: &DVector<f64>) -> f64 {
        let slack = self.rounding * w.norm() * (1.0 + w.len() as f64 * f64::EPSILON);
        let rotated = self.rotated(w);
        let largest = self.largest_precision();
        let (mut sum, mut terms) = (0.0, 0.0);
        for ((l, y), c) in self.precisions.iter().zip(rotated.iter()).zip(centre.iter()) {
            if *l > 0.0 {
                let gap = (y - c).abs() * (1.0 + f64::EPSILON) + slack;
                sum += l / largest * gap * gap;
                terms += 1.0;
            }
        }
        // The rounding of a sum of positive terms, each of a few products.
        sum *= 1.0 + (terms + 8.0) * f64::EPSILON;
        // Huge values of both signs: far apart.
        if sum.is_nan() { f64::INFINITY } else { sum }
    }

    /// With an independent error of standard deviation τ > 0 more in every direction.
    pub(crate) fn with_floor(mut self, tau: f64) -> Self {
        self.precisions.apply(|l| *l = floored(*l, tau));
        self
    }
}

/// l/(1 + τ² l) = 1/(l⁻¹ + τ²), for any l ≥ 0 and τ > 0.
pub(crate) fn floored(l: f64, tau: f64) -> f64 {
    if l <= 0.0 {
        return 0.0;
    }
    let sigma = hypot(1.0 / sqrt(l), tau);
    1.0 / sigma / sigma
}

/// Whether all entries are finite and the matrix is its own transpose to [`TOLERANCE`] of the largest one.
pub(crate) fn check_symmetric(precision: &DMatrix<f64>) -> Result<(), EllipsoidError> {
    let m = precision.nrows();
    if let Some(place) = precision.iter().position(|x| !x.is_finite()) {
        return Err(EllipsoidError::PrecisionNotFinite { row: place % m, column: place / m });
    }
    let largest = precision.amax();
    let skew =
        |(i, j): &(usize, usize)| (precision[(*i, *j)] - precision[(*j, *i)]).abs() > TOLERANCE * largest;
    match (0..m).flat_map(|i| (0..i).map(move |j| (i, j))).find(skew) {
        Some((row, column)) => Err(EllipsoidError::NotSymmetric { row, column }),
        None => Ok(()),
    }
}

/// nalgebra's iteration can end in NaN when rows are zero, as those of coefficients that nothing is known of are. Such a
/// row is an eigenvector's own; a diagonal entry far below rounding keeps it apart.
fn keep_zero_rows_apart(matrix: &mut DMatrix<f64>) {
    let tiny = 1e-18 * matrix.amax();
    for i in 0..matrix.nrows() {
        if matrix.row(i).amax() == 0.0 {
            matrix[(i, i)] = tiny;
        }
    }
}

/// At least γ_m, for any order of summation and vectors of length 1 to a hundredth.
fn gamma(m: usize) -> f64 {
    1.02 * m as f64 * (0.5 * f64::EPSILON)
}

/// At least the largest |eigenvalue| of QᵀQ - 1, by its largest absolute row sum, the rounding of the products included;
/// ∞ where Q is no rotation at all.
fn deviation_from_orthogonal(q: &DMatrix<f64>) -> f64 {
    let m = q.ncols();
    let mut sums = vec![m as f64 * gamma(m); m];
    for i in 0..m {
        for j in 0..=i {
            let product = q.column(i).dot(&q.column(j));
            if i == j {
                sums[i] += (product - 1.0).abs();
            } else {
                sums[i] += product.abs();
                sums[j] += product.abs();
            }
        }
    }
    if sums.iter().all(|sum| *sum < 0.01) { sums.into_iter().fold(0.0, f64::max) } else { f64::INFINITY }
}

fn is_diagonal(matrix: &DMatrix<f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..matrix.nrows()).all(|i| i == j || matrix[(i, j)] == 0.0))
}
