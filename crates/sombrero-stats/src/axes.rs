//! The axes of an ellipsoid: P = Q diag(l) Qᵀ, in whose coordinates its directions are independent.
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
}

impl Axes {
    /// Of a symmetric, positive semi-definite matrix; rounding noise around 0 is cleared.
    pub(crate) fn new(precision: &DMatrix<f64>) -> Result<Self, EllipsoidError> {
        let m = precision.nrows();
        let (rotation, mut eigenvalues, rounding) = if is_diagonal(precision) {
            (None, precision.diagonal(), 0.0)
        } else {
            let mut symmetric =
                DMatrix::from_fn(m, m, |i, j| 0.5 * precision[(i, j)] + 0.5 * precision[(j, i)]);
            keep_zero_rows_apart(&mut symmetric);
            let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, 1000 * m)
                .ok_or(EllipsoidError::Decomposition)?;
            (Some(eigen.eigenvectors.transpose()), eigen.eigenvalues, m as f64 * f64::EPSILON)
        };
        if let Some(&eigenvalue) = eigenvalues.iter().find(|l| !l.is_finite()) {
            return Err(EllipsoidError::NotPositive { eigenvalue });
        }
        let largest = eigenvalues.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
        if let Some(&eigenvalue) = eigenvalues.iter().find(|l| **l < -TOLERANCE * largest) {
            return Err(EllipsoidError::NotPositive { eigenvalue });
        }
        eigenvalues.apply(|l| {
            if *l <= rounding * largest {
                *l = 0.0;
            }
        });
        Ok(Self { rotation, precisions: eigenvalues })
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

    /// yᵀ diag(l) y over the largest l, for y in these coordinates.
    pub(crate) fn relative_norm(&self, y: &DVector<f64>) -> f64 {
        let largest = self.largest_precision();
        let squares = self.precisions.iter().zip(y.iter());
        let sum: f64 = squares.filter(|(l, _)| **l > 0.0).map(|(l, y)| l / largest * y * y).sum();
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

fn is_diagonal(matrix: &DMatrix<f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..matrix.nrows()).all(|i| i == j || matrix[(i, j)] == 0.0))
}
