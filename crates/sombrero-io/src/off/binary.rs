//! Binary OFF: behind a line `OFF BINARY` three counts, vertices and polygons, all of 32 bits, most significant byte first.
//!
//! A vertex is its position, then normal, colour and texture coordinates as the keyword says. A polygon is its number of
//! corners, the corners, and how many numbers of colour follow (Geomview's manual, "OFF files").

use nalgebra::{Point3, Vector3};
use sombrero_mesh::Soup;

use super::keyword::Keyword;
use crate::attributes::Attributes;
use crate::coordinate::{self, is_finite};
use crate::error::{ParseError, Place, WriteError};
use crate::format::Format;
use crate::input::Source;
use crate::normals::Stored;
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};
use crate::polygon::Faces;

/// Bytes of a number.
const WORD: usize = 4;
/// A polygon has two numbers beside its corners: how many they are, and how many its colour has.
const LEAST_FACE: u64 = 2 * WORD as u64;

/// Where the counts begin, if the keyword that ends at `start` is followed by `BINARY` and the end of the line.
pub(super) fn body(bytes: &[u8], start: usize) -> Option<usize> {
    let rest = bytes.get(start..)?;
    let blanks = rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    let behind = rest.get(blanks..)?.strip_prefix(b"BINARY")?;
    let line = behind.iter().position(|&byte| byte == b'\n')?;
    behind[..line].trim_ascii().is_empty().then_some(bytes.len() - behind.len() + line + 1)
}

/// Where the vertices stand.
#[derive(Debug)]
struct Layout {
    /// The first byte of the first vertex.
    start: usize,
    /// Bytes of a vertex.
    stride: usize,
    /// Whether the three numbers behind a position are a normal.
    normals: bool,
}

/// Reads the whole file, whose numbers begin at `start`.
pub(super) fn parse(source: Source<'_>, keyword: Keyword, start: usize) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let mut reader = Reader { bytes, at: start };
    let [vertices, faces, _] = [0; 3].map(|_| reader.number());
    let [vertices, faces] =
        [vertices, faces].map(|count| count.and_then(|count| usize::try_from(count).ok()));
    let (Some(vertices), Some(faces)) = (vertices, faces) else {
        return Err(ParseError::Truncated { element: "counts line".into(), index: 0 });
    };
    let Keyword { normals, colours, texture, .. } = keyword;
    let numbers = 3 + 3 * usize::from(normals) + 4 * usize::from(colours) + 2 * usize::from(texture);
    let stride = WORD * numbers;
    reader.check_claim("vertex", vertices, stride as u64)?;
    limits.check_vertices(vertices)?;
    let layout = Layout { start: reader.at, stride, normals };
    let points = (0..vertices).map(|vertex| Point3::from(layout.vector(bytes, vertex, 0))).collect();
    reader.at += stride * vertices;
    let mut attributes = Attributes::default();
    keyword.note(&mut attributes);
    let Faces { triangles, polygons } = reader.faces(faces, vertices, &mut attributes)?;
    let parsed = Parsed::new(Format::OffBinary, Soup::new(points, triangles), attributes, layout);
    Ok(Parsed { polygons, ..parsed })
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn number(&mut self) -> Option<i32> {
        let number = self.bytes.get(self.at..)?.first_chunk()?;
        self.at += WORD;
        Some(i32::from_be_bytes(*number))
    }

    fn faces(
        &mut self,
        count: usize,
        vertices: usize,
        attributes: &mut Attributes,
    ) -> Result<Faces, ParseError> {
        self.check_claim("face", count, LEAST_FACE)?;
        let (mut faces, mut corners) = (Faces::default(), Vec::new());
        for index in 0..count {
            let cut = || ParseError::Truncated { element: "face".into(), index };
            let place = || Place::Element { name: "face".into(), index };
            corners.clear();
            for _ in 0..self.number().ok_or_else(cut)? {
                let corner = self.number().ok_or_else(cut)?;
                let known = u32::try_from(corner).ok().filter(|&corner| (corner as usize) < vertices);
                corners.push(known.ok_or_else(|| {
                    let index = corner.into();
                    ParseError::IndexOutOfRange { place: place(), index, first: 0, count: vertices }
                })?);
            }
            faces.push(&corners);
            let colours = self.number().and_then(|colours| usize::try_from(colours).ok()).ok_or_else(cut)?;
            let behind = WORD.checked_mul(colours).and_then(|length| self.at.checked_add(length));
            self.at = behind.filter(|&behind| behind <= self.bytes.len()).ok_or_else(cut)?;
            if colours > 0 {
                attributes.note("face colours");
            }
        }
        Ok(faces)
    }

    fn check_claim(&self, element: &str, count: usize, least: u64) -> Result<(), ParseError> {
        let available = self.bytes.len().saturating_sub(self.at) as u64;
        let needed = (count as u64).saturating_mul(least);
        if needed > available {
            let (element, count) = (element.into(), count as u64);
            return Err(ParseError::Overclaimed { element, count, needed, available });
        }
        Ok(())
    }
}

