//! Why a spec cannot be read, and why an attack cannot be made.

use sombrero_basis::BasisError;
use thiserror::Error;

/// A spec that cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SpecError {
    /// No attack has this name.
    #[error("there is no attack `{name}`; known are {known}")]
    Name {
        /// What was given.
        name: String,
        /// The names that there are, in words.
        known: String,
    },
    /// The attack has no such parameter, or it was given twice.
    #[error("the attack {attack} has no parameter `{parameter}`, or has it twice; it takes {known}")]
    Parameter {
        /// The attack.
        attack: String,
        /// What was given.
        parameter: String,
        /// What it takes, in words.
        known: String,
    },
    /// A parameter that is needed is missing.
    #[error("the attack {attack} needs a value for {parameter}, for instance {example}")]
    Missing {
        /// The attack.
        attack: String,
        /// The parameter.
        parameter: &'static str,
        /// A spec that makes sense.
        example: &'static str,
    },
    /// A value is not of the right kind.
    #[error("`{text}` is not a usable value for {attack}'s {parameter}; give {wanted}")]
    Value {
        /// The attack.
        attack: String,
        /// The parameter.
        parameter: &'static str,
        /// What was given.
        text: String,
        /// What is wanted, in words.
        wanted: &'static str,
    },
}

/// Why an attack cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum AttackError {
    /// A parameter is out of its range.
    #[error("the attack's parameter {name}={value} is not usable; it must be {range}")]
    Parameter {
        /// Its name in the spec.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What it may be, in words.
        range: &'static str,
    },
    /// No face is left, or there was none.
    #[error("the attack leaves no face of the mesh; use a weaker one or a mesh with faces")]
    NothingLeft,
    /// The result would be too large to work with.
    #[error("the attack makes more than {MOST_FACES} faces or cells; use fewer iterations or a coarser one")]
    TooManyFaces,
    /// All vertices are at one place, or too far apart for numbers, so there is no length to measure others by.
    #[error("the mesh has no size that the attack could measure lengths by")]
    NoExtent,
    /// The mesh cannot carry the second mark.
    #[error("a second mark does not fit: {0}")]
    SecondMark(#[from] BasisError),
}

/// Most faces that an attack makes. More would not fit into the memory of an ordinary machine.
pub(crate) const MOST_FACES: usize = 20_000_000;

/// Refuses a parameter outside of `least..=most`, which `range` says in words.
pub(crate) fn in_range(
    name: &'static str,
    value: f64,
    (least, most): (f64, f64),
    range: &'static str,
) -> Result<(), AttackError> {
    if value >= least && value <= most { Ok(()) } else { Err(AttackError::Parameter { name, value, range }) }
}
