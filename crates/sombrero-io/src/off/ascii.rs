//! Text OFF: the counts, one vertex a line, one polygon a line, with comments and any line end.
//!
//! The keyword may be missing if the file's name says OFF, and the first count may stand right behind it. A polygon may go on
//! in the next line. Where lines are not rows, because vertices or polygons share a line or need several, the numbers are
//! taken as they come.

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::keyword::Keyword;
use crate::attributes::Attributes;
use crate::coordinate::is_finite;
use crate::decimals::Words;
use crate::error::{ParseError, Place, WriteError};
use crate::format::Format;
use crate::input::{Limits, Source};
use crate::normals::Stored;
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};
use crate::polygon::Faces;
use crate::text::{self, Joining, Lines};

/// Bytes that a vertex (`0 0 0`) or a polygon (`0`) and its line end take at least.
const LEAST_VERTEX: u64 = 6;
const LEAST_FACE: u64 = 2;

/// Where the coordinates stand.
#[derive(Debug)]
struct Layout {
    /// For each vertex the byte where its first coordinate begins.
    slots: Vec<usize>,
    /// Whether three numbers behind the coordinates are a normal.
    normals: bool,
    /// Whether a line end may come between the coordinates.
    joining: Joining,
}

impl parsed::Layout for Layout {
    fn misplaced(&self, bytes: &[u8], vertex: usize) -> ParseError {
        let slot = self.slots.get(vertex).map_or(&[][..], std::slice::from_ref);
        text::misplaced(bytes, text::words_of_points(bytes, slot, self.joining))
    }

    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let Original { bytes, soup, .. } = original;
        Ok(text::rewrite_points(bytes, &self.slots, self.joining, &soup.points, points).into())
    }

    fn words(&self, original: &Original<'_>) -> Option<Words> {
        let coordinates = text::words_of_placed(original.bytes, &self.slots, self.joining);
        Some(Words { coordinates, ..Words::default() })
    }

    fn turn_normals(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
    ) -> Result<Option<Vec<u8>>, WriteError> {
        let Some(normals) = self.normals(original) else { return Ok(None) };
        let (old, new) = normals.turned(original.soup, points);
        Ok(Some(text::rewrite_points(original.bytes, &normals.slots, self.joining, &old, &new)))
    }
}

impl Layout {
    /// The normals behind the positions, if the keyword says that there are any.
    fn normals(&self, original: &Original<'_>) -> Option<Stored> {
        if !self.normals {
            return None;
        }
        let (mut values, mut slots) = (Vec::new(), Vec::new());
        for &start in &self.slots {
            let mut lines = Lines::new(original.bytes, start, self.joining);
            for _ in 0..3 {
                lines.word();
            }
            slots.push(lines.at());
            values.push(text::point(&mut lines, original.bytes, start).ok().filter(is_finite)?.coords);
        }
        Some(Stored { values, corners: original.soup.triangles.clone(), slots, text: true })
    }
}

/// Reads the whole file, whose keyword, if there is one, ends at `start`.
pub(super) fn parse(source: Source<'_>, keyword: Keyword, start: usize) -> Result<Parsed, ParseError> {
    let start = start.max(text::beginning(source.bytes));
    let by_line = Reader::new(source, start, Joining::Never).run(keyword);
    let Err(trouble) = by_line else { return by_line };
    if keyword != Keyword::default() {
        return Err(trouble);
    }
    Reader::new(source, start, Joining::Always).run(keyword).map_err(|_| trouble)
}

struct Reader<'a> {
    bytes: &'a [u8],
    limits: Limits,
    lines: Lines<'a>,
    /// Whether rows end with their lines.
    joining: Joining,
    attributes: Attributes,
}

impl<'a> Reader<'a> {
    fn new(source: Source<'a>, start: usize, joining: Joining) -> Self {
        let Source { bytes, limits, .. } = source;
        let lines = Lines::new(bytes, start, joining);
        Self { bytes, limits, lines, joining, attributes: Attributes::default() }
    }

    fn run(mut self, keyword: Keyword) -> Result<Parsed, ParseError> {
        keyword.note(&mut self.attributes);
        let [vertices, faces] = self.counts()?;
        let (points, slots) = self.vertices(vertices, keyword)?;
        let Faces { triangles, polygons } = self.faces(faces, vertices)?;
        if self.joining == Joining::Always
            && let Some(word) = self.lines.word()
        {
            let problem = "something follows the last face".into();
            return Err(ParseError::Malformed { place: self.line(word.start), problem });
        }
        let layout = Layout { slots, normals: keyword.normals, joining: self.joining };
        let parsed = Parsed::new(Format::Off, Soup::new(points, triangles), self.attributes, layout);
        Ok(Parsed { polygons, ..parsed })
    }

