//! The reasons why a file cannot be marked.

use sombrero_basis::BasisError;
use sombrero_extraction::ExtractError;
use sombrero_fidelity::digits;
use sombrero_io::{ParseError, WriteError};
use sombrero_watermark::{COEFFICIENTS, EPSILONS};
use thiserror::Error;

/// The reason why a file cannot be marked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EmbedError {
    /// There is nothing to mark.
    #[error("the file has no usable face; a mark needs a surface, not points or lines")]
    NoFaces,
    /// The file keeps positions in a way in which they cannot be replaced.
    #[error(transparent)]
    Fixed(WriteError),
    /// Every triangle stands alone.
    #[error(
        "no two of the {triangles} triangles share an edge: their corners meet nearly, but not well enough to be joined; \
         merge vertices by distance (weld) in a modelling program first"
    )]
    Unjoined {
        /// How many there are.
        triangles: usize,
    },
    /// ε is out of range.
    #[error(
        "epsilon {epsilon} is not usable; it must be between {} and {} (0.01 is usual)",
        EPSILONS.start(), EPSILONS.end()
    )]
    Epsilon {
        /// What was given.
        epsilon: f64,
    },
    /// Too few or too many coefficients were asked for.
    #[error(
        "a mark has between {} and {} coefficients, not {coefficients}; 200 are usual",
        COEFFICIENTS.start(), COEFFICIENTS.end()
    )]
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
    /// The longest displacement leaves nothing of the mark.
    #[error(
        "a longest displacement of {most:e} leaves an epsilon of {epsilon:e}, less than {:e}, which no file keeps; allow a larger one",
        EPSILONS.start()
    )]
    TooLittle {
        /// What was given, in model units.
        most: f64,
        /// The strength that would be left.
        epsilon: f64,
    },
    /// This mark is one of the few that go beyond the longest displacement.
    #[error(
        "this mark would move a vertex by {}, more than {}, as one in a thousand may; give another secret or recipient, or allow a little more",
        digits(*moved, 3), digits(*most, 3)
    )]
    Moved {
        /// What was asked for, in model units.
        most: f64,
        /// What came out.
        moved: f64,
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
