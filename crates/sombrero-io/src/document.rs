//! A mesh file kept whole, whose vertex positions can be replaced.

use std::borrow::Cow;
use std::path::Path;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::error::{ParseError, ReadError, WriteError};
use crate::format::{Family, Format};
use crate::input::{Limits, Source, read_bytes};
use crate::text::{self, Joining};
use crate::{gltf, normals, obj, off, ply, stl, threemf};

/// What a reader finds in a file.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parsed {
    pub(crate) format: Format,
    pub(crate) soup: Soup,
    pub(crate) attributes: Vec<String>,
    pub(crate) layout: Layout,
    /// Triangles that further instances of a mesh add to those of `soup`.
    pub(crate) repeated_triangles: u64,
    /// What is unusual, in sentences.
    pub(crate) notes: Vec<String>,
    /// Why positions cannot move, if they cannot.
    pub(crate) fixed: Option<String>,
    /// The files that this one refers to, as far as they hold geometry.
    pub(crate) companions: Vec<Companion>,
}

/// Where a file's positions stand, in the terms of its format.
#[derive(Debug, Clone)]
pub(crate) enum Layout {
    Obj(obj::Layout),
    Ply(ply::Layout),
    Off(off::Layout),
    Stl(stl::Layout),
    Gltf(Box<gltf::Layout>),
    ThreeMf(threemf::Layout),
}

impl Default for Layout {
    fn default() -> Self {
        Self::Obj(obj::Layout::default())
    }
}

/// A file that belongs to another one: a buffer that a glTF keeps beside itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Companion {
    /// Its name, relative to the folder of the file it belongs to.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// How a document with other positions is written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Rewrite {
    /// Turn stored normals (and tangents) as the faces around them turned. Default: they are data and stay.
    pub renew_normals: bool,
    /// The name (without extension) that the file will have. Buffers that a glTF keeps in files beside itself
    /// then are such files again, named after this. Default: none, so all is in one file.
    pub stem: Option<String>,
}

impl Rewrite {
    /// With normals and tangents turned, or not.
    pub fn with_renewed_normals(self, renew_normals: bool) -> Self {
        Self { renew_normals, ..self }
    }

    /// For a file of this name, without extension.
    pub fn with_stem(self, stem: impl Into<String>) -> Self {
        Self { stem: Some(stem.into()), ..self }
    }
}

