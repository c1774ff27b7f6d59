//! Questions without an answer.

use std::fmt;

use thiserror::Error;

/// Which of the two meshes an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The unmarked original.
    Reference,
    /// The mesh to be brought onto it.
    Suspect,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reference => "reference",
            Self::Suspect => "suspect",
        })
    }
}

/// Why there is nothing to register.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RegistrationError {
    /// No triangles.
    #[error("the {side} has no triangles; registration needs a surface, not a set of points")]
    Empty {
        /// The mesh without triangles.
        side: Side,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} of the {side} names vertex {vertex}, but there are only {vertices}")]
    MissingVertex {
        /// The mesh.
        side: Side,
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A vertex in use is NaN or infinite.
    #[error("vertex {vertex} of the {side} has a coordinate that is not finite; remove or repair it")]
    NotFinite {
        /// The mesh.
        side: Side,
        /// Index of the vertex.
        vertex: usize,
    },
    /// All triangles shrink to one point or one line, to working precision.
    #[error("the surface of the {side} has no area; all its triangles have collapsed")]
    NoArea {
        /// The mesh.
        side: Side,
    },
    /// All triangles lie in one plane, to working precision.
    #[error("all triangles of the {side} lie in one plane, which leaves its position within the plane open")]
    Flat {
        /// The mesh.
        side: Side,
    },
    /// The two sizes differ by more than a number can hold.
    #[error("the sizes of reference and suspect are too far apart; bring both to ordinary units first")]
    SizeRatio,
    /// A start that is no similarity.
    #[error("start {index} has a scale that is not positive, or a number that is not finite")]
    Start {
        /// Its place in the list, from 0.
        index: usize,
    },
    /// An empty list of starts.
    #[error("the list of starts is empty; give one or choose `Starts::Auto`")]
    NoStarts,
    /// An option out of its range.
    #[error("option `{option}` is {value}; it must be {range}")]
    Option {
        /// Name of the field.
        option: &'static str,
        /// What it was.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
}
