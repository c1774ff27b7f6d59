//! OFF, the format of Geomview: a keyword, three counts, vertices, polygons, as text or in binary.
//!
//! Read: `OFF` and its variants with texture coordinates (`ST`), colours (`C`) and normals (`N`). What follows a position or
//! a polygon is kept unread, as is everything after the last polygon. Refused by name: positions that are not
//! three-dimensional (`4OFF`, `nOFF`).

mod ascii;
mod binary;
mod keyword;

use crate::error::ParseError;
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::Parsed;

use keyword::Keyword;

/// The format's row.
pub(crate) static FAMILY: Family = Family {
    name: "OFF",
    variants: &[&ASCII, &BINARY],
    recognise: |bytes| Evidence::Likely.when(Keyword::of(bytes).is_some()),
    parse,
    empty: ParseError::NoVertices,
};

/// Text.
pub(crate) static ASCII: Variant = Variant {
    format: Format::Off,
    name: "OFF",
    extension: "off",
    needs_triangles: false,
    encode: |soup| Ok(ascii::encode(soup)),
};

/// 32-bit numbers, most significant byte first.
pub(crate) static BINARY: Variant = Variant {
    format: Format::OffBinary,
    name: "OFF (binary)",
    extension: "off",
    needs_triangles: false,
    encode: binary::encode,
};

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let (keyword, start) = Keyword::of(source.bytes).unwrap_or_default();
    if let Some(what) = keyword.refused() {
        return Err(unsupported(what));
    }
    match binary::body(source.bytes, start) {
        Some(body) => binary::parse(source, keyword, body),
        None => ascii::parse(source, keyword, start),
    }
}

fn unsupported(what: &str) -> ParseError {
    ParseError::Unsupported { what: what.into(), cure: "save the model as plain OFF, PLY or OBJ" }
}
