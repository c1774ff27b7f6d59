//! Wavefront OBJ: lines of text, each a keyword and its words.
//!
//! Read: `v` and `f` (polygons, negative indices, every form of `v/vt/vn`), with comments, any line end, lines joined by
//! a backslash, and keywords in small letters or capitals. Everything else (texture coordinates, normals, groups, materials, lines,
//! curves, weights and colours behind a position) is kept unread. Only the three coordinates of `v` lines are
//! rewritten.

use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::attributes::Attributes;
use crate::coordinate::is_finite;
use crate::decimals::Words;
use crate::error::{ParseError, Place, WriteError};
use crate::family::{Evidence, Family, Variant};
use crate::format::Format;
use crate::input::{Limits, Source};
use crate::normals::{self, Stored};
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};
use crate::polygon::Faces;
use crate::text::{self, Joining, Lines};

/// The format's row.
pub(crate) static FAMILY: Family = Family {
    name: "OBJ",
    variants: &[&OBJ],
    recognise: |bytes| Evidence::Likely.when(is_obj(bytes)),
    parse,
    empty: ParseError::NoVertices,
};

/// Text, the only way to write it.
pub(crate) static OBJ: Variant = Variant {
    format: Format::Obj,
    name: "OBJ",
    extension: "obj",
    needs_triangles: false,
    encode: |soup| Ok(encode(soup)),
};

/// What the statements beside `v` and `f` are called among the attributes.
const STATEMENTS: &[(&[u8], &str)] = &[
    (b"vn", "normals"),
    (b"vt", "texture coordinates"),
    (b"usemtl", "materials"),
    (b"mtllib", "materials"),
    (b"usemap", "materials"),
    (b"maplib", "materials"),
    (b"g", "groups"),
    (b"o", "objects"),
    (b"s", "smoothing groups"),
    (b"mg", "smoothing groups"),
    (b"l", "lines"),
    (b"p", "points"),
    (b"vp", "curves and surfaces"),
    (b"cstype", "curves and surfaces"),
    (b"deg", "curves and surfaces"),
    (b"curv", "curves and surfaces"),
    (b"curv2", "curves and surfaces"),
    (b"surf", "curves and surfaces"),
];

/// Whether the first statement is one that OBJ knows.
fn is_obj(bytes: &[u8]) -> bool {
    let mut lines = Lines::new(bytes, text::beginning(bytes), Joining::Backslash);
    lines.first_word().is_some_and(|word| {
        let keyword = &bytes[word];
        Statement::of(keyword) != Statement::Other || statement_name(keyword).is_some()
    })
}

/// The statements that geometry is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Statement {
    Vertex,
    Normal,
    Face,
    Other,
}

impl Statement {
    fn of(keyword: &[u8]) -> Self {
        match keyword {
            b"v" | b"V" => Self::Vertex,
            b"f" | b"F" => Self::Face,
            [b'v' | b'V', b'n' | b'N'] => Self::Normal,
            // What came before `f`.
            [b'f' | b'F', b'o' | b'O'] => Self::Face,
            _ => Self::Other,
        }
    }
}

fn statement_name(keyword: &[u8]) -> Option<&'static str> {
    STATEMENTS.iter().find(|(known, _)| keyword.eq_ignore_ascii_case(known)).map(|(_, name)| *name)
}

/// Where the coordinates stand.
#[derive(Debug)]
struct Layout {
    /// For each vertex the byte behind its `v`.
    slots: Vec<usize>,
}

