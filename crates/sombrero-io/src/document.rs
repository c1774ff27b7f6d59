//! A mesh file kept whole, whose vertex positions can be replaced.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use nalgebra::Point3;
use sombrero_mesh::{Scene, Soup};

use crate::coordinate::check_finite;
use crate::decimals::{self, Decimals, Spelling, Survey};
use crate::error::{ParseError, ReadError, WriteError};
use crate::family::{Evidence, Family};
use crate::format::Format;
use crate::input::{Beside, Limits, Source, read_bytes};
use crate::lock::folder_of;
use crate::parsed::{Companion, Original, Parsed, Rewrite, Rewritten};
use crate::registry;
use crate::text;
use crate::{polygon, unplaced};

/// A mesh file: all its bytes, and where among them the vertex positions stand.
///
/// Everything but positions is out of reach, so whatever [`with_points`](Self::with_points) returns has the
/// same order, faces, materials, names and comments as the file that was read.
#[derive(Debug, Clone)]
pub struct Document {
    bytes: Vec<u8>,
    family: &'static Family,
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

    /// A mesh read from the content of a file, as [`parse`](Self::parse) does, within other limits.
    ///
    /// # Errors
    ///
    /// As for [`parse`](Self::parse).
    pub fn parse_within(bytes: Vec<u8>, extension: Option<&str>, limits: Limits) -> Result<Self, ParseError> {
        Self::parse_beside(bytes, extension, Beside::Nothing, limits)
    }

    /// A mesh of several files, none of which has to be on a disk: `bytes` is the document's own, and `others` those that
    /// it refers to, as [`companions`](Self::companions) gave them, with their names and in any order.
    ///
    /// # Errors
    ///
    /// As for [`parse`](Self::parse).
    pub fn parse_together(
        bytes: Vec<u8>,
        extension: Option<&str>,
        others: &[(String, Vec<u8>)],
        limits: Limits,
    ) -> Result<Self, ParseError> {
        Self::parse_beside(bytes, extension, Beside::Files(others), limits)
    }

    fn parse_beside(
        bytes: Vec<u8>,
        extension: Option<&str>,
        beside: Beside<'_>,
        limits: Limits,
    ) -> Result<Self, ParseError> {
        if bytes.is_empty() {
            return Err(ParseError::Empty);
        }
        let family = registry::recognise(&bytes, extension);
        // A binary file may begin so by chance, but has more to show than its name.
        let by_content = family.is_some_and(|family| (family.recognise)(&bytes) >= Evidence::Likely);
        if !by_content && text::is_utf16(&bytes) {
            return Err(ParseError::Unsupported {
                what: "UTF-16 text".into(),
                cure: "save the file as UTF-8",
            });
        }
        if let (false, Some(what)) = (by_content, packed(&bytes)) {
            return Err(ParseError::Unsupported { what: what.into(), cure: "unpack it first" });
        }
        let family = family.ok_or(ParseError::Unrecognised)?;
        let mut parsed = parsed(family, Source { bytes: &bytes, beside, limits }).map_err(|source| {
            match extension.and_then(registry::by_extension) {
                Some(named) if named.name != family.name => {
                    ParseError::Guessed { name: family.name, source: Box::new(source) }
                }
                _ => source,
            }
        })?;
        if parsed.soup.points.is_empty() {
            return Err(family.empty.clone());
        }
        if parsed.repeated_triangles > 0 {
            let note =
                "Meshes are shown more than once; sizes and topology are of each where it is shown first.";
            parsed.notes.push(note.into());
        }
        if !parsed.unplaced.is_empty() {
            parsed.notes.push(unplaced::note(parsed.unplaced.len()));
        }
        Ok(Self { bytes, family, parsed })
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

    /// The mesh file at `path`, read as [`read`](Self::read) does, within other limits.
    ///
    /// # Errors
    ///
    /// As for [`read`](Self::read).
    pub fn read_within(path: &Path, limits: Limits) -> Result<Self, ReadError> {
        let bytes = read_bytes(path, limits)?;
        let extension = path.extension().and_then(|e| e.to_str());
        Self::parse_beside(bytes, extension, Beside::Folder(folder_of(path)), limits)
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

    /// The files that this one refers to, as they were read: those that hold geometry, in the order of mention, then
    /// others, such as buffers of animations.
    pub fn companions(&self) -> &[Companion] {
        &self.parsed.companions
    }

    /// The file as it was read.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// All that was read: the file, then all [`companions`](Self::companions).
    ///
    /// This is what a key is made from: of one file the same as [`bytes`](Self::bytes). It does not tell where one
    /// file ends and the next begins, as [`parts`](Self::parts) does.
    pub fn content(&self) -> Cow<'_, [u8]> {
        if self.parsed.companions.is_empty() {
            return Cow::Borrowed(&self.bytes);
        }
        let parts = std::iter::once(&self.bytes).chain(self.parsed.companions.iter().map(|c| &c.bytes));
        Cow::Owned(parts.flatten().copied().collect())
    }

    /// Every file of the original that holds geometry, as name and content: the document's own file first, under the
    /// empty name, because what it is called says nothing about the model; then each companion under the name by
    /// which the document refers to it, in the order of the document's list of buffers.
    ///
    /// A digest of the original has to bind every name and every length. Where one file ends and the next begins
    /// decides what the geometry is: two buffers of which the second begins a few bytes later hold other
    /// coordinates, although all their bytes one after the other are the same.
    pub fn parts(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let companions = self.parsed.companions.iter().filter(|companion| companion.holds_geometry);
        let companions = companions.map(|companion| (companion.name.as_str(), companion.bytes.as_slice()));
        std::iter::once(("", self.bytes.as_slice())).chain(companions)
    }

    /// Vertex positions in the file's order. STL stores no vertices but three corners for each facet.
    ///
    /// What stands for a vertex that no face uses may be anything. Where it is no position, the vertex has that of
    /// another one here and keeps its bytes whatever happens.
    ///
    /// glTF and 3MF store meshes that a scene places once or many times: each stored mesh comes once, where the
    /// scene shows it first.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.parsed.soup.points
    }