impl Layout {
    /// Three numbers of a vertex, from the one at `number` on.
    fn vector(&self, bytes: &[u8], vertex: usize, number: usize) -> [f64; 3] {
        let at = self.start + vertex * self.stride + WORD * number;
        let (words, _) = bytes.get(at..).unwrap_or_default().as_chunks::<WORD>();
        std::array::from_fn(|axis| words.get(axis).map_or(0.0, |word| f32::from_be_bytes(*word).into()))
    }

    /// The file with other vectors in place of those from `number` on, where they changed.
    fn replaced(
        &self,
        bytes: &[u8],
        number: usize,
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        let mut out = bytes.to_vec();
        for (vertex, (old, new)) in old.iter().zip(new).enumerate() {
            let at = self.start + vertex * self.stride + WORD * number;
            let (words, _) = out.get_mut(at..).unwrap_or_default().as_chunks_mut::<WORD>();
            for (word, (old, new)) in words.iter_mut().zip(old.iter().zip(new.iter())) {
                if old.to_bits() != new.to_bits() {
                    *word = coordinate::narrow(vertex, *new)?.to_be_bytes();
                }
            }
        }
        Ok(out)
    }

    /// The normals behind the positions, if there are any and all are finite.
    fn normals(&self, original: &Original<'_>) -> Option<Stored> {
        let all = || (0..original.soup.points.len()).map(|vertex| self.vector(original.bytes, vertex, 3));
        let finite = self.normals && all().all(|normal| is_finite(&normal.into()));
        finite.then(|| Stored {
            values: all().map(Vector3::from).collect(),
            corners: original.soup.triangles.clone(),
            slots: Vec::new(),
            text: false,
        })
    }
}

impl parsed::Layout for Layout {
    fn steps(&self, soup: &Soup) -> Vec<f32> {
        coordinate::steps_of_singles(soup)
    }

    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        Ok(self.replaced(original.bytes, 0, &original.soup.points, points)?.into())
    }

    fn turn_normals(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
    ) -> Result<Option<Vec<u8>>, WriteError> {
        let Some(normals) = self.normals(original) else { return Ok(None) };
        let (old, new) = normals.turned(original.soup, points);
        self.replaced(original.bytes, 3, &old, &new).map(Some)
    }
}

