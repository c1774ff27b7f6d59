//! glTF 2.0: JSON that describes a scene, and buffers that hold its geometry, as one GLB or as text.
//!
//! Read: the triangles, strips and fans of all meshes that the default scene shows, with positions as 32-bit
//! floats or whole numbers (`KHR_mesh_quantization`), interleaved, indexed or sparse, from a GLB's chunk, from data
//! URIs and from files in the same folder, plain, in compressed buffer views (meshopt) or in Draco streams. Each stored mesh
//! comes once, where the scene shows it first.
//!
//! Kept byte for byte: everything but the positions, and what must follow them: the `min` and `max` of their
//! accessors, the lengths and the padding of a GLB, the URI of a buffer that changed, where a longer stream pushes data. The JSON is not written anew;
//! only those spans of it are replaced. Meshes that the scene does not show stay as they are. Points and lines that
//! it shows are vertices without a face.
//!
//! Refused: glTF 1.0, moving what is in a Draco stream, positions that share bytes with other data, buffers that are
//! missing or outside the folder, required extensions that are not known, and claims that the bytes do not bear out.

mod accessor;
mod attributes;
mod block;
mod buffers;
mod claims;
mod container;
mod draco;
mod elements;
mod encode;
mod error;
mod extensions;
mod geometry;
mod json;
mod loose;
mod meshopt;
mod needed;
mod overlaps;
mod packed;
mod patches;
mod places;
mod repack;
mod scene;
mod shading;
#[cfg(test)]
mod tests;
mod whole;
mod write;

use crate::error::ParseError;
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::Parsed;

/// The format's row.
pub(crate) static FAMILY: Family = Family {
    name: "glTF",
    variants: &[&TEXT, &BINARY],
    recognise: |bytes| Evidence::Certain.when(container::is_gltf(bytes)),
    parse,
    empty: ParseError::NothingShown,
};

/// JSON.
pub(crate) static TEXT: Variant = Variant {
    format: Format::Gltf,
    name: "glTF",
    extension: "gltf",
    needs_triangles: true,
    encode: encode::encode_text,
};

/// GLB: JSON and a buffer in one binary file.
pub(crate) static BINARY: Variant = Variant {
    format: Format::Glb,
    name: "glTF (binary)",
    extension: "glb",
    needs_triangles: true,
    encode: encode::encode_binary,
};

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let container = container::open(source.bytes)?;
    let text = container.text(source.bytes)?;
    let head: json::Head<'_> = serde_json::from_str(text).map_err(|e| container.json_error(&e))?;
    let asset = head.asset.and_then(|asset| serde_json::from_str::<json::Asset>(asset.get()).ok());
    let version = asset.ok_or_else(error::no_gltf)?.version;
    if version != "2" && !version.starts_with("2.") {
        return Err(error::other_version(&version));
    }
    let root: json::Root<'_> = serde_json::from_str(text).map_err(|e| container.json_error(&e))?;
    let note = container.note(source.bytes);
    let mut parsed = geometry::read(source, container, text, &root)?;
    parsed.notes.extend(note);
    Ok(parsed)
}
