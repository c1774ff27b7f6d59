//! Why there is no basis.

use crate::{Amplitudes, BasisFunction};
use thiserror::Error;

/// Why there is no basis.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum BasisError {
    /// The mesh is too small or too flat.
    #[error("the mesh can carry {available} coefficients, not {wanted}; {}", cure(*available))]
    TooFewSplits {
        /// How many were asked for.
        wanted: usize,
        /// How many vertex splits change the shape, or how many fields there are.
        available: usize,
    },
    /// The mesh has hardly a displacement that tells something and is not seen.
    #[error(
        "only {available} displacements of this mesh tell something without being seen, too few for a mark: it has few \
         vertices, or large flats of few triangles; use a finer mesh, or --preset robust, which is seen"
    )]
    TooFewFields {
        /// How many there are.
        available: usize,
    },
    /// Amplitudes that such functions do not have.
    #[error(
        "functions `{function}` have no amplitudes `{amplitudes}`; fields are filled, all others are not"
    )]
    Amplitudes {
        /// The kind of the functions.
        function: BasisFunction,
        /// The rule that was asked for.
        amplitudes: Amplitudes,
    },
}

/// A key has at least 16 coefficients.
fn cure(available: usize) -> &'static str {
    if available < 16 { "use a finer mesh, with some relief" } else { "ask for fewer or use a finer mesh" }
}

/// Why parts make no basis.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PartsError {
    /// Not one length for each function, or rows or values that are not as many as the lengths say.
    #[error("the columns of the basis have other lengths than its functions say")]
    Lengths,
    /// A row that is out of range, or does not come after the one before it.
    #[error("a column of the basis is not sorted by vertex, or names a vertex that is not there")]
    Rows,
    /// A number that nobody can compute with.
    #[error("the basis holds a number that is not finite")]
    NotFinite,
}
