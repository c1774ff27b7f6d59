//! PLY: a text header that declares elements and their properties, then rows of values, as text or binary.
//!
//! Read: any property types in any order, lists anywhere, elements before, between and after; `vertex` with
//! `x y z`, `face` with `vertex_indices` or `vertex_index`, `tristrips` with -1 between strips. Every other
//! property and element is kept unread. Only the values of `x y z` are rewritten, in their own number type;
//! positions of an integer type can be read but not moved.

mod body;
mod faces;
mod header;
mod names;
mod scalar;
mod vertices;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::document::{self, Parsed};
use crate::error::{ParseError, WriteError};
use crate::format::Format;
use crate::input::Limits;
use crate::normals::Stored;
use crate::text;

use body::{Ascii, Binary, Body};
use header::{Element, Header};

pub(crate) use header::{Encoding, is_ply};

/// Where the coordinates stand.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    encoding: Encoding,
    element: Element,
    rows: vertices::Rows,
}

impl Layout {
    pub(crate) fn rewrite(
        &self,
        source: &[u8],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        self.rewrite_axes(vertices::AXES, source, old, new)
    }

    /// Other normals in the place of those that [`normals`](Self::normals) found.
    pub(crate) fn rewrite_normals(
        &self,
        source: &[u8],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        self.rewrite_axes(vertices::NORMAL, source, old, new)
    }

    fn rewrite_axes(
        &self,
        axes: vertices::Axes,
        source: &[u8],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        let Self { element, rows, .. } = self;
        match self.encoding {
            Encoding::Ascii => vertices::rewrite(Ascii::new(source, 0), element, axes, rows, old, new),
            Encoding::LittleEndian => {
                vertices::rewrite(Binary::<false>::new(source, 0), element, axes, rows, old, new)
            }
            Encoding::BigEndian => {
                vertices::rewrite(Binary::<true>::new(source, 0), element, axes, rows, old, new)
            }
        }
    }

    /// The normals of the vertices, if they have usable ones. `source` was read before.
    pub(crate) fn normals(&self, source: &[u8], triangles: &[[u32; 3]]) -> Option<Stored> {
        let Self { encoding, element, rows } = self;
        let stored = match encoding {
            Encoding::Ascii => vertices::normals(Ascii::new(source, 0), element, rows),
            Encoding::LittleEndian => vertices::normals(Binary::<false>::new(source, 0), element, rows),
            Encoding::BigEndian => vertices::normals(Binary::<true>::new(source, 0), element, rows),
        };
        let text = *encoding == Encoding::Ascii;
        Some(Stored { values: stored?, corners: triangles.to_vec(), slots: Vec::new(), text })
    }
}

/// Reads the whole file.
pub(crate) fn parse(bytes: &[u8], limits: Limits) -> Result<Parsed, ParseError> {
    let header = header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => read(header, Ascii::new(bytes, 0), limits, Format::PlyAscii),
        Encoding::LittleEndian => {
            read(header, Binary::<false>::new(bytes, 0), limits, Format::PlyBinaryLittleEndian)
        }
        Encoding::BigEndian => {
            read(header, Binary::<true>::new(bytes, 0), limits, Format::PlyBinaryBigEndian)
        }
    }
}

fn read<'a, B: Body<'a>>(
    header: Header,
    mut body: B,
    limits: Limits,
    format: Format,
) -> Result<Parsed, ParseError> {
    body.seek(header.start);
    let count = header.vertex().count;
    let (mut points, mut rows, mut triangles) = (Vec::new(), vertices::Rows::default(), Vec::new());
    for (index, element) in header.elements.iter().enumerate() {
        body::check_claim(&body, element)?;
        if index == header.vertex {
            limits.check_vertices(element.count)?;
        }
        match element.name.as_str() {
            _ if index == header.vertex => (points, rows) = vertices::read(&mut body, element)?,
            "face" => faces::read(&mut body, element, count, faces::Shape::Polygon, &mut triangles)?,
            "tristrips" => faces::read(&mut body, element, count, faces::Shape::Strip, &mut triangles)?,
            _ => body::skip_rows(&mut body, element)?,
        }
    }
    let attributes = names::attributes(&header);
    let fixed = vertices::is_fixed(header.vertex());
    let fixed =
        fixed.then(|| "Positions are stored as whole numbers and cannot move; store them as floats.".into());
    let Header { encoding, mut elements, vertex, .. } = header;
    let element = elements.swap_remove(vertex);
    Ok(Parsed {
        format,
        soup: Soup::new(points, triangles),
        attributes,
        layout: document::Layout::Ply(Layout { encoding, element, rows }),
        fixed,
        ..Parsed::default()
    })
}

/// A new file with 64-bit positions and triangles.
pub(crate) fn encode(encoding: Encoding, soup: &Soup) -> Vec<u8> {
    let mut out = header::plain(encoding, soup.points.len(), soup.triangles.len());
    match encoding {
        Encoding::Ascii => encode_text(soup, &mut out),
        Encoding::LittleEndian => encode_binary(soup, &mut out, f64::to_le_bytes, u32::to_le_bytes),
        Encoding::BigEndian => encode_binary(soup, &mut out, f64::to_be_bytes, u32::to_be_bytes),
    }
    out
}

fn encode_text(soup: &Soup, out: &mut Vec<u8>) {
    for point in &soup.points {
        text::push_point(out, point);
        out.push(b'\n');
    }
    for triangle in &soup.triangles {
        out.push(b'3');
        for &corner in triangle {
            out.push(b' ');
            text::push_integer(out, corner.into());
        }
        out.push(b'\n');
    }
}

fn encode_binary(soup: &Soup, out: &mut Vec<u8>, float: fn(f64) -> [u8; 8], index: fn(u32) -> [u8; 4]) {
    out.reserve(24 * soup.points.len() + 13 * soup.triangles.len());
    for &value in soup.points.iter().flat_map(|point| point.iter()) {
        out.extend_from_slice(&float(value));
    }
    for triangle in &soup.triangles {
        out.push(3);
        for &corner in triangle {
            out.extend_from_slice(&index(corner));
        }
    }
}

#[cfg(test)]
mod tests;
