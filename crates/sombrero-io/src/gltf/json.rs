//! The parts of a glTF's JSON that say where geometry stands. All else is passed over.
//!
//! Numbers and names that a rewrite may replace are kept as spans of the text, so that the text itself is never
//! written anew. Whole numbers may be written as floats, `36.0`.

use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::meshopt::{Filter, Mode};
use super::whole::{Whole, all_whole, maybe_whole, whole};

/// What tells glTF from other JSON.
#[derive(Debug, Deserialize)]
pub(super) struct Head<'a> {
    #[serde(borrow)]
    pub(super) asset: Option<&'a RawValue>,
}

/// The version that the file is written for.
#[derive(Debug, Deserialize)]
pub(super) struct Asset {
    #[serde(deserialize_with = "text_or_number")]
    pub(super) version: String,
}

/// Some exporters write the version as a number.
fn text_or_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    match serde_json::Value::deserialize(deserializer)? {
        serde_json::Value::String(text) => Ok(text),
        serde_json::Value::Number(number) => Ok(number.to_string()),
        _ => Err(D::Error::custom("the version is no text")),
    }
}

/// The whole.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root<'a> {
    #[serde(default)]
    pub(super) extensions_required: Vec<String>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) scene: Option<u32>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default, borrow)]
    pub(super) accessors: Vec<Accessor<'a>>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default, borrow)]
    pub(super) buffers: Vec<Buffer<'a>>,
    #[serde(default)]
    pub(super) images: Vec<Image>,
    #[serde(default)]
    pub(super) materials: Vec<IgnoredAny>,
    #[serde(default)]
    pub(super) skins: Vec<Skin>,
    #[serde(default)]
    pub(super) animations: Vec<IgnoredAny>,
    #[serde(default)]
    pub(super) cameras: Vec<IgnoredAny>,
    #[serde(default)]
    pub(super) extensions: RootExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) lights: Option<IgnoredAny>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default, deserialize_with = "all_whole")]
    pub(super) nodes: Vec<u32>,
}

// Boxes keep a node small: a hostile file has one for every three bytes.
#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default, deserialize_with = "all_whole")]
    pub(super) children: Vec<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) mesh: Option<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) skin: Option<u32>,
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
    #[serde(default)]
    pub(super) extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instances: Option<Box<Instances>>,
    #[serde(rename = "KHR_node_visibility")]
    pub(super) visibility: Option<Visibility>,
}

/// Where copies of a node's mesh are, and nothing at the node itself.
#[derive(Debug, Deserialize)]
pub(super) struct Instances {
    #[serde(default)]
    pub(super) attributes: InstanceAttributes,
}

/// The accessors of the copies' transforms.
#[derive(Debug, Default, Clone, Copy, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct InstanceAttributes {
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) translation: Option<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) rotation: Option<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) scale: Option<u32>,
}

/// Whether a node and all below it are shown.
#[derive(Debug, Deserialize)]
pub(super) struct Visibility {
    #[serde(default = "yes")]
    pub(super) visible: bool,
}

fn yes() -> bool {
    true
}

/// Bones, and what takes a mesh to where each of them was when they were put in.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    #[serde(default, deserialize_with = "all_whole")]
    pub(super) joints: Vec<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) inverse_bind_matrices: Option<u32>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

/// A part of a mesh.
#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Semantics,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) indices: Option<u32>,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) material: Option<u32>,
    #[serde(default = "triangles", deserialize_with = "whole")]
    pub(super) mode: u32,
    #[serde(default)]
    pub(super) targets: Vec<IgnoredAny>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(super) draco: Option<Box<Draco>>,
}

/// A primitive whose accessors are in a Draco stream.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Draco {
    #[serde(deserialize_with = "maybe_whole")]
    pub(super) buffer_view: Option<u32>,
    pub(super) attributes: DracoAttributes,
}

/// The numbers by which the stream knows attributes.
#[derive(Debug, Default, Deserialize)]
pub(super) struct DracoAttributes {
    #[serde(rename = "POSITION", default, deserialize_with = "maybe_whole")]
    pub(super) position: Option<u32>,
}

/// The accessors of a primitive's vertices.
#[derive(Debug, Default)]
pub(super) struct Semantics {
    pub(super) position: Option<u32>,
    pub(super) normal: Option<u32>,
    pub(super) tangent: Option<u32>,
    /// The names of the others.
    pub(super) others: Vec<String>,
}

impl<'de> Deserialize<'de> for Semantics {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(SemanticsVisitor)
    }
}

struct SemanticsVisitor;