    /// Triangles as indices into [`points`](Self::points), in the file's order. Polygons are split as fans around their
    /// first corner, and where that would cover what is outside of one, by ear clipping, which depends on positions: see
    /// [`soup_like`](Self::soup_like).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.parsed.soup.triangles
    }

    /// Triangles with every instance of every mesh counted.
    pub fn triangles_with_instances(&self) -> u64 {
        (self.parsed.soup.triangles.len() as u64).saturating_add(self.parsed.repeated_triangles)
    }

    /// The unit of the file's lengths, as people abbreviate it, if the format has one: `mm` or another of a 3MF, `m` of glTF.
    pub fn unit(&self) -> Option<&str> {
        match self.format() {
            Format::Gltf | Format::Glb => Some("m"),
            Format::ThreeMf => {
                let named = self.attributes().iter().find_map(|name| name.strip_prefix("unit "))?;
                let units = [
                    ("micron", "µm"),
                    ("millimeter", "mm"),
                    ("centimeter", "cm"),
                    ("inch", "in"),
                    ("foot", "ft"),
                    ("meter", "m"),
                ];
                units.iter().find(|(name, _)| *name == named).map(|(_, short)| *short)
            }
            _ => None,
        }
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

    /// Points and triangles together.
    pub fn soup(&self) -> &Soup {
        &self.parsed.soup
    }

    /// Points and triangles, with all polygons split as `triangles` are, if those are the same faces: a copy whose vertices
    /// moved has the triangles of its original then. Otherwise the same as [`soup`](Self::soup).
    pub fn soup_like(&self, triangles: &[[u32; 3]]) -> Cow<'_, Soup> {
        let Parsed { soup, polygons, .. } = &self.parsed;
        if soup.triangles == triangles || !polygon::same_faces(&soup.triangles, polygons, triangles) {
            return Cow::Borrowed(soup);
        }
        Cow::Owned(Soup::new(soup.points.clone(), triangles.to_vec()))
    }

    /// Where else the scene shows vertices, and how finely the file stores them. Of instances without end, as many
    /// places are listed as the largest meshes have vertices.
    pub fn scene(&self) -> Scene {
        Scene {
            places: self.parsed.places.clone(),
            steps: self.parsed.layout.steps(&self.parsed.soup),
            draws_loose: self.parsed.draws_loose,
        }
    }

    /// Names of what the file holds beside positions and faces, such as `normals`, `texture coordinates`,
    /// `materials`, or a PLY property like `confidence`.
    pub fn attributes(&self) -> &[String] {
        &self.parsed.attributes
    }

    /// The file with new positions, one for each of [`points`](Self::points); every other byte stays.
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

    /// The file with new positions, written as [`with_points`](Self::with_points) does, with choices.
    ///
    /// # Errors
    ///
    /// As for [`with_points`](Self::with_points).
    pub fn rewrite(&self, points: &[Point3<f64>], how: &Rewrite) -> Result<Rewritten, WriteError> {
        let expected = self.points().len();
        if points.len() != expected {
            return Err(WriteError::WrongCount { given: points.len(), expected });
        }
        check_finite(points)?;
        let Parsed { layout, soup, companions, unplaced, .. } = &self.parsed;
        let held = (!unplaced.is_empty()).then(|| unplaced::kept(points, soup, unplaced));
        let points = held.as_deref().unwrap_or(points);
        let original = Original { bytes: &self.bytes, soup, companions };
        if how.renew_normals
            && let Some(bytes) = layout.turn_normals(&original, points)?
            && let Some(turned) = self.read_again(bytes)
        {
            return turned.rewrite(points, &Rewrite { renew_normals: false, ..how.clone() });
        }
        let spelt =
            || (how.decimals != Decimals::Exact).then(|| self.spellings(&original, points, how)).flatten();
        let (written, spellings) = rayon::join(|| layout.rewrite(&original, points, how), spelt);
        let written = written?;
        match spellings {
            Some(spellings) if written.bytes != self.bytes => Ok(self.spelled_alike(spellings, written)),
            _ => Ok(written),
        }
    }

    /// How coordinates and directions of a text file are to be spelled.
    fn spellings(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        how: &Rewrite,
    ) -> Option<[Spelling; 2]> {
        let words = self.parsed.layout.words(original)?;
        let rms = decimals::rms(original.soup.points.iter().zip(points));
        let spelling = |spans: &[Range<usize>], decimals, rms, filling| {
            let mut survey = Survey::default();
            spans.iter().for_each(|span| survey.add(self.bytes.get(span.clone()).unwrap_or_default()));
            survey.spelling(decimals, rms, filling)
        };
        Some([
            spelling(&words.coordinates, how.decimals, rms, how.filling),
            // A direction is of length 1 and as exact as the file has it.
            spelling(&words.directions, Decimals::Own, f64::INFINITY, None),
        ])
    }

    /// A text file as it was `written`, with all coordinates spelled alike.
    fn spelled_alike(&self, [coordinates, directions]: [Spelling; 2], written: Rewritten) -> Rewritten {
        let Some(again) = self.read_again(written.bytes.clone()) else { return written };
        let Parsed { layout, soup, companions, .. } = &again.parsed;
        let Some(words) = layout.words(&Original { bytes: &again.bytes, soup, companions }) else {
            return written;
        };
        let spans = words.coordinates.into_iter().map(|span| (span, &coordinates));
        let others = words.directions.into_iter().map(|span| (span, &directions));
        let mut all: Vec<_> = spans.chain(others).collect();
        all.sort_by_key(|(span, _)| span.start);
        Rewritten { bytes: decimals::respelled(&again.bytes, &all), ..written }
    }

    /// The document of the same file with other numbers in it: what was read once can be read again.
    fn read_again(&self, bytes: Vec<u8>) -> Option<Self> {
        let source = Source { bytes: &bytes, beside: Beside::Nothing, limits: Limits::unlimited() };
        let parsed = parsed(self.family, source).ok()?;
        Some(Self { bytes, family: self.family, parsed })
    }
}

