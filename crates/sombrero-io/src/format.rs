//! The formats, and how a file's format is told.

use std::fmt;

use crate::document::Parsed;
use crate::error::ParseError;
use crate::input::Source;
use crate::{gltf, obj, off, ply, stl, threemf};

/// A mesh format.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    #[default]
    Obj,
    /// PLY with an ASCII body.
    PlyAscii,
    /// PLY with a binary body, least significant byte first.
    PlyBinaryLittleEndian,
    /// PLY with a binary body, most significant byte first.
    PlyBinaryBigEndian,
    /// OFF and its variants with colours, normals or texture coordinates.
    Off,
    /// STL as text.
    StlAscii,
    /// STL in 50-byte records.
    StlBinary,
    /// glTF as JSON, its buffers inside or in files beside it.
    Gltf,
    /// glTF as one binary file.
    Glb,
    /// 3MF: models as XML in a ZIP archive.
    ThreeMf,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::PlyAscii => "PLY (ASCII)",
            Self::PlyBinaryLittleEndian => "PLY (binary, little endian)",
            Self::PlyBinaryBigEndian => "PLY (binary, big endian)",
            Self::Off => "OFF",
            Self::StlAscii => "STL (ASCII)",
            Self::StlBinary => "STL (binary)",
            Self::Gltf => "glTF",
            Self::Glb => "glTF (binary)",
            Self::ThreeMf => "3MF",
        })
    }
}

impl Format {
    /// What the name of a file in this format ends with, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::PlyAscii | Self::PlyBinaryLittleEndian | Self::PlyBinaryBigEndian => "ply",
            Self::Off => "off",
            Self::StlAscii | Self::StlBinary => "stl",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::ThreeMf => "3mf",
        }
    }

    /// The format to write a new file in when its name ends with `extension` (without the dot, in any case).
    ///
    /// Where a format has a binary form, that is the one.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let usual = [
            Self::Obj,
            Self::PlyBinaryLittleEndian,
            Self::Off,
            Self::StlBinary,
            Self::Gltf,
            Self::Glb,
            Self::ThreeMf,
        ];
        usual.into_iter().find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }
}

/// The formats that share a reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    Obj,
    Ply,
    Off,
    Stl,
    Gltf,
    ThreeMf,
}

impl Family {
    /// The reader of a format.
    pub(crate) fn parse(self, source: Source<'_>) -> Result<Parsed, ParseError> {
        let Source { bytes, limits, .. } = source;
        match self {
            Self::Obj => obj::parse(bytes, limits),
            Self::Ply => ply::parse(bytes, limits),
            Self::Off => off::parse(bytes, limits),
            Self::Stl => stl::parse(bytes, limits),
            Self::Gltf => gltf::parse(source),
            Self::ThreeMf => threemf::parse(source),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Stl => "STL",
            Self::Gltf => "glTF",
            Self::ThreeMf => "3MF",
        }
    }

    /// Whether files are text and nothing else.
    pub(crate) fn is_text(self) -> bool {
        matches!(self, Self::Obj | Self::Off | Self::Gltf)
    }

    /// Why a file that is well-formed has no vertices.
    pub(crate) fn nothing(self) -> ParseError {
        match self {
            Self::Gltf | Self::ThreeMf => ParseError::NothingShown,
            _ => ParseError::NoVertices,
        }
    }

    /// The reader of files in `format`.
    pub(crate) fn of_format(format: Format) -> Self {
        match format {
            Format::Obj => Self::Obj,
            Format::PlyAscii | Format::PlyBinaryLittleEndian | Format::PlyBinaryBigEndian => Self::Ply,
            Format::Off => Self::Off,
            Format::StlAscii | Format::StlBinary => Self::Stl,
            Format::Gltf | Format::Glb => Self::Gltf,
            Format::ThreeMf => Self::ThreeMf,
        }
    }

    /// Tells the format by what the bytes are. The file's extension counts where they could be several, and where
    /// they say nothing.
    pub(crate) fn of(bytes: &[u8], extension: Option<&str>) -> Option<Self> {
        let named = extension.and_then(Format::from_extension).map(Self::of_format);
        let magic = || [Self::Gltf, Self::ThreeMf, Self::Ply].iter().any(|family| family.fits(bytes));
        if named == Some(Self::Stl) && stl::may_be_binary(bytes) && !magic() {
            return named;
        }
        // Binary STL first: its free header may begin like any other format, but only its length fits exactly.
        let all = [Self::Stl, Self::Gltf, Self::ThreeMf, Self::Ply, Self::Off, Self::Obj];
        named.into_iter().chain(all).find(|family| family.fits(bytes)).or(named)
    }

    /// Whether the bytes begin, or are as long, as this format would have it.
    fn fits(self, bytes: &[u8]) -> bool {
        match self {
            Self::Stl => stl::is_binary(bytes) || stl::is_ascii(bytes),
            Self::Gltf => gltf::is_gltf(bytes),
            Self::ThreeMf => threemf::is_zip(bytes),
            Self::Ply => ply::is_ply(bytes),
            Self::Off => off::is_off(bytes),
            Self::Obj => obj::is_obj(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_wins_over_extension() {
        assert_eq!(Family::of(b"ply\nformat ascii 1.0\n", Some("obj")), Some(Family::Ply));
        assert_eq!(Family::of(b"# made by hand\n\nv 0 0 0\n", Some("stl")), Some(Family::Obj));
        assert_eq!(Family::of(b"OFF\n1 0 0\n0 0 0\n", None), Some(Family::Off));
        assert_eq!(Family::of(b"solid x\n facet normal 0 0 1\n", Some("off")), Some(Family::Stl));
    }

    #[test]
    fn a_text_as_long_as_a_binary_stl_is_what_its_name_says() {
        // Found by mutation: 84 bytes of which the last four are zero are an STL without facets, too.
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let text = format!("{vertices:80}\0\0\0\0").into_bytes();
        for extension in [Some("obj"), Some("stl"), None] {
            assert_eq!(Family::of(&text, extension), Some(Family::Obj));
        }
        let text = format!("{vertices:80}\u{1}\0\0\0{:50}", "").into_bytes();
        assert_eq!(Family::of(&text, Some("obj")), Some(Family::Obj));
        assert_eq!(Family::of(&text, Some("stl")), Some(Family::Stl));
        assert_eq!(Family::of(&text, None), Some(Family::Stl));
    }

    #[test]
    fn a_binary_stl_with_more_behind_it_and_words_in_its_header_is_what_its_name_says() {
        // Found by fuzzing: a header may begin like any text.
        for header in ["v 1 2 3", "# made by hand", "OFF", "solid a\nfacet"] {
            let mut bytes = format!("{header:80}\u{1}\0\0\0").into_bytes();
            bytes.extend([0; 60]);
            assert_eq!(Family::of(&bytes, Some("stl")), Some(Family::Stl), "{header}");
        }
    }

    #[test]
    fn extension_decides_what_content_leaves_open() {
        assert_eq!(Family::of(b"1 0 0\n0 0 0\n", Some("OFF")), Some(Family::Off));
        assert_eq!(Family::of(b"1 0 0\n0 0 0\n", None), None);
        assert_eq!(Family::of(b"1 0 0\n0 0 0\n", Some("txt")), None);
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