impl<'de> Visitor<'de> for SemanticsVisitor {
    type Value = Semantics;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object that names accessors")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Semantics, M::Error> {
        let mut found = Semantics::default();
        while let Some((name, accessor)) = map.next_entry::<String, Whole>()? {
            let accessor = accessor.fit()?;
            let slot = match name.as_str() {
                "POSITION" => &mut found.position,
                "NORMAL" => &mut found.normal,
                "TANGENT" => &mut found.tangent,
                _ => {
                    found.others.push(name);
                    continue;
                }
            };
            if slot.replace(accessor).is_some() {
                return Err(M::Error::custom(format_args!("duplicate field `{name}`")));
            }
        }
        Ok(found)
    }
}

/// Elements of one type in a buffer view.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor<'a> {
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) buffer_view: Option<u32>,
    #[serde(default, deserialize_with = "whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    #[serde(deserialize_with = "whole")]
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: Shape,
    #[serde(borrow)]
    pub(super) min: Option<&'a RawValue>,
    #[serde(borrow)]
    pub(super) max: Option<&'a RawValue>,
    pub(super) sparse: Option<Box<Sparse>>,
}

/// How many numbers make an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
    #[serde(other)]
    Unknown,
}

impl Shape {
    pub(super) fn width(self) -> u8 {
        match self {
            Self::Scalar | Self::Unknown => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
            Self::Vec4 | Self::Mat2 => 4,
            Self::Mat3 => 9,
            Self::Mat4 => 16,
        }
    }
}

/// Elements that stand elsewhere than the others of their accessor.
#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    #[serde(deserialize_with = "whole")]
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    #[serde(deserialize_with = "whole")]
    pub(super) buffer_view: u32,
    #[serde(default, deserialize_with = "whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    #[serde(deserialize_with = "whole")]
    pub(super) buffer_view: u32,
    #[serde(default, deserialize_with = "whole")]
    pub(super) byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    #[serde(deserialize_with = "whole")]
    pub(super) buffer: u32,
    #[serde(default, deserialize_with = "whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) byte_length: u64,
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) byte_stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: ViewExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
    pub(super) packed: Option<Box<Packed>>,
}

/// Where the stream of a compressed buffer view stands, and what is in it. What is missing matters only where it is read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Packed {
    #[serde(deserialize_with = "whole")]
    pub(super) buffer: u32,
    #[serde(deserialize_with = "whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) byte_length: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) byte_stride: u64,
    #[serde(deserialize_with = "whole")]
    pub(super) count: u64,
    pub(super) mode: Mode,
    pub(super) filter: Filter,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer<'a> {
    #[serde(borrow)]
    pub(super) uri: Option<&'a RawValue>,
    #[serde(deserialize_with = "whole")]
    pub(super) byte_length: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    #[serde(default, deserialize_with = "maybe_whole")]
    pub(super) buffer_view: Option<u32>,
}

/// A string of the JSON, without its quotes and escapes.
#[derive(Debug, Deserialize)]
pub(super) struct Text<'a>(#[serde(borrow)] pub(super) Cow<'a, str>);

/// Where in `text` a part of it stands.
pub(super) fn span(text: &str, part: &str) -> Option<Range<usize>> {
    let start = part.as_ptr().addr().checked_sub(text.as_ptr().addr())?;
    let range = start..start.checked_add(part.len())?;
    (text.get(range.clone())? == part).then_some(range)
}

/// Where in `text` the three numbers of a `min` or `max` stand; `None` when it is no array of three.
pub(super) fn spans_of_three(text: &str, array: &RawValue) -> Option<[Range<usize>; 3]> {
    let parts: [&RawValue; 3] = serde_json::from_str(array.get()).ok()?;
    let [x, y, z] = parts.map(|part| span(text, part.get()));
    Some([x?, y?, z?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_text_are_found_in_it() {
        let text = r#"{"byteLength": 1, "uri" : "a\/b" }"#;
        let buffer: Buffer<'_> = serde_json::from_str(text).unwrap();
        let uri = buffer.uri.unwrap();
        assert_eq!(&text[span(text, uri.get()).unwrap()], r#""a\/b""#);
        assert_eq!(serde_json::from_str::<Text<'_>>(uri.get()).unwrap().0, "a/b");
        assert_eq!(span(text, "elsewhere"), None);
    }

    #[test]
    fn three_numbers_have_three_spans() {
        let text = "[ 1.50,-2e3 ,\n0 ]";
        let array: &RawValue = serde_json::from_str(text).unwrap();
        let spans = spans_of_three(text, array).unwrap();
        assert_eq!(spans.map(|s| &text[s]), ["1.50", "-2e3", "0"]);
        let two: &RawValue = serde_json::from_str("[1, 2]").unwrap();
        assert_eq!(spans_of_three(two.get(), two), None);
    }
}