impl parsed::Layout for Layout {
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let Original { bytes, soup, .. } = original;
        Ok(text::rewrite_points(bytes, &self.slots, Joining::Backslash, &soup.points, points).into())
    }

    fn misplaced(&self, bytes: &[u8], vertex: usize) -> ParseError {
        let slot = self.slots.get(vertex).copied().unwrap_or_default();
        // One that misses a coordinate says so.
        short(bytes, slot).unwrap_or_else(|| {
            text::misplaced(bytes, text::words_of_points(bytes, &[slot], Joining::Backslash))
        })
    }

    fn words(&self, original: &Original<'_>) -> Option<Words> {
        let coordinates = text::words_of_placed(original.bytes, &self.slots, Joining::Backslash);
        Some(Words { coordinates, ..Words::default() })
    }

    fn turn_normals(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
    ) -> Result<Option<Vec<u8>>, WriteError> {
        let Some(normals) = normals(original.bytes, &original.soup.triangles) else { return Ok(None) };
        let (old, new) = normals.turned(original.soup, points);
        let slots = &normals.slots;
        Ok(Some(text::rewrite_points(original.bytes, slots, Joining::Backslash, &old, &new)))
    }
}

/// Reads the whole file.
fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let reader = Reader::new(bytes, limits, None).run()?;
    let count = reader.points.len();
    if reader.needed > count {
        // Faces may come before their vertices, so only now is it known that one is wrong; a second run, which
        // knows the count, stops at its line.
        Reader::new(bytes, limits, Some(count)).run()?;
    }
    let draws_loose = reader.attributes.has("lines") || reader.attributes.has("points");
    let Reader { points, faces: Faces { triangles, polygons }, attributes, slots, .. } = reader;
    if triangles.is_empty() {
        // Of a cloud every point counts, and a file that was cut off ends in a short one.
        let mut lost = points.iter().zip(&slots).filter(|(point, _)| point.iter().any(|x| x.is_nan()));
        if let Some(error) = lost.find_map(|(_, slot)| short(bytes, *slot)) {
            return Err(error);
        }
    }
    let parsed = Parsed::new(Format::Obj, Soup::new(points, triangles), attributes, Layout { slots });
    Ok(Parsed { draws_loose, polygons, ..parsed })
}

/// What is wrong with a vertex of fewer than three numbers, which begin at `slot`.
fn short(bytes: &[u8], slot: usize) -> Option<ParseError> {
    text::point(&mut Lines::new(bytes, slot, Joining::Backslash), bytes, slot).err()
}

/// The normals of `vn` lines, and which corner of which of the `triangles` refers to which; `None` if there are none or if
/// they are not what they should be. `bytes` were read before.
fn normals(bytes: &[u8], triangles: &[[u32; 3]]) -> Option<Stored> {
    let mut lines = Lines::new(bytes, text::beginning(bytes), Joining::Backslash);
    let mut normals = Stored { values: Vec::new(), corners: Vec::new(), slots: Vec::new(), text: true };
    let (mut polygon, mut vertices) = (Vec::new(), 0);
    loop {
        let word = lines.word();
        match word.map_or(Statement::Other, |word| Statement::of(&bytes[word])) {
            Statement::Vertex => vertices += 1,
            Statement::Normal => {
                let start = lines.at();
                normals.slots.push(start);
                let normal = text::point(&mut lines, bytes, start).ok().filter(is_finite)?;
                normals.values.push(normal.coords);
            }
            Statement::Face => {
                polygon.clear();
                while let Some(word) = lines.word() {
                    let part = |n| bytes[word.clone()].split(|&b| b == b'/').nth(n);
                    polygon.push([number(part(0), vertices), number(part(2), normals.values.len())]);
                }
                let of_face = triangles.get(normals.corners.len()..).unwrap_or_default();
                let of_face = of_face.get(..polygon.len().saturating_sub(2)).unwrap_or_default();
                normals
                    .corners
                    .extend((0..).zip(of_face).map(|(i, corners)| normals_of(i, corners, &polygon)));
            }
            Statement::Other => {}
        }
        if !lines.next_line() {
            let known = |n: u32| if (n as usize) < normals.values.len() { n } else { normals::NONE };
            normals.corners.iter_mut().for_each(|t| *t = t.map(known));
            return (!normals.values.is_empty()).then_some(normals);
        }
    }
}