    /// The numbers of vertices and faces, on one line or on several; the number of edges, which nobody needs, may be missing.
    fn counts(&mut self) -> Result<[usize; 2], ParseError> {
        let Some(first) = self.lines.first_word() else {
            return Err(ParseError::Truncated { element: "counts line".into(), index: 0 });
        };
        let start = first.start;
        let count = |word| text::integer(word).and_then(|n| usize::try_from(n).ok());
        let vertices = count(&self.bytes[first]);
        let second = self.lines.word();
        let has_lines = second.is_none();
        let faces = second.or_else(|| self.lines.first_word()).and_then(|word| count(&self.bytes[word]));
        let (Some(vertices), Some(faces)) = (vertices, faces) else {
            let problem = "expected the numbers of vertices and faces".into();
            return Err(ParseError::Malformed { place: self.line(start), problem });
        };
        if self.joining == Joining::Always {
            self.lines.word();
        } else if !(has_lines && self.pass_lone_number()) {
            self.lines.next_line();
        }
        self.check_claim("vertex", vertices, LEAST_VERTEX)?;
        self.limits.check_vertices(vertices)?;
        Ok([vertices, faces])
    }

    /// Passes over a line that holds one whole number and nothing else, as no vertex does; whether there was one.
    fn pass_lone_number(&mut self) -> bool {
        let mut lines = Lines::new(self.bytes, self.lines.at(), self.joining);
        let alone = lines.word().is_none()
            && lines.first_word().is_some_and(|word| text::integer(&self.bytes[word]).is_some())
            && lines.word().is_none();
        if alone {
            lines.next_line();
            self.lines = lines;
        }
        alone
    }

    /// Passes over what is left of a row.
    fn end_row(&mut self, surplus: &str) {
        if self.joining == Joining::Never {
            if !surplus.is_empty() && self.lines.word().is_some() {
                self.attributes.note(surplus);
            }
            self.lines.next_line();
        }
    }

    fn vertices(
        &mut self,
        count: usize,
        keyword: Keyword,
    ) -> Result<(Vec<Point3<f64>>, Vec<usize>), ParseError> {
        // Many programs write colours without saying so in the keyword.
        let surplus = if keyword == Keyword::default() { "unnamed vertex values" } else { "" };
        let (mut points, mut slots) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for index in 0..count {
            let start = self.first_word_of("vertex", index)?;
            slots.push(start);
            self.lines = Lines::new(self.bytes, start, self.joining);
            points.push(text::point(&mut self.lines, self.bytes, start)?);
            self.end_row(surplus);
        }
        Ok((points, slots))
    }

    fn faces(&mut self, count: usize, vertices: usize) -> Result<Faces, ParseError> {
        self.check_claim("face", count, LEAST_FACE)?;
        let (mut faces, mut corners) = (Faces::default(), Vec::new());
        for index in 0..count {
            let start = self.first_word_of("face", index)?;
            self.face(start, vertices, &mut corners)?;
            faces.push(&corners);
            self.end_row("face colours");
        }
        Ok(faces)
    }

    /// Reads the face whose first word, already passed, is at `start`.
    fn face(&mut self, start: usize, vertices: usize, corners: &mut Vec<u32>) -> Result<(), ParseError> {
        self.lines = Lines::new(self.bytes, start, self.joining);
        let size = self.integer(start)?;
        corners.clear();
        for _ in 0..size {
            let index = self.integer(start)?;
            match u32::try_from(index) {
                Ok(corner) if (corner as usize) < vertices => corners.push(corner),
                _ => {
                    let place = self.line(start);
                    return Err(ParseError::IndexOutOfRange { place, index, first: 0, count: vertices });
                }
            }
        }
        Ok(())
    }

    /// The next whole number of the face, which may go on in the next line.
    fn integer(&mut self, start: usize) -> Result<i64, ParseError> {
        let Some(word) = self.lines.first_word() else {
            let problem = "the face has fewer corners than it says".into();
            return Err(ParseError::Malformed { place: self.line(start), problem });
        };
        let word = &self.bytes[word];
        text::integer(word)
            .ok_or_else(|| ParseError::NotANumber { place: self.line(start), found: text::quoted(word) })
    }

