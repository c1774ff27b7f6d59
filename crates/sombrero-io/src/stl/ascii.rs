//! ASCII STL: `solid`, then `facet normal … outer loop vertex … endloop endfacet`, then `endsolid`.
//!
//! Keywords may be in any case, and line ends count as spaces except behind `solid` and `endsolid`, whose names
//! run to the end of the line. A file may hold several solids.

use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::facet::{normal, triangles};
use crate::attributes::Attributes;
use crate::decimals;
use crate::error::{ParseError, Place, WriteError};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};
use crate::splice::Splice;
use crate::text::{self, Words};

/// Whether the file begins like a text: `solid`, a name, and on the next line a facet or the end.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let mut words = Words::new(bytes, text::beginning(bytes));
    if !words.word().is_some_and(|w| bytes[w].eq_ignore_ascii_case(b"solid")) {
        return false;
    }
    words.skip_line();
    words.word().is_some_and(|w| {
        let word = &bytes[w];
        word.eq_ignore_ascii_case(b"facet") || word.eq_ignore_ascii_case(b"endsolid")
    })
}

/// Where the coordinates stand.
#[derive(Debug)]
struct Layout {
    /// For each facet the byte behind the word `facet`.
    slots: Vec<usize>,
}

/// The words of one facet.
struct Facet {
    normal: [Range<usize>; 3],
    corners: [[Range<usize>; 3]; 3],
}

/// Reads the whole file.
pub(super) fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let mut reader = Reader::new(bytes, text::beginning(bytes));
    let (mut points, mut slots) = (Vec::new(), Vec::new());
    while reader.solid()? {
        while reader.choose("facet", "endsolid")? {
            slots.push(reader.words.at());
            for corner in reader.facet()?.corners {
                let [x, y, z] = corner.map(|span| text::coordinate(bytes, span));
                points.push(Point3::new(x?, y?, z?));
            }
            reader.facets += 1;
            limits.check_vertices(points.len())?;
        }
        reader.words.skip_line();
    }
    let mut attributes = Attributes::default();
    attributes.note("facet normals");
    let soup = Soup::new(points, triangles(slots.len()));
    Ok(Parsed::new(Format::StlAscii, soup, attributes, Layout { slots }))
}

struct Reader<'a> {
    bytes: &'a [u8],
    words: Words<'a>,
    /// How many facets were read, for the error if the file ends.
    facets: usize,
}

impl<'a> Reader<'a> {
    fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, words: Words::new(bytes, at), facets: 0 }
    }

    /// Passes over `solid` and its name; `false` if the file ends instead.
    fn solid(&mut self) -> Result<bool, ParseError> {
        let Some(word) = self.words.word() else {
            return Ok(false);
        };
        if !self.is(&word, "solid") {
            return Err(self.unexpected(&word, "solid"));
        }
        self.words.skip_line();
        Ok(true)
    }

    /// The facet behind whose first word the reader stands.
    fn facet(&mut self) -> Result<Facet, ParseError> {
        self.expect("normal")?;
        let normal = self.three()?;
        self.expect("outer")?;
        self.expect("loop")?;
        let corners = [self.corner()?, self.corner()?, self.corner()?];
        self.expect("endloop")?;
        self.skip_unless(&["endfacet"]);
        self.expect("endfacet")?;
        self.skip_unless(&["facet", "endsolid"]);
        Ok(Facet { normal, corners })
    }

    /// Passes over the rest of the line unless one of these words comes next: some programs write more behind a
    /// keyword.
    fn skip_unless(&mut self, keywords: &[&str]) {
        let before = self.words.at();
        let fits =
            self.words.word().is_none_or(|word| keywords.iter().any(|keyword| self.is(&word, keyword)));
        self.words = Words::new(self.bytes, before);
        if !fits {
            self.words.skip_line();
        }
    }

    fn corner(&mut self) -> Result<[Range<usize>; 3], ParseError> {
        self.expect("vertex")?;
        self.three()
    }

    fn three(&mut self) -> Result<[Range<usize>; 3], ParseError> {
        Ok([self.word()?, self.word()?, self.word()?])
    }

    fn word(&mut self) -> Result<Range<usize>, ParseError> {
        self.words.word().ok_or_else(|| ParseError::Truncated { element: "facet".into(), index: self.facets })
    }

    fn expect(&mut self, keyword: &str) -> Result<(), ParseError> {
        let word = self.word()?;
        if self.is(&word, keyword) { Ok(()) } else { Err(self.unexpected(&word, keyword)) }
    }

    /// Whether the next word is the first keyword (`true`) or the second.
    fn choose(&mut self, first: &str, second: &str) -> Result<bool, ParseError> {
        let word = self.word()?;
        match (self.is(&word, first), self.is(&word, second)) {
            (false, false) => Err(self.unexpected(&word, &format!("{first}` or `{second}"))),
            (chosen, _) => Ok(chosen),
        }
    }

    fn is(&self, word: &Range<usize>, keyword: &str) -> bool {
        self.bytes[word.clone()].eq_ignore_ascii_case(keyword.as_bytes())
    }

    fn unexpected(&self, word: &Range<usize>, keyword: &str) -> ParseError {
        let place: Place = text::line_at(self.bytes, word.start);
        let found = text::quoted(&self.bytes[word.clone()]);
        ParseError::Malformed { place, problem: format!("expected `{keyword}`, found `{found}`") }
    }
}