/// What a reader of the format finds, with polygons split and no vertex that stands nowhere.
fn parsed(family: &'static Family, source: Source<'_>) -> Result<Parsed, ParseError> {
    let mut parsed = (family.parse)(source)?;
    let layout = &parsed.layout;
    parsed.unplaced = unplaced::settle(&mut parsed.soup, |vertex| layout.misplaced(source.bytes, vertex))?;
    polygon::split(&mut parsed.soup, &parsed.polygons);
    Ok(parsed)
}

/// Which program packed a file, by how it begins.
fn packed(bytes: &[u8]) -> Option<&'static str> {
    const BEGINNINGS: [(&[u8], &str); 6] = [
        (b"\x1f\x8b\x08", "a file packed by gzip"),
        (b"BZh", "a file packed by bzip2"),
        (b"\xfd7zXZ\0", "a file packed by xz"),
        (b"\x28\xb5\x2f\xfd", "a file packed by zstd"),
        (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
        (b"Rar!\x1a\x07", "a RAR archive"),
    ];
    BEGINNINGS.iter().find(|(beginning, _)| bytes.starts_with(beginning)).map(|(_, what)| *what)
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
        let error = parse_error(b"\x1f\x8b\x08\0 a model".as_slice(), "stl").to_string();
        assert_eq!(error, "a file packed by gzip is not supported; unpack it first");
    }

    #[test]
    fn a_comma_in_a_number_is_named() {
        let told = |number: &str| {
            parse_error(format!("v 0 0 {number}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "obj").to_string()
        };
        assert!(told("0,5").contains("decimals need a point instead of the comma"), "{}", told("0,5"));
        assert!(told("0,").ends_with("correct this or export the model again"), "{}", told("0,"));
    }
}
