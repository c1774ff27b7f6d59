//! The reasons why a question cannot be answered.

use sombrero_basis::BasisError;
use sombrero_extraction::ExtractError;
use sombrero_resampling::ResampleError;
use sombrero_search::{OriginalError, SearchError};
use sombrero_stats::{EllipsoidError, KeyTestError, WatermarkTestError};
use sombrero_watermark::Mismatch;
use thiserror::Error;

/// The reason why a question cannot be answered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DetectError {
    /// A file holds no surface.
    #[error("the {which} has no usable face; give a mesh with triangles or polygons")]
    NoFaces {
        /// Original or suspect.
        which: &'static str,
    },
    /// The threshold is no probability.
    #[error(
        "the threshold {threshold} is not a probability; give a number above 0 and at most 1, such as 1e-6"
    )]
    Threshold {
        /// What was given.
        threshold: f64,
    },
    /// The key does not belong to the original, or was edited.
    #[error(transparent)]
    Key(#[from] Mismatch),
    /// The original does not carry so many coefficients, so the key cannot be its.
    #[error("the key does not fit the original: {0}")]
    Basis(#[from] BasisError),
    /// The suspect cannot be looked at in the way that was asked for, or in no way at all.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// Resampling cannot be done.
    #[error("the suspect cannot be resampled: {0}")]
    Resampling(#[from] ResampleError),
    /// The positions cannot be compared.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The coefficients cannot be compared.
    #[error(transparent)]
    Test(#[from] KeyTestError),
}

impl From<WatermarkTestError> for DetectError {
    fn from(error: WatermarkTestError) -> Self {
        Self::Test(error.into())
    }
}

impl From<EllipsoidError> for DetectError {
    fn from(error: EllipsoidError) -> Self {
        Self::Test(error.into())
    }
}

impl From<OriginalError> for DetectError {
    fn from(error: OriginalError) -> Self {
        match error {
            OriginalError::Basis(error) => Self::Basis(error),
            // A stored basis of other points is not that of the key.
            OriginalError::OtherBasis { .. } => Self::Key(Mismatch::Basis),
            _ => Self::NoFaces { which: "original" },
        }
    }
}