impl parsed::Layout for Layout {
    fn words(&self, original: &Original<'_>) -> Option<decimals::Words> {
        let mut words = decimals::Words::default();
        for &slot in &self.slots {
            let facet = Reader::new(original.bytes, slot).facet().ok()?;
            words.coordinates.extend(facet.corners.into_iter().flatten());
            words.directions.extend(facet.normal);
        }
        Some(words)
    }

    /// The file with new corners, and new normals where corners changed.
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let source = original.bytes;
        let mut splice = Splice::new(source);
        let (old, new) = (original.soup.points.as_chunks::<3>().0, points.as_chunks::<3>().0);
        for ((&slot, old), new) in self.slots.iter().zip(old).zip(new) {
            if old.iter().zip(new).all(|(old, new)| text::same(old, new)) {
                continue;
            }
            // It was read before, so it can be read again.
            if let Ok(facet) = Reader::new(source, slot).facet() {
                replace(&mut splice, source, facet, old, new);
            }
        }
        Ok(splice.finish().into())
    }
}

fn replace(
    splice: &mut Splice<'_>,
    source: &[u8],
    facet: Facet,
    old: &[Point3<f64>; 3],
    new: &[Point3<f64>; 3],
) {
    let zero = facet.normal.iter().all(|span| text::number(&source[span.clone()]) == Some(0.0));
    if !zero {
        for (span, value) in facet.normal.into_iter().zip(normal(*new)) {
            splice.replace(span, |out| text::push_number(out, value));
        }
    }
    for ((spans, old), new) in facet.corners.into_iter().zip(old).zip(new) {
        for (axis, span) in spans.into_iter().enumerate() {
            if old[axis].to_bits() != new[axis].to_bits() {
                splice.replace(span, |out| text::push_number(out, new[axis]));
            }
        }
    }
}

