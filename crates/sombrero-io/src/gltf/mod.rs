//! glTF 2.0: JSON that describes a scene, and buffers that hold its geometry, as one GLB or as text.
//!
//! Read: the triangles, strips and fans of all meshes that the default scene shows, with positions as 32-bit
//! floats or whole numbers (`KHR_mesh_quantization`), interleaved, indexed or sparse, from a GLB's chunk, from data
//! URIs and from files in the same folder. Each stored mesh comes once, where the scene shows it first.
//!
//! Kept byte for byte: everything but the positions, and what must follow them: the `min` and `max` of their
//! accessors, the lengths and the padding of a GLB, the URI of a buffer that changed. The JSON is not written anew;
//! only those spans of it are replaced. Meshes that the scene does not show, points and lines stay as they are.
//!
//! Refused: glTF 1.0, Draco and meshopt compression, positions that share bytes with other data, buffers that are
//! missing or outside the folder, and claims that the bytes do not bear out.

mod accessor;
mod buffers;
mod container;
mod encode;
mod geometry;
mod json;
mod scene;
mod shading;
#[cfg(test)]
mod tests;
mod write;

use crate::document::Parsed;
use crate::error::{ParseError, Place};
use crate::input::Source;

pub(crate) use container::is_gltf;
pub(crate) use encode::{encode_binary, encode_text};

/// Where the positions stand.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    container: container::Container,
    /// The buffers that hold geometry: stores, by number.
    origins: Vec<buffers::Origin>,
    blocks: Vec<geometry::Block>,
    bounds: Vec<geometry::Bounds>,
    shading: shading::Shading,
}

/// Reads the whole file.
pub(crate) fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let container = container::open(source.bytes)?;
    let text = container.text(source.bytes)?;
    let head: json::Head<'_> = serde_json::from_str(text).map_err(|e| container.json_error(&e))?;
    let asset = head.asset.and_then(|asset| serde_json::from_str::<json::Asset>(asset.get()).ok());
    let version = asset.ok_or_else(no_gltf)?.version;
    if version != "2" && !version.starts_with("2.") {
        return Err(other_version(&version));
    }
    let root: json::Root<'_> = serde_json::from_str(text).map_err(|e| container.json_error(&e))?;
    geometry::read(source, container, text, &root)
}

fn no_gltf() -> ParseError {
    ParseError::Unsupported {
        what: "JSON that is no glTF 2.0 (it has no `asset` with a `version`)".into(),
        cure: "give a mesh file; a key file goes where a key is asked for",
    }
}

fn other_version(version: &str) -> ParseError {
    let name = match version {
        "" => "without a version".to_owned(),
        "1" => "1.0".to_owned(),
        other => other.chars().take(20).collect(),
    };
    ParseError::Unsupported { what: format!("glTF {name}"), cure: "export the model again as glTF 2.0" }
}

fn compressed(extension: &str) -> ParseError {
    let name: String = extension.chars().take(80).collect();
    ParseError::Unsupported {
        what: format!("compressed geometry ({name})"),
        cure: "export the model again without compression",
    }
}

fn malformed(name: &str, index: usize, problem: &str) -> ParseError {
    ParseError::Malformed { place: Place::Element { name: name.into(), index }, problem: problem.into() }
}
