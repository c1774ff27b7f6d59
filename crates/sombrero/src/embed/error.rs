//! The reasons why a file cannot be marked.

use sombrero_basis::BasisError;
use sombrero_extraction::ExtractError;
use sombrero_io::{ParseError, WriteError};
use thiserror::Error;

/// The reason why a file cannot be marked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EmbedError {
    /// There is nothing to mark.
    #[error("the file has no usable face; a mark needs a surface, not points or lines")]
    NoFaces,
    /// ε is not a positive number.
    #[error("epsilon {epsilon} is not usable; it must be above 0 and at most 1 (0.01 is usual)")]
    Epsilon {
        /// What was given.
        epsilon: f64,
    },
    /// Fewer than four coefficients were asked for.
    #[error("a mark needs at least 4 coefficients, not {coefficients}; 50 are usual")]
    Coefficients {
        /// What was given.
        coefficients: usize,
    },
    /// A longest displacement that is not a positive number.
    #[error(
        "a longest displacement of {most} is not usable; give a number above 0, in the units of the model"
    )]
    Displacement {
        /// What was given.
        most: f64,
    },
    /// The mesh is too small or too flat.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// The new positions cannot be stored.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The marked file does not read back.
    #[error("the marked file does not read back: {0}")]
    ReadBack(#[from] ParseError),
    /// The marked file cannot be compared with the original.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The file's numbers are too coarse for the mark.
    #[error(
        "the mark does not survive being stored (log10 p is {log10_p:.1} in the marked file): the file's number type is too coarse for its coordinates; move the model nearer to the origin, use a format with double precision, raise epsilon or allow a larger displacement"
    )]
    Lost {
        /// What was found in the marked file.
        log10_p: f64,
    },
}
