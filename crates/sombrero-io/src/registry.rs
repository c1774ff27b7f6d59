//! The table of formats: one row each, kept where the format is.
//!
//! # How to add a format
//!
//! 1. A variant of [`Format`] for each way to write it.
//! 2. A module with a reader that returns a [`Parsed`](crate::parsed::Parsed), a type that implements
//!    [`Layout`](crate::parsed::Layout) and says where positions stand, a function that writes a plain new file,
//!    and the row `FAMILY` (a [`Family`]) with a [`Variant`] for each way to write it. `off` is a short example.
//! 3. The row in [`FAMILIES`], and in [`variant`] an arm for each variant, which the compiler asks for.
//!
//! The tests below and those of `properties.rs` then hold for it without another line, except that
//! `properties::rest` wants to know which bytes of a file are not positions.

use std::fmt;

use sombrero_mesh::Soup;

use crate::coordinate::check_finite;
use crate::error::WriteError;
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::{gltf, obj, off, ply, stl, threemf};

/// All formats, in the order in which they are asked whether a file is theirs.
///
/// STL first: its free header may begin like any other format, but only its length fits exactly.
pub(crate) static FAMILIES: [&Family; 6] =
    [&stl::FAMILY, &gltf::FAMILY, &threemf::FAMILY, &ply::FAMILY, &off::FAMILY, &obj::FAMILY];

/// The row of a variant.
fn variant(format: Format) -> &'static Variant {
    match format {
        Format::Obj => &obj::OBJ,
        Format::PlyAscii => &ply::ASCII,
        Format::PlyBinaryLittleEndian => &ply::LITTLE_ENDIAN,
        Format::PlyBinaryBigEndian => &ply::BIG_ENDIAN,
        Format::Off => &off::ASCII,
        Format::OffBinary => &off::BINARY,
        Format::StlAscii => &stl::ASCII,
        Format::StlBinary => &stl::BINARY,
        Format::Gltf => &gltf::TEXT,
        Format::Glb => &gltf::BINARY,
        Format::ThreeMf => &threemf::ARCHIVE,
    }
}

/// The format whose files have this extension (without the dot, in any case), and what new ones are written in.
fn named(extension: &str) -> Option<(&'static Family, &'static Variant)> {
    let variants =
        FAMILIES.iter().flat_map(|family| family.variants.iter().map(|variant| (*family, *variant)));
    variants.into_iter().find(|(_, variant)| extension.eq_ignore_ascii_case(variant.extension))
}

/// The format whose files have this extension (without the dot, in any case).
pub(crate) fn by_extension(extension: &str) -> Option<&'static Family> {
    named(extension).map(|(family, _)| family)
}

/// The format of a file. Content decides; the extension counts where it could be several, and where it says nothing.
pub(crate) fn recognise(bytes: &[u8], extension: Option<&str>) -> Option<&'static Family> {
    let named = extension.and_then(by_extension);
    let evidence = |family: &&Family| (family.recognise)(bytes);
    let fits = |family: &&'static Family| evidence(family) >= Evidence::Likely;
    let certain = || FAMILIES.iter().any(|family| evidence(family) == Evidence::Certain);
    let trusted =
        |family: &&'static Family| fits(family) || (evidence(family) == Evidence::Possible && !certain());
    named.filter(trusted).or_else(|| FAMILIES.into_iter().find(fits)).or(named)
}

/// A plain new file that holds `soup` and nothing else.
///
/// Text keeps all digits and PLY has 64-bit coordinates; binary STL and glTF round to 32-bit floats, and STL gives every
/// triangle three points of its own.
///
/// # Errors
///
/// A [`WriteError`] when there is nothing to write, an index or a coordinate is unusable, or the format cannot
/// hold that much.
pub fn encode(format: Format, soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let variant = variant(format);
    if soup.points.is_empty() || (variant.needs_triangles && soup.triangles.is_empty()) {
        return Err(WriteError::Nothing { format });
    }
    let count = soup.points.len();
    for (triangle, corners) in soup.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&corner| corner as usize >= count) {
            return Err(WriteError::IndexOutOfRange { triangle, index, count });
        }
    }
    check_finite(&soup.points)?;
    (variant.encode)(soup)
}