    fn first_word_of(&mut self, element: &str, index: usize) -> Result<usize, ParseError> {
        match self.lines.first_word() {
            Some(word) => Ok(word.start),
            None => Err(ParseError::Truncated { element: element.into(), index }),
        }
    }

    fn check_claim(&self, element: &str, count: usize, least: u64) -> Result<(), ParseError> {
        let available = (self.bytes.len() - self.lines.at()) as u64;
        // The last line may lack its end.
        let needed = (count as u64).saturating_mul(least).saturating_sub(1);
        if count > 0 && needed > available {
            return Err(ParseError::Overclaimed {
                element: element.into(),
                count: count as u64,
                needed,
                available,
            });
        }
        Ok(())
    }

    fn line(&self, start: usize) -> Place {
        text::line_at(self.bytes, start)
    }
}

/// A new plain `OFF`.
pub(super) fn encode(soup: &Soup) -> Vec<u8> {
    let mut out = b"OFF\n".to_vec();
    for count in [soup.points.len(), soup.triangles.len()] {
        text::push_integer(&mut out, count as u64);
        out.push(b' ');
    }
    out.extend_from_slice(b"0\n");
    for point in &soup.points {
        text::push_point(&mut out, point);
        out.push(b'\n');
    }
    text::push_triangles(&mut out, b'3', &soup.triangles, 0);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::off::unsupported;
    use crate::testing::{moved, parse_error, read};

    const BODY: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    #[test]
    fn the_keyword_may_be_missing_or_share_its_line() {
        for head in [
            "OFF\n4 1 0\n",
            "off\n4 1\n",
            "4 1 0\n",
            "OFF 4 1 5\n",
            "OFF4 1 0\n",
            "OFF4\n1\n0\n",
            "off4 1\n",
            "OFF\n4\n1\n",
            "4\n1 # faces\n0 # edges\n",
            "# hm\n\nOFF # yes\n\n# no\n4 1 0 # counts\n\n",
            "Off\n4 1 0\n",
            "OFF# keyword\n4 1 0# counts\n",
            "\u{feff}OFF4 1 0\n",
        ] {
            let document = read(format!("{head}{BODY}"), "off");
            assert_eq!(document.points().len(), 4, "{head}");
            assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3]], "{head}");
        }
    }

    #[test]
    fn variants_keep_what_follows_the_position() {
        for (keyword, extra, names) in [
            ("COFF", "255 0 0 255", &["colours"][..]),
            ("NOFF", "0 0 1", &["normals"]),
            ("CNOFF", "0 0 1 .1 .2 .3 1", &["normals", "colours"]),
            ("STOFF", "0.5 0.5", &["texture coordinates"]),
            ("NCOFF", "0 0 1 .1 .2 .3 1", &["normals", "colours"]),
            ("NCSTOFF", "0 0 1 .1 .2 .3 1 .5 .5", &["normals", "colours", "texture coordinates"]),
            ("coff", "255 0 0 255", &["colours"]),
            ("noff", "0 0 1", &["normals"]),
            ("STCNOFF", "0 0 1 .1 .2 .3 1 .5 .5", &["normals", "colours", "texture coordinates"]),
            ("OFF", "255 0 0", &["unnamed vertex values"]),
        ] {
            let text = format!("{keyword}\r\n1 0 0\r\n1.50 2 3 {extra}\r\n");
            let document = read(&text, "off");
            assert_eq!(document.attributes(), names, "{keyword}");
            let bytes = document.with_points(&[Point3::new(1.5, 9.0, 3.0)]).unwrap();
            assert_eq!(
                String::from_utf8(bytes).unwrap(),
                text.replace("1.50 2 3", "1.50 9.0 3"),
                "{keyword}"
            );
        }
    }

    #[test]
    fn face_colours_comments_and_trailing_lines_are_kept() {
        let text = "OFF\n3 1 0\n0 0 0 # origin\n\n1 0 0\n0 1 0\n3 0 1 2 0.5 0.5 0.5 # grey\nmore\n";
        let document = read(text, "off");
        assert_eq!(document.attributes(), ["face colours"]);
        let (bytes, points) = moved(&document);
        assert!(bytes.ends_with(b"\n3 0 1 2 0.5 0.5 0.5 # grey\nmore\n"));
        assert_eq!(read(bytes, "off").points(), points);
    }

    #[test]
    fn what_is_not_three_dimensional_text_is_refused_by_name() {
        for (head, what) in [
            ("4OFF\n", "4OFF (homogeneous positions)"),
            ("nOFF\n3\n", "nOFF (positions of any dimension)"),
            ("C4nOFF\n3\n", "nOFF (positions of any dimension)"),
        ] {
            assert_eq!(parse_error(format!("{head}{BODY}"), "off"), unsupported(what), "{head}");
        }
    }

    #[test]
    fn wrong_indices_are_named_with_their_line() {
        for index in [3, -1, 4_294_967_296] {
            let text = format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {index}\n");
            let expected = ParseError::IndexOutOfRange { place: Place::Line(6), index, first: 0, count: 3 };
            assert_eq!(parse_error(text, "off"), expected);
        }
    }

    #[test]
    fn a_face_may_go_on_in_the_next_line() {
        let text = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n4 0 1\n 2 # here\n 3 0.5 0.5\n3 1 2 3\n";
        let document = read(text, "off");
        assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3], [1, 2, 3]]);
        assert_eq!(document.attributes(), ["face colours"]);
    }

    #[test]
    fn where_lines_are_not_rows_numbers_are_taken_as_they_come() {
        for body in [
            "0 0 0 1 0 0 1 1 0 0 1 0\n4 0 1 2 3\n",
            "0 0 0 1 0 0\n1 1 0 0 1 0\n4 0 1\n2 3\n",
            "0 0\n0\n1 0 0 # comment\n1\n1\n0 0 1 0 4 0 1 2 3",
            "0\n0\n0\n1\n0\n0\n1\n1\n0\n0\n1\n0\n4\n0\n1\n2\n3\n",
        ] {
            for head in ["OFF\n4 1 0\n", "OFF4 1 0 ", "4 1 0\n"] {
                let document = read(format!("{head}{body}"), "off");
                assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3]], "{head}{body}");
                let (bytes, points) = moved(&document);
                assert_eq!(read(bytes, "off").points(), points, "{head}{body}");
            }
        }
    }

    #[test]
    fn unused_vertices_may_be_anything() {
        let text = "OFF\n4 1 0\nnan nan nan\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n";
        let document = read(text, "off");
        assert_eq!(document.points()[0], document.points()[1]);
        let (bytes, points) = moved(&document);
        assert!(String::from_utf8_lossy(&bytes).contains("\nnan nan nan\n"));
        assert_eq!(read(bytes, "off").points()[1..], points[1..]);
        let error = parse_error(text.replace("3 1 2 3", "3 0 1 2"), "off");
        assert_eq!(error, ParseError::NonFinite { place: Place::Line(3) });
    }

    #[test]
    fn a_face_with_missing_corners_is_malformed() {
        let text = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n";
        let problem = "the face has fewer corners than it says".into();
        assert_eq!(parse_error(text, "off"), ParseError::Malformed { place: Place::Line(6), problem });
    }

    #[test]
    fn counts_must_be_there_and_be_counts() {
        let malformed = |line| ParseError::Malformed {
            place: Place::Line(line),
            problem: "expected the numbers of vertices and faces".into(),
        };
        assert_eq!(parse_error("OFF\nmany few\n", "off"), malformed(2));
        assert_eq!(parse_error("OFF\n-4 1 0\n", "off"), malformed(2));
        assert_eq!(parse_error("OFF\n4\n", "off"), malformed(2));
        let truncated = ParseError::Truncated { element: "counts line".into(), index: 0 };
        assert_eq!(parse_error("OFF\n# nothing\n", "off"), truncated);
    }

    #[test]
    fn promises_that_the_file_cannot_hold_are_refused_at_once() {
        let error = parse_error(format!("OFF\n4000000000 1 0\n{BODY}"), "off");
        assert!(matches!(error, ParseError::Overclaimed { count: 4_000_000_000, .. }), "{error:?}");
        let error = parse_error(format!("OFF\n4 4000000000 0\n{BODY}"), "off");
        assert!(matches!(error, ParseError::Overclaimed { element, .. } if element == "face"));
        let error = parse_error("OFF\n5000000000 1 0\n", "off");
        assert!(matches!(error, ParseError::Overclaimed { count: 5_000_000_000, .. }));
    }

    #[test]
    fn a_file_that_was_cut_off_says_where() {
        let text = "OFF\n3 1 0\n0.00000 0.00000 0.00000\n1 0 0\n";
        assert_eq!(parse_error(text, "off"), ParseError::Truncated { element: "vertex".into(), index: 2 });
        let text = "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        assert_eq!(parse_error(text, "off"), ParseError::Truncated { element: "face".into(), index: 1 });
    }
}