/// A document with other positions, to be written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rewritten {
    /// The file.
    pub bytes: Vec<u8>,
    /// What belongs beside it. Only a glTF with [`Rewrite::stem`] has any.
    pub companions: Vec<Companion>,
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
        Self::parse_within(bytes, extension, Limits::default())
    }

    /// Like [`parse`](Self::parse), with other limits.
    ///
    /// # Errors
    ///
    /// As for [`parse`](Self::parse).
    pub fn parse_within(bytes: Vec<u8>, extension: Option<&str>, limits: Limits) -> Result<Self, ParseError> {
        Self::parse_in(bytes, extension, None, limits)
    }

    fn parse_in(
        bytes: Vec<u8>,
        extension: Option<&str>,
        folder: Option<&Path>,
        limits: Limits,
    ) -> Result<Self, ParseError> {
        if bytes.is_empty() {
            return Err(ParseError::Empty);
        }
        let family = Family::of(&bytes, extension).ok_or(ParseError::Unrecognised)?;
        if family.is_text() && text::has_utf16_mark(&bytes) {
            return Err(ParseError::Unsupported {
                what: "UTF-16 text".into(),
                cure: "save the file as UTF-8",
            });
        }
        let mut parsed = family.parse(Source { bytes: &bytes, folder, limits }).map_err(|source| {
            match extension.and_then(Format::from_extension) {
                Some(named) if Family::of_format(named) != family => {
                    ParseError::Guessed { name: family.name(), source: Box::new(source) }
                }
                _ => source,
            }
        })?;
        if parsed.soup.points.is_empty() {
            return Err(family.nothing());
        }
        if parsed.repeated_triangles > 0 {
            let note =
                "Meshes are shown more than once; sizes and topology are of each where it is shown first.";
            parsed.notes.push(note.into());
        }
        Ok(Self { bytes, parsed })
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
        let folder = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
        Self::parse_in(bytes, extension, folder, limits)
            .map_err(|source| ReadError::Parse { path: path.to_owned(), source })
    }

    /// The format the content is in.
    pub fn format(&self) -> Format {
        self.parsed.format
    }

    /// What the name of a file in this format ends with.
    pub fn extension(&self) -> &'static str {
        self.parsed.format.extension()
    }

    /// The files that this one refers to for geometry, as they were read.
    pub fn companions(&self) -> &[Companion] {
        &self.parsed.companions
    }

    /// The file as it was read.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// All that was read: the file, then every file that it refers to for geometry, in the order of mention.
    ///
    /// This is what a key is made from: of one file the same as [`bytes`](Self::bytes).
    pub fn content(&self) -> Cow<'_, [u8]> {
        if self.parsed.companions.is_empty() {
            return Cow::Borrowed(&self.bytes);
        }
        let parts = std::iter::once(&self.bytes).chain(self.parsed.companions.iter().map(|c| &c.bytes));
        Cow::Owned(parts.flatten().copied().collect())
    }

    /// Vertex positions in the file's order. STL stores no vertices but three corners for each facet.
    ///
    /// glTF and 3MF store meshes that a scene places once or many times: each stored mesh comes once, where the
    /// scene shows it first.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.parsed.soup.points
    }

    /// Triangles as indices into [`points`](Self::points), in the file's order, polygons split as fans.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.parsed.soup.triangles
    }

    /// Triangles with every instance of every mesh counted.
    pub fn triangles_with_instances(&self) -> u64 {
        (self.parsed.soup.triangles.len() as u64).saturating_add(self.parsed.repeated_triangles)
    }

    /// What is unusual about the file, in sentences: meshes that no scene shows or one that it shows more than once,
    /// signatures that a change breaks.
    pub fn notes(&self) -> &[String] {
        &self.parsed.notes
    }

    /// Why positions of this file cannot be replaced, if they cannot.
    pub fn fixed(&self) -> Option<&str> {
        self.parsed.fixed.as_deref()
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
    /// reads back the same and has no fewer decimals than the one it replaces; binary ones keep their number
    /// type, so 32-bit floats are rounded to the nearest. STL facets with a corner that moved get a new normal,
    /// unless theirs was zero ("work it out yourself"). Everything ends up in one file.
    ///
    /// # Errors
    ///
    /// A [`WriteError`] when the number of positions is wrong, or one is not finite or does not fit the file's
    /// number type.
    pub fn with_points(&self, points: &[Point3<f64>]) -> Result<Vec<u8>, WriteError> {
        Ok(self.rewrite(points, &Rewrite::default())?.bytes)
    }

    /// Like [`with_points`](Self::with_points), with choices.
    ///
    /// # Errors
    ///
    /// As for [`with_points`](Self::with_points).
    pub fn rewrite(&self, points: &[Point3<f64>], how: &Rewrite) -> Result<Rewritten, WriteError> {
        let old = self.points();
        if points.len() != old.len() {
            return Err(WriteError::WrongCount { given: points.len(), expected: old.len() });
        }
        check_finite(points)?;
        if how.renew_normals
            && let Some(turned) = self.with_turned_normals(points)?
        {
            return turned.rewrite(points, &Rewrite { renew_normals: false, ..how.clone() });
        }
        let bytes = match &self.parsed.layout {
            Layout::Obj(layout) => layout.rewrite(&self.bytes, old, points),
            Layout::Ply(layout) => layout.rewrite(&self.bytes, old, points)?,
            Layout::Off(layout) => layout.rewrite(&self.bytes, old, points),
            Layout::Stl(layout) => layout.rewrite(&self.bytes, old, points)?,
            Layout::ThreeMf(layout) => layout.rewrite(&self.bytes, old, points)?,
            Layout::Gltf(layout) => return layout.rewrite(&self.bytes, &self.parsed, points, how),
        };
        Ok(Rewritten { bytes, companions: Vec::new() })
    }

    /// This document with its stored normals turned as the faces turn that go to `points`; positions stay.
    /// `None` for a format that does this together with positions, and where there are no normals.
    fn with_turned_normals(&self, points: &[Point3<f64>]) -> Result<Option<Self>, WriteError> {
        let triangles = self.triangles();
        let stored = match &self.parsed.layout {
            Layout::Obj(_) => obj::normals(&self.bytes),
            Layout::Ply(layout) => layout.normals(&self.bytes, triangles),
            Layout::Off(layout) => layout.normals(&self.bytes, triangles),
            Layout::Stl(_) | Layout::Gltf(_) | Layout::ThreeMf(_) => None,
        };
        let Some(stored) = stored else { return Ok(None) };
        let turned = normals::turned(&stored, triangles, self.points(), points);
        let old: Vec<_> = stored.values.iter().map(|n| Point3::from(*n)).collect();
        let bytes = match &self.parsed.layout {
            Layout::Ply(layout) => layout.rewrite_normals(&self.bytes, &old, &turned)?,
            Layout::Obj(_) => stored.rewrite(&self.bytes, Joining::Backslash, &old, &turned),
            _ => stored.rewrite(&self.bytes, Joining::Never, &old, &turned),
        };
        // Only numbers changed, so what was read once can be read again.
        let family = Family::of_format(self.parsed.format);
        let parsed = family.parse(Source { bytes: &bytes, folder: None, limits: Limits::unlimited() });
        Ok(parsed.ok().map(|parsed| Self { bytes, parsed }))
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
        Format::Gltf => gltf::encode_text(soup),
        Format::Glb => gltf::encode_binary(soup),
        Format::ThreeMf => threemf::encode(soup),
    }
}

fn check(format: Format, soup: &Soup) -> Result<(), WriteError> {
    let needs_triangles =
        matches!(format, Format::StlAscii | Format::StlBinary | Format::Gltf | Format::Glb | Format::ThreeMf);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::parse_error;

    #[test]
    fn content_that_is_not_what_the_name_says_is_called_what_it_looks_like() {
        let error = parse_error("ply\nformat ascii 1.0\n", "obj").to_string();
        assert!(error.starts_with("its content looks like PLY, but line 3: the file ends before"), "{error}");
        // RTF begins with a brace as JSON does.
        let error = parse_error("{\\rtf1 v 1 2 3}", "obj");
        assert_eq!(error, ParseError::NoVertices);
        let error = parse_error("GLTF....", "glb").to_string();
        assert!(error.contains("neither a GLB"), "{error}");
        let error = parse_error(b"\xff\xfev\0 \x001\0".as_slice(), "obj").to_string();
        assert!(error.starts_with("UTF-16 text is not supported"), "{error}");
    }
}
