//! What is refused, and why.

use crate::error::{ParseError, Place};

/// JSON of something else.
pub(super) fn no_gltf() -> ParseError {
    ParseError::Unsupported {
        what: "JSON that is no glTF 2.0 (it has no `asset` with a `version`)".into(),
        cure: "give a mesh file; a key file goes where a key is asked for",
    }
}

/// A version that is not read.
pub(super) fn other_version(version: &str) -> ParseError {
    let name = match version {
        "" => "without a version".to_owned(),
        "1" => "1.0".to_owned(),
        other => other.chars().take(20).collect(),
    };
    ParseError::Unsupported { what: format!("glTF {name}"), cure: "export the model again as glTF 2.0" }
}

/// Geometry that an extension has packed.
pub(super) fn compressed(extension: &str) -> ParseError {
    let name: String = extension.chars().take(80).collect();
    ParseError::Unsupported {
        what: format!("compressed geometry ({name})"),
        cure: "export the model again without compression",
    }
}

/// An extension without which the file says nothing certain.
pub(super) fn unknown_extension(extension: &str) -> ParseError {
    let name: String = extension.chars().take(80).collect();
    ParseError::Unsupported {
        what: format!("the glTF extension `{name}`, which the file requires,"),
        cure: "export the model again without it",
    }
}

/// An element, by its kind and number, that is not as glTF has it.
pub(super) fn malformed(name: &str, index: usize, problem: &str) -> ParseError {
    ParseError::Malformed { place: Place::Element { name: name.into(), index }, problem: problem.into() }
}

/// Positions that share bytes with something else.
pub(super) fn overlapping() -> ParseError {
    ParseError::Unsupported {
        what: "a glTF with position data that overlap with other data".into(),
        cure: "export the model again with data of their own for each part",
    }
}

/// The refusal of a file whose accessors cover the same bytes many times over, so that it unpacks to far more
/// than it is.
pub(super) fn again_and_again() -> ParseError {
    ParseError::Unsupported {
        what: "a glTF that uses the same bytes of its buffers again and again".into(),
        cure: "export the model again with data of their own for each part",
    }
}