impl Format {
    /// What the name of a file in this format ends with, without the dot.
    pub fn extension(self) -> &'static str {
        variant(self).extension
    }

    /// The format to write a new file in when its name ends with `extension` (without the dot, in any case).
    ///
    /// Where a format has a binary form, that is the one.
    pub fn from_extension(extension: &str) -> Option<Self> {
        named(extension).map(|(_, variant)| variant.format)
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(variant(*self).name)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::Document;

    fn told(bytes: &[u8], extension: Option<&str>) -> Option<&'static str> {
        recognise(bytes, extension).map(|family| family.name)
    }

    fn variants() -> impl Iterator<Item = (&'static Family, &'static Variant)> {
        FAMILIES.into_iter().flat_map(|family| family.variants.iter().map(move |variant| (family, *variant)))
    }

    #[test]
    fn every_row_recognises_its_own_sample_and_no_other() {
        let soup = sombrero_shapes::tetrahedron();
        for (own, variant) in variants() {
            let sample = encode(variant.format, &soup).unwrap();
            for family in FAMILIES {
                let fits = (family.recognise)(&sample) >= Evidence::Likely;
                assert_eq!(fits, family.name == own.name, "{} by {}", variant.name, family.name);
            }
            // Its own name and that of any other format lead to the same reader.
            for (named, other) in variants() {
                let found = Document::parse(sample.clone(), Some(other.extension)).unwrap();
                assert_eq!(found.format(), variant.format, "called {}", named.name);
            }
        }
    }

    #[test]
    fn every_extension_is_of_one_format_and_every_variant_has_one_row() {
        let mut owners = HashMap::new();
        for (family, row) in variants() {
            assert_eq!(*owners.entry(row.extension).or_insert(family.name), family.name);
            assert_eq!(by_extension(row.extension).unwrap().name, family.name);
            assert_eq!(row.extension, row.extension.to_ascii_lowercase());
            assert!(std::ptr::eq(variant(row.format), row), "{}", row.name);
        }
        let mut names: Vec<_> = variants().map(|(_, row)| row.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), variants().count());
    }

    #[test]
    fn content_wins_over_extension() {
        assert_eq!(told(b"ply\nformat ascii 1.0\n", Some("obj")), Some("PLY"));
        assert_eq!(told(b"# made by hand\n\nv 0 0 0\n", Some("stl")), Some("OBJ"));
        assert_eq!(told(b"OFF\n1 0 0\n0 0 0\n", None), Some("OFF"));
        assert_eq!(told(b"solid x\n facet normal 0 0 1\n", Some("off")), Some("STL"));
    }

    #[test]
    fn a_text_as_long_as_a_binary_stl_is_what_its_name_says() {
        // Found by mutation: 84 bytes of which the last four are zero are an STL without facets, too.
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let text = format!("{vertices:80}\0\0\0\0").into_bytes();
        for extension in [Some("obj"), Some("stl"), None] {
            assert_eq!(told(&text, extension), Some("OBJ"));
        }
        let text = format!("{vertices:80}\u{1}\0\0\0{:50}", "").into_bytes();
        assert_eq!(told(&text, Some("obj")), Some("OBJ"));
        assert_eq!(told(&text, Some("stl")), Some("STL"));
        assert_eq!(told(&text, None), Some("STL"));
    }

    #[test]
    fn a_binary_stl_with_more_behind_it_and_words_in_its_header_is_what_its_name_says() {
        // Found by fuzzing: a header may begin like any text.
        for header in ["v 1 2 3", "# made by hand", "OFF", "solid a\nfacet"] {
            let mut bytes = format!("{header:80}\u{1}\0\0\0").into_bytes();
            bytes.extend([0; 60]);
            assert_eq!(told(&bytes, Some("stl")), Some("STL"), "{header}");
        }
    }

    #[test]
    fn extension_decides_what_content_leaves_open() {
        assert_eq!(told(b"1 0 0\n0 0 0\n", Some("OFF")), Some("OFF"));
        assert_eq!(told(b"1 0 0\n0 0 0\n", None), None);
        assert_eq!(told(b"1 0 0\n0 0 0\n", Some("txt")), None);
    }

    #[test]
    fn extensions_are_taken_in_any_case() {
        assert_eq!(Format::from_extension("STL"), Some(Format::StlBinary));
        assert_eq!(Format::from_extension("ply"), Some(Format::PlyBinaryLittleEndian));
        assert_eq!(Format::from_extension("Obj"), Some(Format::Obj));
        assert_eq!(Format::from_extension("off"), Some(Format::Off));
        assert_eq!(Format::from_extension("docx"), None);
    }

    #[test]
    fn names_are_for_people() {
        assert_eq!(Format::PlyBinaryBigEndian.to_string(), "PLY (binary, big endian)");
        assert_eq!(Format::Obj.to_string(), "OBJ");
    }
}
