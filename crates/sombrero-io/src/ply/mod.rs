//! PLY: a text header that declares elements and their properties, then rows of values, as text or binary.
//!
//! Read: any property types in any order, lists anywhere, elements before, between and after; `vertex` with
//! `x y z`, `face` with `vertex_indices` or `vertex_index`, `tristrips` with -1 between strips. Every other
//! property and element is kept unread. Only the values of `x y z` are rewritten, in their own number type;
//! positions of an integer type can be read but not moved.

mod body;
mod element;
mod faces;
mod header;
mod names;
mod scalar;
mod vertices;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::decimals::Words;
use crate::error::{ParseError, WriteError};
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::{Limits, Source};
use crate::normals::Stored;
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};
use crate::polygon::Faces;
use crate::text;

use body::{Ascii, Binary, Body};
use element::{AXES, Axes, Element, NORMAL};
use header::{Encoding, Header};

/// The format's row.
pub(crate) static FAMILY: Family = Family {
    name: "PLY",
    variants: &[&LITTLE_ENDIAN, &BIG_ENDIAN, &ASCII],
    recognise: |bytes| Evidence::Certain.when(header::is_ply(bytes)),
    parse,
    empty: ParseError::NoVertices,
};

/// A text header and binary rows, least significant byte first.
pub(crate) static LITTLE_ENDIAN: Variant = Variant {
    format: Format::PlyBinaryLittleEndian,
    name: "PLY (binary, little endian)",
    extension: "ply",
    needs_triangles: false,
    encode: |soup| Ok(encode(Encoding::LittleEndian, soup)),
};

/// A text header and binary rows, most significant byte first.
pub(crate) static BIG_ENDIAN: Variant = Variant {
    format: Format::PlyBinaryBigEndian,
    name: "PLY (binary, big endian)",
    extension: "ply",
    needs_triangles: false,
    encode: |soup| Ok(encode(Encoding::BigEndian, soup)),
};

/// Text.
pub(crate) static ASCII: Variant = Variant {
    format: Format::PlyAscii,
    name: "PLY (ASCII)",
    extension: "ply",
    needs_triangles: false,
    encode: |soup| Ok(encode(Encoding::Ascii, soup)),
};

/// Where the coordinates stand.
#[derive(Debug)]
struct Layout {
    encoding: Encoding,
    element: Element,
    rows: vertices::Rows,
}

impl parsed::Layout for Layout {
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        Ok(self.rewrite_axes(AXES, original.bytes, &original.soup.points, points)?.into())
    }

    fn misplaced(&self, bytes: &[u8], vertex: usize) -> ParseError {
        let Self { encoding, element, rows } = self;
        match encoding {
            Encoding::Ascii => vertices::misplaced(Ascii::new(bytes, 0), element, rows, vertex),
            Encoding::LittleEndian => {
                vertices::misplaced(Binary::<false>::new(bytes, 0), element, rows, vertex)
            }
            Encoding::BigEndian => vertices::misplaced(Binary::<true>::new(bytes, 0), element, rows, vertex),
        }
    }

    fn words(&self, original: &Original<'_>) -> Option<Words> {
        let text = self.encoding == Encoding::Ascii;
        text.then(|| vertices::words(Ascii::new(original.bytes, 0), &self.element, &self.rows))
    }

    fn turn_normals(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
    ) -> Result<Option<Vec<u8>>, WriteError> {
        let Some(normals) = self.normals(original) else { return Ok(None) };
        let (old, new) = normals.turned(original.soup, points);
        self.rewrite_axes(NORMAL, original.bytes, &old, &new).map(Some)
    }
}

impl Layout {
    fn rewrite_axes(
        &self,
        axes: Axes,
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

    /// The normals of the vertices, if they have usable ones.
    fn normals(&self, original: &Original<'_>) -> Option<Stored> {
        let Self { encoding, element, rows } = self;
        let source = original.bytes;
        let stored = match encoding {
            Encoding::Ascii => vertices::normals(Ascii::new(source, 0), element, rows),
            Encoding::LittleEndian => vertices::normals(Binary::<false>::new(source, 0), element, rows),
            Encoding::BigEndian => vertices::normals(Binary::<true>::new(source, 0), element, rows),
        };
        let corners = original.soup.triangles.clone();
        Some(Stored { values: stored?, corners, slots: Vec::new(), text: *encoding == Encoding::Ascii })
    }
}

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
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
    let with_values = header.elements.iter().filter(|element| !element.properties.is_empty());
    body.expect(with_values.fold(0, |rows, element| rows.saturating_add(element.count as u64)));
    let (mut points, mut rows, mut faces) = (Vec::new(), vertices::Rows::default(), Faces::default());
    for (index, element) in header.elements.iter().enumerate() {
        body::check_claim(&body, element)?;
        if index == header.vertex {
            limits.check_vertices(element.count)?;
        }
        match element.name.as_str() {
            _ if index == header.vertex => (points, rows) = vertices::read(&mut body, element)?,
            "face" => faces::read(&mut body, element, count, faces::Shape::Polygon, &mut faces)?,
            "tristrips" => faces::read(&mut body, element, count, faces::Shape::Strip, &mut faces)?,
            _ => body::skip_rows(&mut body, element)?,
        }
    }
    let mut attributes = names::attributes(&header);
    if body.has_excess() {
        attributes.note("undeclared values");
    }
    let fixed = vertices::is_fixed(header.vertex());
    let fixed =
        fixed.then(|| "Positions are stored as whole numbers and cannot move; store them as floats.".into());
    let Header { encoding, mut elements, vertex, .. } = header;
    let element = elements.swap_remove(vertex);
    let layout = Layout { encoding, element, rows };
    let Faces { triangles, polygons } = faces;
    Ok(Parsed { fixed, polygons, ..Parsed::new(format, Soup::new(points, triangles), attributes, layout) })
}

/// A new file with 64-bit positions and triangles.
fn encode(encoding: Encoding, soup: &Soup) -> Vec<u8> {
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
