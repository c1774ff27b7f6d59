//! The formats, and how a file's format is told.

use std::fmt;

use crate::{obj, off, ply, stl};

/// A mesh format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
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
        })
    }
}

impl Format {
    /// The format to write a new file in when its name ends with `extension` (without the dot, in any case).
    ///
    /// Where a format has a binary form, that is the one.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Some(match Family::from_extension(extension)? {
            Family::Obj => Self::Obj,
            Family::Ply => Self::PlyBinaryLittleEndian,
            Family::Off => Self::Off,
            Family::Stl => Self::StlBinary,
        })
    }
}

/// The formats that share a reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    Obj,
    Ply,
    Off,
    Stl,
}

impl Family {
    fn from_extension(extension: &str) -> Option<Self> {
        let known = [("obj", Self::Obj), ("ply", Self::Ply), ("off", Self::Off), ("stl", Self::Stl)];
        known.into_iter().find(|(name, _)| extension.eq_ignore_ascii_case(name)).map(|(_, family)| family)
    }

    /// Tells the format by what the bytes are, and only if they say nothing by the file's extension.
    pub(crate) fn of(bytes: &[u8], extension: Option<&str>) -> Option<Self> {
        Self::from_content(bytes).or_else(|| Self::from_extension(extension?))
    }

    fn from_content(bytes: &[u8]) -> Option<Self> {
        // Binary STL first: its free header may begin like any other format, but only its length fits exactly.
        if stl::has_binary_length(bytes) {
            Some(Self::Stl)
        } else if ply::is_ply(bytes) {
            Some(Self::Ply)
        } else if off::is_off(bytes) {
            Some(Self::Off)
        } else if stl::is_ascii(bytes) {
            Some(Self::Stl)
        } else if obj::is_obj(bytes) {
            Some(Self::Obj)
        } else {
            None
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
