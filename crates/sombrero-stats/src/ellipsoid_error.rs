//! Why there is no ellipsoid or no test.

use thiserror::Error;

/// A question that [`Ellipsoid`](crate::Ellipsoid) cannot answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EllipsoidError {
    /// The precision is no m × m matrix.
    #[error("{centre} coefficients with a precision of {rows} by {columns}")]
    Shape {
        /// Length m of w*.
        centre: usize,
        /// Rows of P.
        rows: usize,
        /// Columns of P.
        columns: usize,
    },
    /// An extracted coefficient is infinite or not a number.
    #[error("extracted coefficient {index} is not finite")]
    CentreNotFinite {
        /// Its place in w*.
        index: usize,
    },
    /// An entry of the precision is infinite or not a number.
    #[error("the precision's entry ({row}, {column}) is not finite")]
    PrecisionNotFinite {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// The precision differs from its transpose.
    #[error("the precision is not symmetric at ({row}, {column})")]
    NotSymmetric {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
    },
    /// The precision has a negative eigenvalue.
    #[error("the precision has the negative eigenvalue {eigenvalue:e}")]
    NotPositive {
        /// The value.
        eigenvalue: f64,
    },
    /// The eigendecomposition did not converge.
    #[error("the precision's eigenvalues could not be found")]
    Decomposition,
    /// A least error is negative, infinite or not a number.
    #[error("{tau} is no least error: a finite number, not negative, is needed")]
    Floor {
        /// The value.
        tau: f64,
    },
    /// The two watermarks do not pair up.
    #[error("{watermark} inserted coefficients against {centre} extracted ones")]
    Lengths {
        /// Length of w.
        watermark: usize,
        /// Length m of w*.
        centre: usize,
    },
    /// An inserted coefficient is infinite or not a number: the key is damaged.
    #[error("inserted coefficient {index} is not finite")]
    WatermarkNotFinite {
        /// Its place in w.
        index: usize,
    },
}