/// The normals of triangle `i` of a polygon, given vertex and normal of each of its corners.
fn normals_of(i: usize, corners: &[u32; 3], polygon: &[[u32; 2]]) -> [u32; 3] {
    if let (Some(hub), Some([from, to])) = (polygon.first(), polygon.get(i + 1..i + 3))
        && *corners == [hub[0], from[0], to[0]]
    {
        return [hub[1], from[1], to[1]];
    }
    let normal_at = |vertex| polygon.iter().find(|[v, _]| *v == vertex).map_or(normals::NONE, |[_, n]| *n);
    corners.map(normal_at)
}

/// What an index names among those `so_far`, which it may count back from, or [`normals::NONE`].
fn number(index: Option<&[u8]>, so_far: usize) -> u32 {
    let named = match index.and_then(text::integer) {
        Some(i @ 1..) => usize::try_from(i - 1).ok(),
        Some(i) if i < 0 => usize::try_from(i.unsigned_abs()).ok().and_then(|back| so_far.checked_sub(back)),
        _ => None,
    };
    named.and_then(|n| u32::try_from(n).ok()).unwrap_or(normals::NONE)
}

struct Reader<'a> {
    bytes: &'a [u8],
    lines: Lines<'a>,
    limits: Limits,
    /// How many vertices the whole file has, once that is known.
    count: Option<usize>,
    points: Vec<Point3<f64>>,
    faces: Faces,
    slots: Vec<usize>,
    attributes: Attributes,
    /// Corners of the face being read.
    corners: Vec<u32>,
    /// How many vertices the faces read so far need.
    needed: usize,
}

impl<'a> Reader<'a> {
    fn new(bytes: &'a [u8], limits: Limits, count: Option<usize>) -> Self {
        Self {
            bytes,
            lines: Lines::new(bytes, text::beginning(bytes), Joining::Backslash),
            limits,
            count,
            points: Vec::new(),
            faces: Faces::default(),
            slots: Vec::new(),
            attributes: Attributes::default(),
            corners: Vec::new(),
            needed: 0,
        }
    }

    fn run(mut self) -> Result<Self, ParseError> {
        loop {
            if let Some(word) = self.lines.word() {
                let keyword = &self.bytes[word.clone()];
                match Statement::of(keyword) {
                    Statement::Vertex => self.vertex()?,
                    Statement::Face => self.face(word.start)?,
                    Statement::Normal | Statement::Other => {
                        if let Some(name) = statement_name(keyword) {
                            self.attributes.note(name);
                        }
                    }
                }
            }
            if !self.lines.next_line() {
                return Ok(self);
            }
        }
    }

    fn vertex(&mut self) -> Result<(), ParseError> {
        self.slots.push(self.lines.at());
        // Whether a coordinate that is missing matters, only the faces tell.
        let point = [0; 3].map(|_| self.lines.word().map_or(f64::NAN, |w| text::coordinate(self.bytes, w)));
        self.points.push(point.into());
        self.limits.check_vertices(self.points.len())?;
        let extra = std::iter::from_fn(|| self.lines.word()).count();
        match extra {
            0 => {}
            1 => self.attributes.note("weights"),
            _ => self.attributes.note("colours"),
        }
        Ok(())
    }

    fn face(&mut self, start: usize) -> Result<(), ParseError> {
        self.corners.clear();
        while let Some(word) = self.lines.word() {
            let corner = self.corner(word, start)?;
            self.corners.push(corner);
        }
        self.faces.push(&self.corners);
        Ok(())
    }

    /// The vertex that `word` (such as `7`, `-1/4` or `7/4/2`) names.
    fn corner(&mut self, word: Range<usize>, start: usize) -> Result<u32, ParseError> {
        let word = &self.bytes[word];
        let digits = word.split(|&b| b == b'/').next().unwrap_or_default();
        let index = text::integer(digits)
            .ok_or_else(|| ParseError::NotANumber { place: self.line(start), found: text::quoted(word) })?;
        let so_far = self.points.len();
        let vertex = match index {
            1.. => usize::try_from(index - 1).ok(),
            0 => None,
            _ => usize::try_from(index.unsigned_abs()).ok().and_then(|back| so_far.checked_sub(back)),
        };
        let within = vertex.filter(|&v| self.count.is_none_or(|count| v < count));
        let vertex = within.and_then(|v| u32::try_from(v).ok());
        let Some(vertex) = vertex else {
            return self.out_of_range(index, start);
        };
        self.needed = self.needed.max(vertex as usize + 1);
        Ok(vertex)
    }

