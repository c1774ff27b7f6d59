//! What can go wrong.

use sombrero_basis::BasisError;
use sombrero_extraction::EstimateError;
use sombrero_registration::RegistrationError;
use thiserror::Error;

/// The reason why a mesh cannot be an original.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OriginalError {
    /// It holds no surface.
    #[error("the original has no usable face; give a mesh with triangles or polygons")]
    NoFaces,
    /// It does not carry the basis that was asked for.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// The basis that was given has another number of rows than the original has points.
    #[error("the basis is over {rows} points, the original has {points}; give the basis of this original")]
    OtherBasis {
        /// The basis's rows.
        rows: usize,
        /// The original's points.
        points: usize,
    },
}

/// The reason why a search cannot be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SearchError {
    /// Comparing surfaces was forbidden but is needed.
    #[error(
        "the suspect's vertices and triangles are not those of the original, so it has to be resampled; \
         leave resampling at auto"
    )]
    NeedsResampling,
    /// Registration was insisted on and cannot be done.
    #[error("the suspect cannot be registered: {0}")]
    Registration(#[from] RegistrationError),
    /// No hypothesis could be examined.
    #[error("nothing could be compared: {reasons}")]
    NothingWorked {
        /// Why, in sentences.
        reasons: String,
    },
    /// The coefficients cannot be estimated.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
}