/// A new plain file.
pub(super) fn encode(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let too_many = |count| WriteError::TooMany { format: Format::OffBinary, count };
    let mut out = b"OFF BINARY\n".to_vec();
    for count in [soup.points.len(), soup.triangles.len(), 0] {
        out.extend(i32::try_from(count).map_err(|_| too_many(count))?.to_be_bytes());
    }
    for (vertex, point) in soup.points.iter().enumerate() {
        for &value in point.iter() {
            out.extend(coordinate::narrow(vertex, value)?.to_be_bytes());
        }
    }
    for triangle in &soup.triangles {
        // Vertices were counted in 31 bits.
        let [a, b, c] = triangle.map(u32::to_be_bytes);
        out.extend([3_u32.to_be_bytes(), a, b, c, [0; WORD]].concat());
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{moved, parse_error, read};

    /// Four vertices of so many numbers and a concave quadrilateral with a colour, then a triangle without.
    fn file(head: &str, more: usize) -> Vec<u8> {
        let mut out = head.as_bytes().to_vec();
        [4_i32, 2, 0].iter().for_each(|count| out.extend(count.to_be_bytes()));
        for point in [[0.0_f32, 2.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.5, 0.5, 0.0]] {
            point.iter().for_each(|value| out.extend(value.to_be_bytes()));
            (0..more).for_each(|i| out.extend(if i == 2 { 1.0_f32 } else { 0.0 }.to_be_bytes()));
        }
        for number in [4, 0, 1, 2, 3, 3, 7, 7, 7, 3, 0, 2, 1, 0] {
            out.extend(i32::to_be_bytes(number));
        }
        out
    }

    #[test]
    fn variants_are_read_and_keep_all_but_positions() {
        for (head, more, names) in [
            ("OFF BINARY\n", 0, &["face colours"][..]),
            ("# made by hand\nOFF  BINARY \r\n", 0, &["face colours"]),
            ("NOFF BINARY\n", 3, &["normals", "face colours"]),
            ("COFF BINARY\n", 4, &["colours", "face colours"]),
            ("STCNOFF BINARY\n", 9, &["normals", "colours", "texture coordinates", "face colours"]),
        ] {
            let source = file(head, more);
            let document = read(&source, "off");
            assert_eq!(document.format(), Format::OffBinary, "{head}");
            assert_eq!(document.attributes(), names, "{head}");
            assert_eq!(document.points()[3], Point3::new(0.5, 0.5, 0.0));
            assert_eq!(document.triangles().len(), 3);
            assert!(document.triangles()[..2].iter().all(|t| t.contains(&1) && t.contains(&3)));
            assert_eq!(document.with_points(document.points()).unwrap(), source);
            let (bytes, points) = moved(&document);
            assert_eq!(bytes.len(), source.len());
            let again = read(&bytes, "off");
            assert_eq!(again.points(), points);
            assert_eq!(again.with_points(document.points()).unwrap(), source);
        }
    }

    #[test]
    fn normals_turn_when_asked_to() {
        let document = read(file("NOFF BINARY\n", 3), "off");
        let points: Vec<_> = document.points().iter().map(|p| Point3::new(p.x, p.y, p.x)).collect();
        let how = Rewrite::default().with_renewed_normals(true);
        let bytes = document.rewrite(&points, &how).unwrap().bytes;
        let slope = 0.5_f32.sqrt();
        let normal: Vec<u8> = [-slope, 0.0, slope].iter().flat_map(|c| c.to_be_bytes()).collect();
        let turned = bytes.windows(12).filter(|window| *window == normal).count();
        // The triangle faces the other way: what both share has no direction.
        assert!(turned >= 1, "{turned}");
        assert_eq!(read(bytes, "off").points(), points);
    }

    #[test]
    fn claims_that_the_bytes_do_not_bear_out_are_refused() {
        let whole = file("OFF BINARY\n", 0);
        let truncated = |index| ParseError::Truncated { element: "face".into(), index };
        assert_eq!(parse_error(&whole[..whole.len() - 1], "off"), truncated(1));
        assert_eq!(parse_error(&whole[..11 + 12 + 48 + 20], "off"), truncated(0));
        assert!(matches!(parse_error(&whole[..40], "off"), ParseError::Overclaimed { needed: 48, .. }));
        let cut = ParseError::Truncated { element: "counts line".into(), index: 0 };
        assert_eq!(parse_error(&whole[..15], "off"), cut);
        let mut wrong = whole;
        wrong[11 + 12 + 48 + 4 + 3] = 9;
        let place = Place::Element { name: "face".into(), index: 0 };
        let expected = ParseError::IndexOutOfRange { place, index: 9, first: 0, count: 4 };
        assert_eq!(parse_error(wrong, "off"), expected);
    }
}
