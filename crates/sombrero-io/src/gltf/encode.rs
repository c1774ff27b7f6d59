//! A new glTF: one mesh of one primitive, with 32-bit positions and indices.

use std::fmt::Write as _;

use sombrero_mesh::Soup;

use super::buffers::data_uri;
use super::container;
use super::write::{NOTHING, widen};
use crate::coordinate::narrow;
use crate::error::WriteError;
use crate::format::Format;

/// As JSON with the buffer in a data URI.
pub(super) fn encode_text(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let buffer = buffer(soup)?;
    let uri = format!("\"uri\":{},", data_uri(&buffer));
    Ok(json(soup, &uri).into_bytes())
}

/// As GLB.
pub(super) fn encode_binary(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let too_many = || WriteError::TooMany { format: Format::Glb, count: soup.triangles.len() };
    container::pack(&json(soup, ""), &buffer(soup)?).ok_or_else(too_many)
}

fn buffer(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let mut out = Vec::with_capacity(12 * (soup.points.len() + soup.triangles.len()));
    for (vertex, point) in soup.points.iter().enumerate() {
        for &value in point.iter() {
            out.extend_from_slice(&narrow(vertex, value)?.to_le_bytes());
        }
    }
    out.extend(soup.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()));
    Ok(out)
}

fn json(soup: &Soup, uri: &str) -> String {
    let (points, corners) = (soup.points.len(), 3 * soup.triangles.len());
    let (begin, length) = (12 * points, 4 * corners);
    let [min, max] = bounds(soup);
    let mut out = String::from(
        r#"{"asset":{"version":"2.0","generator":"sombrero"},"scene":0,"scenes":[{"nodes":[0]}],"#,
    );
    out += r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],"#;
    let _ = write!(
        out,
        r#""accessors":[{{"bufferView":0,"componentType":5126,"count":{points},"type":"VEC3","min":{min:?},"max":{max:?}}},"#
    );
    let _ = write!(out, r#"{{"bufferView":1,"componentType":5125,"count":{corners},"type":"SCALAR"}}],"#);
    let _ = write!(out, r#""bufferViews":[{{"buffer":0,"byteLength":{begin},"target":34962}},"#);
    let _ = write!(out, r#"{{"buffer":0,"byteOffset":{begin},"byteLength":{length},"target":34963}}],"#);
    let _ = write!(out, r#""buffers":[{{{uri}"byteLength":{}}}]}}"#, begin + length);
    out
}

/// The smallest and largest coordinates, as they are stored.
fn bounds(soup: &Soup) -> [[f64; 3]; 2] {
    let mut bounds = NOTHING;
    for point in &soup.points {
        widen(&mut bounds, [point.x, point.y, point.z].map(|value| f64::from(value as f32)));
    }
    bounds
}
