//! STL: facets, each with a normal and three corners of its own, as text or in 50-byte records.
//!
//! Kept: the header, solid names, attribute bytes, whatever follows the last facet. Positions are rewritten,
//! and with them the normals of facets whose corners moved. Refused: a binary file shorter than its facets
//! need, a text that ends before `endsolid`.

mod ascii;
mod binary;
mod facet;

use crate::error::ParseError;
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::Parsed;

/// The format's row.
pub(crate) static FAMILY: Family =
    Family { name: "STL", variants: &[&BINARY, &ASCII], recognise, parse, empty: ParseError::NoVertices };

/// 50-byte records.
pub(crate) static BINARY: Variant = Variant {
    format: Format::StlBinary,
    name: "STL (binary)",
    extension: "stl",
    needs_triangles: true,
    encode: binary::encode,
};

/// Text.
pub(crate) static ASCII: Variant = Variant {
    format: Format::StlAscii,
    name: "STL (ASCII)",
    extension: "stl",
    needs_triangles: true,
    encode: |soup| Ok(ascii::encode(soup)),
};

fn recognise(bytes: &[u8]) -> Evidence {
    if binary::is_binary(bytes) || ascii::is_ascii(bytes) {
        Evidence::Likely
    } else {
        Evidence::Possible.when(binary::may_be_binary(bytes))
    }
}

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    // Many binary headers begin with `solid` too: only the length tells, or a zero in the count. Neither changes when
    // positions do.
    if !binary::has_exact_length(source.bytes) && !binary::has_nul(source.bytes) {
        ascii::parse(source)
    } else {
        binary::parse(source)
    }
}