    /// Index 0 and absurd ones are found out before the vertices are counted.
    fn out_of_range(&self, index: i64, start: usize) -> Result<u32, ParseError> {
        let count = match self.count {
            _ if index < 0 => self.points.len(),
            Some(count) => count,
            None => count_vertices(self.bytes),
        };
        Err(ParseError::IndexOutOfRange { place: self.line(start), index, first: 1, count })
    }

    fn line(&self, start: usize) -> Place {
        text::line_at(self.bytes, start)
    }
}

fn count_vertices(bytes: &[u8]) -> usize {
    let mut lines = Lines::new(bytes, text::beginning(bytes), Joining::Backslash);
    let mut count = 0;
    loop {
        let word = lines.word();
        count += usize::from(word.is_some_and(|word| Statement::of(&bytes[word]) == Statement::Vertex));
        if !lines.next_line() {
            return count;
        }
    }
}

/// A new file with `v` and `f` lines only.
fn encode(soup: &Soup) -> Vec<u8> {
    let mut out = Vec::new();
    for point in &soup.points {
        out.extend_from_slice(b"v ");
        text::push_point(&mut out, point);
        out.push(b'\n');
    }
    text::push_triangles(&mut out, b'f', &soup.triangles, 1);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Document;
    use crate::testing::{moved, parse_error, read};

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn faces_in_every_form() {
        for face in [
            "f 1 2 3 4",
            "f 1/1 2/2 3/3 4/4",
            "f 1//1 2//1 3//1 4//1",
            "f 1/1/1 2/2/1 -2/3/1 -1",
            "fo 1 2 3 4",
        ] {
            let document = read(format!("{SQUARE}{face}\n"), "obj");
            assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3]], "{face}");
        }
    }

    #[test]
    fn faces_may_come_before_their_vertices() {
        assert_eq!(read(format!("f 1 2 3\n{SQUARE}"), "obj").triangles(), [[0, 1, 2]]);
    }

    #[test]
    fn lines_are_joined_and_end_in_any_way() {
        let text = "v 0 \\\n0 0\r\nv 1 \\\r\n 0 0\rv 0 1 0\nf 1 \\\n 2\\\n 3";
        let document = read(text, "obj");
        assert_eq!(document.points().len(), 3);
        assert_eq!(document.triangles(), [[0, 1, 2]]);
        let (bytes, points) = moved(&document);
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(text.matches("\\\n").count(), 3);
        assert_eq!(text.matches("\\\r\n").count(), 1);
        assert_eq!(read(text, "obj").points(), points);
    }

    #[test]
    fn everything_beside_coordinates_is_kept_and_named() {
        let text = "# a comment\r\nmtllib m.mtl\r\no thing\r\nv  0.50 1e0 +2. 0.1 0.2 0.3 # note\r\nv 1 1 1\r\n\
                    vt 0 0\r\nvn 0 0 1\r\ng a b\r\nusemtl red\r\ns off\r\n\
                    l 1 2\r\np 1\r\nnew_thing 1 2\r\nf 1 2 1\r\n";
        let document = read(text, "obj");
        let names = [
            "materials",
            "objects",
            "colours",
            "texture coordinates",
            "normals",
            "groups",
            "smoothing groups",
            "lines",
            "points",
        ];
        assert_eq!(document.attributes(), names);
        let mut points = document.points().to_vec();
        points[0].y = 7.0;
        let bytes = document.with_points(&points).unwrap();
        let expected = text.replace("0.50 1e0 +2.", "0.50 7.0 +2.");
        assert_eq!(String::from_utf8(bytes).unwrap(), expected);
    }

    #[test]
    fn three_to_seven_numbers() {
        let text = "v 1 2 3\nv 1 2 3 1\nv 1 2 3 .1 .2 .3\nv 1 2 3 1 .1 .2 .3\n";
        let document = read(text, "obj");
        assert!(document.points().iter().all(|p| *p == Point3::new(1.0, 2.0, 3.0)));
        assert_eq!(document.attributes(), ["weights", "colours"]);
    }

    #[test]
    fn small_faces_are_kept_but_make_no_triangle() {
        assert_eq!(read(format!("{SQUARE}f 1 2\nf\n"), "obj").triangles().len(), 0);
    }

    #[test]
    fn a_wrong_index_is_found_with_its_line() {
        let wrong =
            |index, count| ParseError::IndexOutOfRange { place: Place::Line(6), index, first: 1, count };
        for (index, count) in [(99, 4), (0, 4), (-5, 4), (5_000_000_000, 4)] {
            let text = format!("{SQUARE}f 1 2 3\nf 1 2 {index}\n");
            assert_eq!(parse_error(text, "obj"), wrong(index, count), "{index}");
        }
    }

    #[test]
    fn a_negative_index_counts_the_vertices_so_far() {
        let text = "v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 0 1\n";
        let expected = ParseError::IndexOutOfRange { place: Place::Line(3), index: -3, first: 1, count: 2 };
        assert_eq!(parse_error(text, "obj"), expected);
    }

    #[test]
    fn bad_numbers_are_named_with_their_line() {
        let not = ParseError::NotANumber { place: Place::Line(2), found: "x".into() };
        assert_eq!(parse_error("v 0 0 0\nv 0 x 0\nf 1 1 2\n", "obj"), not);
        let not = ParseError::NotANumber { place: Place::Line(2), found: "a/b".into() };
        assert_eq!(parse_error("v 0 0 0\nf 1 1 a/b\n", "obj"), not);
        for text in ["nan", "inf", "-Infinity", "1e999", "-nan(ind)", "1.#QNAN"] {
            let error = parse_error(format!("v 0 0 0\nv 0 0 {text}\nf 2 1 1\n"), "obj");
            assert_eq!(error, ParseError::NonFinite { place: Place::Line(2) }, "{text}");
        }
    }

    #[test]
    fn what_stands_for_an_unused_vertex_may_be_anything() {
        for nowhere in
            ["nan nan nan", "0 inf 0", "-nan(ind) 1.#QNAN -1.#IND", "1e999 -1e999 0", "x y z", "0 0 NaN"]
        {
            let text = format!("v {nowhere}\n{SQUARE}v {nowhere} 0.5 0.5 0.5\nf 2 3 4 5\n");
            let document = read(&text, "obj");
            assert_eq!(document.points()[0], document.points()[1], "{nowhere}");
            assert_eq!(document.notes().len(), 1);
            let (bytes, points) = moved(&document);
            let bytes = String::from_utf8(bytes).unwrap();
            assert_eq!(bytes.matches(&format!("v {nowhere}")).count(), 2, "{bytes}");
            assert_eq!(read(bytes, "obj").points()[1..5], points[1..5]);
        }
    }

    #[test]
    fn keywords_may_be_capitals() {
        let text = format!("{SQUARE}vn 0 0 1\nvt 0 0\ng a\nf 1//1 2//1 3//1 -1//-1\n").to_uppercase();
        let document = read(&text, "obj");
        assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(document.attributes(), ["normals", "texture coordinates", "groups"]);
        let (bytes, points) = moved(&document);
        assert_eq!(read(bytes, "obj").points(), points);
        let wrong = ParseError::IndexOutOfRange { place: Place::Line(5), index: 9, first: 1, count: 4 };
        assert_eq!(parse_error(format!("{SQUARE}F 1 2 9\n").to_uppercase(), "obj"), wrong);
    }

    #[test]
    fn concave_polygons_are_split_as_they_are_and_copies_as_their_originals() {
        let arrow = "v 0 2 0\nv 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nvn 0 0 1\nvn 0 0.6 0.8\nf 1//1 2//1 3//2 4//1\n";
        let document = read(arrow, "obj");
        assert_eq!(document.triangles().len(), 2);
        assert!(document.triangles().iter().all(|t| t.contains(&1) && t.contains(&3)));
        // The notch goes over to the other side of the line between its neighbours.
        let mut points = document.points().to_vec();
        points[3] = Point3::new(1.25, 1.0, 0.0);
        let copy = read(document.with_points(&points).unwrap(), "obj");
        assert_ne!(copy.triangles(), document.triangles());
        assert_eq!(copy.soup_like(document.triangles()).triangles, document.triangles());
        let other = read(arrow.replace("3//2 4//1", "4//1 3//2"), "obj");
        assert_eq!(*other.soup_like(document.triangles()), *other.soup());
        // Normals go with their corners, however those are put together.
        let stored = normals(document.bytes(), document.triangles()).unwrap();
        for (triangle, normals) in document.triangles().iter().zip(&stored.corners) {
            assert_eq!(*normals, triangle.map(|v| u32::from(v == 2)));
        }
    }

    #[test]
    fn a_short_vertex_is_malformed() {
        let problem = "a vertex needs 3 coordinates, but this one has 2".into();
        assert_eq!(parse_error("v 0 0\n", "obj"), ParseError::Malformed { place: Place::Line(1), problem });
    }

    #[test]
    fn a_vertex_that_no_face_uses_may_be_short() {
        for short in ["v", "v 1", "v 1.5 2 # two", "v 1.5 nan 2", "v 1 2 1.#QNAN", "v -nan(ind) 1 2"] {
            let text = format!("{short}\nv 0.5 0 0\nv 1.5 0 0\nv 0 1.5 0\nf 2 3 4\n");
            let document = read(&text, "obj");
            assert_eq!(document.triangles(), [[1, 2, 3]], "{short}");
            let points: Vec<_> = document.points().iter().map(|p| p * 3.0).collect();
            let how = Rewrite::default().with_decimals(crate::Decimals::Number(5));
            let bytes = document.rewrite(&points, &how).unwrap().bytes;
            assert!(bytes.starts_with(format!("{short}\nv 1.50000 ").as_bytes()), "{short}");
            assert_eq!(read(bytes, "obj").points()[1..], points[1..]);
            let used = parse_error(text.replace("f 2", "f 1"), "obj");
            assert_eq!(used.place(), Some(&Place::Line(1)), "{short}: {used}");
        }
        let cloud = parse_error("v 0 0 0\nv 1 0 0\nv 0.5 0.2", "obj");
        assert_eq!(cloud.place(), Some(&Place::Line(3)), "{cloud}");
    }

    #[test]
    fn a_comment_may_stand_right_behind_a_number() {
        let text = "v 0 0 0.50#first\nv 1 0 0#\nv 0 1 0 # third#\nf 1 2 3#face 4\n";
        let document = read(text, "obj");
        assert_eq!(document.triangles(), [[0, 1, 2]]);
        let bytes =
            document.with_points(&document.points().iter().map(|p| p * 2.0).collect::<Vec<_>>()).unwrap();
        let expected = text.replace("0.50", "1.00").replace("v 1 0", "v 2.0 0").replace("0 1 0", "0 2.0 0");
        assert_eq!(String::from_utf8(bytes).unwrap(), expected);
    }

    #[test]
    fn text_without_vertices_is_no_mesh() {
        assert_eq!(parse_error("hello world\n", "obj"), ParseError::NoVertices);
        let unknown = Document::parse(b"hello world\n".to_vec(), None).unwrap_err();
        assert_eq!(unknown, ParseError::Unrecognised);
    }

    #[test]
    fn a_byte_order_mark_is_kept() {
        let document = read("\u{feff}v 0 0 0\n", "obj");
        let (bytes, _) = moved(&document);
        assert!(bytes.starts_with("\u{feff}v ".as_bytes()));
    }
}
