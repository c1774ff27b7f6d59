//! Questions without an answer.

use thiserror::Error;

/// A question without an answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ResampleError {
    /// A mesh has no face with three different finite corners and some extent.
    #[error("the {which} has no usable face; give a mesh with triangles that span an area")]
    NoFaces {
        /// Original or suspect.
        which: &'static str,
    },
    /// A vertex that a face uses is NaN, infinite or too large to compute with.
    #[error("vertex {vertex} of the {which} has a coordinate that is not finite; repair or remove it first")]
    NotFinite {
        /// Original or suspect.
        which: &'static str,
        /// Its index.
        vertex: usize,
    },
    /// An option is out of its range.
    #[error("the option {name} is {value}; it must be {range}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What it may be, in words.
        range: &'static str,
    },
}
