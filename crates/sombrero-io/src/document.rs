//! A mesh file kept whole, whose vertex positions can be replaced.

use std::path::Path;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::error::{ParseError, ReadError, WriteError};
use crate::format::{Family, Format};
use crate::input::{Limits, read_bytes};
use crate::{obj, off, ply, stl};

/// What a reader finds in a file.
#[derive(Debug, Clone)]
pub(crate) struct Parsed {
    pub(crate) format: Format,
    pub(crate) soup: Soup,
    pub(crate) attributes: Vec<String>,
    pub(crate) layout: Layout,
}

/// Where a file's positions stand, in the terms of its format.
#[derive(Debug, Clone)]
pub(crate) enum Layout {
    Obj(obj::Layout),
    Ply(ply::Layout),
    Off(off::Layout),
    Stl(stl::Layout),
}

/// A mesh file: all its bytes, and where among them the vertex positions stand.
///
/// Everything but positions is out of reach, so whatever [`with_points`](Self::with_points) returns has the
/// same order, faces, materials, names and comments as the file that was read.
#[derive(Debug, Clone)]
pub struct Document {
    bytes: Vec<u8>,
    parsed: Parsed,
}

impl Document {
    /// Reads a mesh from the content of a file.
    ///
    /// The format is told by content; `extension` (without the dot) counts only if the content leaves it open.
    ///
    /// # Errors
    ///
    /// A [`ParseError`] that names the line or element where the content is not a usable mesh.
    pub fn parse(bytes: Vec<u8>, extension: Option<&str>) -> Result<Self, ParseError> {
        if bytes.is_empty() {
            return Err(ParseError::Empty);
        }
        let parsed = match Family::of(&bytes, extension).ok_or(ParseError::Unrecognised)? {
            Family::Obj => obj::parse(&bytes),
            Family::Ply => ply::parse(&bytes),
            Family::Off => off::parse(&bytes),
            Family::Stl => stl::parse(&bytes),
        }?;
        match u32::try_from(parsed.soup.points.len()) {
            Ok(0) => Err(ParseError::NoVertices),
            Ok(_) => Ok(Self { bytes, parsed }),
            Err(_) => Err(ParseError::TooManyVertices),
        }
    }

    /// Reads the mesh file at `path` within the default [`Limits`].
    ///
    /// # Errors
    ///
    /// A [`ReadError`] that names the file: it cannot be opened, is no regular file, is too large, or
    /// [`parse`](Self::parse) fails.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_within(path, Limits::default())
    }

    /// Like [`read`](Self::read), with other limits.
    ///
    /// # Errors
    ///
    /// As for [`read`](Self::read).
    pub fn read_within(path: &Path, limits: Limits) -> Result<Self, ReadError> {
        let bytes = read_bytes(path, limits)?;
        let extension = path.extension().and_then(|e| e.to_str());
        Self::parse(bytes, extension).map_err(|source| ReadError::Parse { path: path.to_owned(), source })
    }

    /// The format the content is in.
    pub fn format(&self) -> Format {
        self.parsed.format
    }

    /// The file as it was read.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Vertex positions in the file's order. STL stores no vertices but three corners for each facet.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.parsed.soup.points
    }

    /// Triangles as indices into [`points`](Self::points), in the file's order, polygons split as fans.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.parsed.soup.triangles
    }

    /// A copy of points and triangles.
    pub fn soup(&self) -> Soup {
        self.parsed.soup.clone()
    }

    /// Names of what the file holds beside positions and faces, such as `normals`, `texture coordinates`,
    /// `materials`, or a PLY property like `confidence`.
    pub fn attributes(&self) -> &[String] {
        &self.parsed.attributes
    }

    /// The same file with new positions, one for each of [`points`](Self::points); every other byte stays.
    ///
    /// A coordinate that is the same to the bit keeps its spelling. Text formats get the shortest number that
    /// reads back the same; binary ones keep their number type, so 32-bit floats are rounded to the nearest.
    /// STL facets with a corner that moved get a new normal, unless theirs was zero ("work it out yourself").
    ///
    /// # Errors
    ///
    /// A [`WriteError`] when the number of positions is wrong, or one is not finite or does not fit the file's
    /// number type.
    pub fn with_points(&self, points: &[Point3<f64>]) -> Result<Vec<u8>, WriteError> {
        let old = self.points();
        if points.len() != old.len() {
            return Err(WriteError::WrongCount { given: points.len(), expected: old.len() });
        }
        check_finite(points)?;
        match &self.parsed.layout {
            Layout::Obj(layout) => Ok(layout.rewrite(&self.bytes, old, points)),
            Layout::Ply(layout) => layout.rewrite(&self.bytes, old, points),
            Layout::Off(layout) => Ok(layout.rewrite(&self.bytes, old, points)),
            Layout::Stl(layout) => layout.rewrite(&self.bytes, old, points),
        }
    }
}

/// A plain new file that holds `soup` and nothing else.
///
/// PLY gets 64-bit coordinates, so only STL (32-bit, and three corners for each triangle) changes anything.
///
/// # Errors
///
/// A [`WriteError`] when there is nothing to write, an index or a coordinate is unusable, or the format cannot
/// hold that much.
pub fn encode(format: Format, soup: &Soup) -> Result<Vec<u8>, WriteError> {
    check(format, soup)?;
    match format {
        Format::Obj => Ok(obj::encode(soup)),
        Format::PlyAscii => Ok(ply::encode(ply::Encoding::Ascii, soup)),
        Format::PlyBinaryLittleEndian => Ok(ply::encode(ply::Encoding::LittleEndian, soup)),
        Format::PlyBinaryBigEndian => Ok(ply::encode(ply::Encoding::BigEndian, soup)),
        Format::Off => Ok(off::encode(soup)),
        Format::StlAscii => Ok(stl::encode_ascii(soup)),
        Format::StlBinary => stl::encode_binary(soup),
    }
}

fn check(format: Format, soup: &Soup) -> Result<(), WriteError> {
    let needs_triangles = matches!(format, Format::StlAscii | Format::StlBinary);
    if soup.points.is_empty() || (needs_triangles && soup.triangles.is_empty()) {
        return Err(WriteError::Nothing { format });
    }
    let count = soup.points.len();
    for (triangle, corners) in soup.triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&corner| corner as usize >= count) {
            return Err(WriteError::IndexOutOfRange { triangle, index, count });
        }
    }
    check_finite(&soup.points)
}

fn check_finite(points: &[Point3<f64>]) -> Result<(), WriteError> {
    match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(vertex) => Err(WriteError::NonFinite { vertex }),
        None => Ok(()),
    }
}