/// A new file with one nameless solid.
pub(super) fn encode(soup: &Soup) -> Vec<u8> {
    let mut out = b"solid\n".to_vec();
    for triangle in &soup.triangles {
        let corners = triangle.map(|corner| soup.points[corner as usize]);
        out.extend_from_slice(b"facet normal ");
        text::push_point(&mut out, &Point3::from(normal(corners)));
        out.extend_from_slice(b"\n  outer loop\n");
        for corner in &corners {
            out.extend_from_slice(b"    vertex ");
            text::push_point(&mut out, corner);
            out.push(b'\n');
        }
        out.extend_from_slice(b"  endloop\nendfacet\n");
    }
    out.extend_from_slice(b"endsolid\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{parse_error, read};

    const FACET: &str = "facet normal 0 0.6 0.8\n outer loop\n  vertex 0 0 0\n  vertex 1.00 0 0\n  \
                         vertex 0 1 0\n endloop\nendfacet\n";

    fn file(facets: usize) -> String {
        format!("solid my part\n{}endsolid my part\n", FACET.repeat(facets))
    }

    fn malformed(line: usize, problem: &str) -> ParseError {
        ParseError::Malformed { place: Place::Line(line), problem: problem.into() }
    }

    #[test]
    fn facets_are_read_in_any_case_and_with_any_line_end() {
        for text in
            [file(2), file(2).to_uppercase(), file(2).replace('\n', "\r\n"), file(2).replace('\n', "\r")]
        {
            let document = read(text, "stl");
            assert_eq!(document.format(), Format::StlAscii);
            assert_eq!(document.points().len(), 6);
            assert_eq!(document.triangles(), [[0, 1, 2], [3, 4, 5]]);
        }
    }

    #[test]
    fn several_solids_are_read_in_order() {
        let document = read(format!("{}{}", file(1), file(2)), "stl");
        assert_eq!(document.triangles().len(), 3);
    }

    #[test]
    fn only_the_facet_that_moved_gets_a_new_normal() {
        let text = file(2);
        let document = read(&text, "stl");
        let mut points = document.points().to_vec();
        points[5].y = 2.5;
        let bytes = document.with_points(&points).unwrap();
        let changed = FACET.replace("0 0.6 0.8", "0.0 0.0 1.0").replace("vertex 0 1 0", "vertex 0 2.5 0");
        let expected = format!("solid my part\n{FACET}{changed}endsolid my part\n");
        assert_eq!(String::from_utf8(bytes).unwrap(), expected);
    }

    #[test]
    fn a_zero_normal_stays_and_one_that_is_no_number_is_renewed() {
        for (before, after) in
            [("0 -0.0 0e3", "0 -0.0 0e3"), ("nan nan nan", "0.0 0.0 1.0"), ("-1.#IND 0 0", "0.0 0.0 1.0")]
        {
            let text = file(1).replace("0 0.6 0.8", before);
            let document = read(text, "stl");
            let mut points = document.points().to_vec();
            points[2].y = 2.0;
            let bytes = document.with_points(&points).unwrap();
            assert!(
                String::from_utf8(bytes).unwrap().contains(&format!("facet normal {after}\n")),
                "{before}"
            );
        }
    }

    #[test]
    fn a_facet_must_be_a_triangle() {
        let text = file(1).replace(" endloop", "  vertex 1 1 1\n endloop");
        assert_eq!(parse_error(text, "stl"), malformed(7, "expected `endloop`, found `vertex`"));
        let text = file(1).replace("  vertex 0 1 0\n", "");
        assert_eq!(parse_error(text, "stl"), malformed(6, "expected `vertex`, found `endloop`"));
    }

    #[test]
    fn strange_words_are_named_with_their_line() {
        let text = file(1).replace("endsolid", "colour");
        assert_eq!(parse_error(text, "stl"), malformed(9, "expected `facet` or `endsolid`, found `colour`"));
        let text = file(1).replace("1.00", "one");
        let expected = ParseError::NotANumber { place: Place::Line(5), found: "one".into() };
        assert_eq!(parse_error(text, "stl"), expected);
        let text = file(1).replace("1.00", "inf");
        assert_eq!(parse_error(text, "stl"), ParseError::NonFinite { place: Place::Line(5) });
        assert_eq!(parse_error("this is no mesh", "stl"), malformed(1, "expected `solid`, found `this`"));
        assert_eq!(
            parse_error(format!("{}junk", file(1)), "stl"),
            malformed(10, "expected `solid`, found `junk`")
        );
    }

    #[test]
    fn a_text_that_was_cut_off_says_where() {
        let truncated = |index| ParseError::Truncated { element: "facet".into(), index };
        let text = file(2);
        assert_eq!(parse_error(&text[..text.len() - "endsolid my part\n".len()], "stl"), truncated(2));
        assert_eq!(parse_error(&text[..text.len() - 40], "stl"), truncated(1));
    }

    #[test]
    fn an_empty_solid_is_no_mesh() {
        assert_eq!(parse_error(file(0), "stl"), ParseError::NoVertices);
    }

    #[test]
    fn words_behind_keywords_are_passed_over() {
        let text = format!("solid a\n{FACET}endsolid a\n")
            .replace("endloop\n", "endloop of many\n")
            .replace("endfacet\n", "endfacet facet 1 of 1\n");
        let text = text.replacen("endfacet facet 1 of 1\n", "endfacet number 1\n", 1);
        let document = read(&text, "stl");
        assert_eq!(document.triangles().len(), 1);
        let mut points = document.points().to_vec();
        points[1].x = 2.0;
        let bytes = String::from_utf8(document.with_points(&points).unwrap()).unwrap();
        assert!(bytes.contains("endloop of many\nendfacet number 1\nendsolid a\n"), "{bytes}");
    }
}
