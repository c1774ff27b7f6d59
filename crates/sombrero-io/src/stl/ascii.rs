//! ASCII STL: `solid`, then `facet normal … outer loop vertex … endloop endfacet`, then `endsolid`.
//!
//! What is said between the facets and behind the words of one is passed over: names, colours, comments (from `#` or `;` on),
//! a tail. Keywords
//! may be in any case, in one word or in two (`end loop`), with a name behind them (`endsolidNAME`); line ends count as
//! spaces within a facet. A file may hold several solids, and its last line may be missing. A facet itself must be
//! whole: three vertices and an end, which tells that the last number was not cut off.

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

/// So many lines may stand between the first and what tells that this is an STL.
const MOST_LINES: usize = 8;

/// Whether the file begins like a text: `solid`, a name, and on one of the next lines a facet or the end.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let mut reader = Reader::new(bytes, text::beginning(bytes));
    if !reader.words.word().is_some_and(|word| reader.is(&word, "solid")) {
        return false;
    }
    (0..MOST_LINES).any(|_| {
        reader.pass_name();
        matches!(reader.line().map(|(line, _)| line), Some(Line::Facet | Line::End))
    })
}

/// The byte where the first facet begins that has a normal or a loop behind that word.
pub(super) fn first_facet(bytes: &[u8]) -> Option<usize> {
    let mut reader = Reader::new(bytes, text::beginning(bytes));
    loop {
        let word = reader.words.word()?;
        if !reader.is(&word, "facet") {
            continue;
        }
        let mut words = Words::new(bytes, word.end);
        let is = |word: Option<&Range<usize>>, keyword| word.is_some_and(|word| reader.is(word, keyword));
        let next = words.word();
        // A header may speak of normals; a number begins with something that is seen.
        let is_seen = |word: Range<usize>| bytes[word.start].is_ascii_graphic();
        let has_normal = is(next.as_ref(), "normal") && words.word().is_some_and(is_seen);
        if has_normal || is(next.as_ref(), "outer") || is(next.as_ref(), "outerloop") {
            return Some(word.start);
        }
    }
}

/// Where the coordinates stand.
#[derive(Debug)]
struct Layout {
    /// For each facet the byte behind the word `facet`.
    slots: Vec<usize>,
}

/// The words of one facet.
struct Facet {
    /// Where the normal stands, if there is one.
    normal: Option<[Range<usize>; 3]>,
    corners: [[Range<usize>; 3]; 3],
}

/// What a line between facets is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Solid,
    Facet,
    End,
    /// A word that belongs into a facet: there must have been one.
    Inside,
    Other,
}

/// Reads the whole file.
pub(super) fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let mut reader = Reader::new(bytes, text::beginning(bytes));
    reader.check_beginning()?;
    let (mut points, mut slots, mut ended) = (Vec::new(), Vec::new(), true);
    while let Some((line, word)) = reader.line() {
        match line {
            Line::Facet => {
                slots.push(reader.words.at());
                let corners = reader.facet()?.corners;
                points.extend(
                    corners.map(|corner| Point3::from(corner.map(|span| text::coordinate(bytes, span)))),
                );
                reader.facets += 1;
                limits.check_vertices(points.len())?;
                continue;
            }
            Line::Inside => return Err(reader.unexpected(&word, "facet` or `endsolid")),
            Line::Solid => ended = false,
            Line::End => ended = true,
            Line::Other => {}
        }
        if is_comment(&bytes[word]) {
            reader.words.skip_line();
        } else {
            reader.pass_name();
        }
    }
    let mut attributes = Attributes::default();
    attributes.note("facet normals");
    let soup = Soup::new(points, triangles(slots.len()));
    let mut parsed = Parsed::new(Format::StlAscii, soup, attributes, Layout { slots });
    if !ended {
        parsed.notes.push("The text ends without `endsolid`: if it was cut off, facets are missing.".into());
    }
    Ok(parsed)
}

/// Whether a comment begins with this word.
fn is_comment(word: &[u8]) -> bool {
    matches!(word.first(), Some(b'#' | b';'))
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

    /// Refuses a text of which no line begins a solid or a facet.
    fn check_beginning(&self) -> Result<(), ParseError> {
        let mut reader = Reader::new(self.bytes, self.words.at());
        let mut first = None;
        while let Some((line, word)) = reader.line() {
            if matches!(line, Line::Solid | Line::Facet) {
                return Ok(());
            }
            first.get_or_insert(word);
            reader.words.skip_line();
        }
        first.map_or(Ok(()), |word| Err(self.unexpected(&word, "solid")))
    }

    /// The first word of the next line that has one, or what is left of this one; and what it says.
    fn line(&mut self) -> Option<(Line, Range<usize>)> {
        let word = self.words.word()?;
        let begins = |keyword: &str| {
            let start = &self.bytes[word.clone()];
            start.get(..keyword.len()).is_some_and(|start| start.eq_ignore_ascii_case(keyword.as_bytes()))
        };
        let line = if self.is(&word, "facet")
            && ["normal", "outer", "outerloop"].iter().any(|k| self.next_is(k))
        {
            Line::Facet
        } else if begins("endsolid") || (self.is(&word, "end") && self.next_is("solid")) {
            Line::End
        } else if begins("solid") {
            Line::Solid
        } else if ["outer", "outerloop", "vertex", "normal"].iter().any(|keyword| self.is(&word, keyword)) {
            Line::Inside
        } else {
            Line::Other
        };
        Some((line, word))
    }

    /// Passes over a name: to the end of the line, or to a facet that begins in it, as where a whole file is one line.
    fn pass_name(&mut self) {
        while !self.words.is_at_line_end() {
            let before = self.words.at();
            let Some(word) = self.words.word() else { return };
            if self.is(&word, "facet") && self.is_before_normal() {
                self.back_to::<()>(before);
                return;
            }
        }
    }

    /// Whether a normal and a loop follow, which no name has.
    fn is_before_normal(&self) -> bool {
        let mut words = Words::new(self.bytes, self.words.at());
        let mut next = || words.word();
        next().is_some_and(|word| self.is(&word, "normal"))
            && (0..3).all(|_| next().is_some_and(|word| text::number(&self.bytes[word]).is_some()))
            && next().is_some_and(|word| self.is(&word, "outer") || self.is(&word, "outerloop"))
    }

    /// Whether the next word is this one.
    fn next_is(&self, keyword: &str) -> bool {
        let mut words = Words::new(self.bytes, self.words.at());
        words.word().is_some_and(|word| self.is(&word, keyword))
    }

    /// The facet behind whose first word the reader stands.
    fn facet(&mut self) -> Result<Facet, ParseError> {
        let before = self.words.at();
        let word = self.word()?;
        let normal = if self.is(&word, "normal") { self.normal()? } else { self.back_to(before) };
        self.find(&["outer", "outerloop"], "outer loop")?;
        let corners = [self.corner()?, self.corner()?, self.corner()?];
        self.end()?;
        Ok(Facet { normal, corners })
    }

    /// The three words of a normal, unless the loop begins before.
    fn normal(&mut self) -> Result<Option<[Range<usize>; 3]>, ParseError> {
        let mut normal = [0..0, 0..0, 0..0];
        for span in &mut normal {
            let before = self.words.at();
            *span = self.word()?;
            if self.is(span, "outer") || self.is(span, "outerloop") {
                return Ok(self.back_to(before));
            }
        }
        Ok(Some(normal))
    }

    /// Goes back to where a word was expected that did not come.
    fn back_to<T>(&mut self, before: usize) -> Option<T> {
        self.words = Words::new(self.bytes, before);
        None
    }

    fn corner(&mut self) -> Result<[Range<usize>; 3], ParseError> {
        self.find(&["vertex"], "vertex")?;
        Ok([self.word()?, self.word()?, self.word()?])
    }

    /// Passes over the end of a facet: `endloop endfacet`, each in one word or in two.
    fn end(&mut self) -> Result<(), ParseError> {
        self.find(&["endloop", "endfacet", "end"], "endloop")?;
        // Whether `facet` would end this one, or begins the next.
        let mut ends = true;
        loop {
            let before = self.words.at();
            let Some(word) = self.words.word() else { return Ok(()) };
            // `end solid` ends more than the facet.
            let is_end = self.is(&word, "end") && !self.next_is("solid");
            let more =
                is_end || ["endloop", "endfacet", "loop"].iter().any(|keyword| self.is(&word, keyword));
            if !(more || ends && self.is(&word, "facet") && self.is_behind_end(before)) {
                self.back_to::<()>(before);
                return Ok(());
            }
            ends = is_end;
        }
    }

    /// Whether the word before a byte is `end`.
    fn is_behind_end(&self, at: usize) -> bool {
        let before = self.bytes.get(..at).unwrap_or_default().trim_ascii_end();
        let start = before.iter().rposition(|&byte| text::is_space(byte)).map_or(0, |at| at + 1);
        before[start..].eq_ignore_ascii_case(b"end")
    }

    /// Passes over all up to one of these words, and over that. Other words of a facet must not come before.
    fn find(&mut self, keywords: &[&str], named: &str) -> Result<(), ParseError> {
        const OTHERS: [&str; 7] =
            ["facet", "outer", "outerloop", "vertex", "endloop", "endfacet", "endsolid"];
        loop {
            let word = self.word()?;
            if keywords.iter().any(|keyword| self.is(&word, keyword)) {
                return Ok(());
            }
            if is_comment(&self.bytes[word.clone()]) {
                self.words.skip_line();
                continue;
            }
            let ends = self.is(&word, "end") && ["loop", "facet", "solid"].iter().any(|k| self.next_is(k));
            if ends || OTHERS.iter().any(|keyword| self.is(&word, keyword)) {
                return Err(self.unexpected(&word, named));
            }
        }
    }

    fn word(&mut self) -> Result<Range<usize>, ParseError> {
        self.words.word().ok_or_else(|| ParseError::Truncated { element: "facet".into(), index: self.facets })
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
    fn misplaced(&self, bytes: &[u8], vertex: usize) -> ParseError {
        let slot = self.slots.get(vertex / 3).copied().unwrap_or(bytes.len());
        let facet = Reader::new(bytes, slot).facet();
        text::misplaced(bytes, facet.into_iter().flat_map(|facet| facet.corners).flatten())
    }

    fn words(&self, original: &Original<'_>) -> Option<decimals::Words> {
        let mut words = decimals::Words::default();
        for &slot in &self.slots {
            let facet = Reader::new(original.bytes, slot).facet().ok()?;
            words.coordinates.extend(facet.corners.into_iter().flatten());
            words.directions.extend(facet.normal.into_iter().flatten());
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
    let is_zero = |span: &Range<usize>| text::number(&source[span.clone()]) == Some(0.0);
    if let Some(spans) = facet.normal.filter(|spans| !spans.iter().all(is_zero)) {
        for (span, value) in spans.into_iter().zip(normal(*new)) {
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
        let text = file(1).replace("facet normal 0 0.6 0.8", "fcaet normal 0 0.6 0.8");
        assert_eq!(parse_error(text, "stl"), malformed(3, "expected `facet` or `endsolid`, found `outer`"));
        let text = file(1).replace("1.00", "one");
        let expected = ParseError::NotANumber { place: Place::Line(5), found: "one".into() };
        assert_eq!(parse_error(text, "stl"), expected);
        let text = file(1).replace("1.00", "inf");
        assert_eq!(parse_error(text, "stl"), ParseError::NonFinite { place: Place::Line(5) });
        assert_eq!(parse_error("this is no mesh", "stl"), malformed(1, "expected `solid`, found `this`"));
    }

    #[test]
    fn a_text_that_was_cut_off_says_where() {
        let text = file(2);
        for end in [40, 37, 35] {
            let truncated = ParseError::Truncated { element: "facet".into(), index: 1 };
            assert_eq!(parse_error(&text[..text.len() - end], "stl"), truncated, "{end}");
        }
    }

    #[test]
    fn a_missing_last_line_is_told() {
        let text = file(2);
        let document = read(&text[..text.len() - "endsolid my part\n".len()], "stl");
        assert_eq!(document.triangles().len(), 2);
        assert!(document.notes()[0].starts_with("The text ends without `endsolid`"));
        assert!(read(&text, "stl").notes().is_empty());
    }

    /// What is written with other positions is what was read but for the numbers.
    fn holds(text: &str, facets: usize) {
        let document = read(text, "stl");
        assert_eq!(document.format(), Format::StlAscii, "{text}");
        assert_eq!(document.triangles().len(), facets, "{text}");
        let has_end = text.to_lowercase().replace("end solid", "endsolid").contains("endsolid");
        assert_eq!(document.notes().is_empty(), has_end, "{text}");
        let mut points = document.points().to_vec();
        points[1].x = 2.5;
        let bytes = String::from_utf8(document.with_points(&points).unwrap()).unwrap();
        // Line by line, but for the normals, which follow.
        let rest = |text: &str| -> Vec<String> {
            text.lines().filter(|line| !line.contains("normal")).map(str::to_owned).collect()
        };
        assert_eq!(rest(&bytes), rest(&text.replacen("1.00", "2.5", 1)));
        assert_eq!(read(bytes, "stl").points(), points);
    }

    #[test]
    fn keywords_are_taken_as_people_write_them() {
        for (from, to) in [
            ("endsolid my part", "end solid my part"),
            ("endsolid my part", "endsolidmy_part"),
            ("endsolid my part", "END SOLID"),
            ("endsolid my part", "endsolid my part\nProduced by somebody\n% the end"),
            ("endsolid my part", "endsolid\n\u{1a}"),
            ("endsolid my part\n", "\u{1a}"),
            ("endloop", "end loop"),
            ("endfacet", "end facet"),
            (" endloop\nendfacet", " end loop\nend facet"),
            ("outer loop", "outerloop"),
            ("outer loop", "outer  loop  1"),
            ("facet normal", "facet\tnormal"),
            ("facet normal 0 0.6 0.8", "facet normal"),
            ("facet normal 0 0.6 0.8\n outer", "facet outer"),
            ("facet normal 0 0.6 0.8", "facet normal 0 0.6 0.8 color 255 0 0"),
            ("vertex 1.00 0 0", "vertex 1.00 0 0 0.5 0.5 0.5"),
            (" outer", " color 1 0 0\n outer"),
            (" endloop\nendfacet", " endloop"),
            (" endloop\nendfacet", "endfacet"),
            ("solid my part\n", "solid my part\ncolor 0.5 0.5 0.5\n; a remark\n"),
            ("solid my part\n", "# made by hand\nsolid\n"),
            ("solid my part\n", "solid solid facet normal\n"),
            ("endfacet\n", "endfacet\nCOLOUR 0 0 1\n"),
            ("endfacet\n", "endfacet\nendfacet\n"),
            ("endloop", "# the last vertex of an outer loop\nendloop"),
            ("facet normal 0 0.6 0.8", "facet normal 0 0.6 0.8 ; facet normal\n"),
            ("endfacet\n", "endfacet\n; facet normal 0 0 1 outer loop\n"),
        ] {
            let text = file(2);
            let (body, end) = text.split_at(text.len() - "endsolid my part\n".len());
            let text = if from.starts_with("endsolid") {
                format!("{body}{}", end.replace(from, to))
            } else {
                format!("{}{end}", body.replace(from, to))
            };
            holds(&text, 2);
            holds(&text.replace('\n', "\r\n"), 2);
        }
    }

    #[test]
    fn a_file_may_be_one_line() {
        let text = file(2).replace('\n', " ");
        holds(&text, 2);
        holds(&format!("{text}{text}"), 4);
        assert_eq!(read(text.replace("endfacet", "endfacet color 1 0 0"), "stl").triangles().len(), 2);
        holds(&text.replacen("solid my part", "solid facet normal 1 2", 1), 2);
    }

    #[test]
    fn several_solids_may_be_ended_in_any_way_or_not_at_all() {
        for between in [
            "endsolid a\n\nsolid b\n",
            "end solid\nsolid b\n",
            "endsolida\ncolor 1 0 0\nsolid\n",
            "solid b\n",
            "endsolid\n",
        ] {
            holds(&format!("solid a\n{FACET}{between}{FACET}endsolid b\n"), 2);
        }
    }

    #[test]
    fn a_zero_in_a_text_does_not_make_it_binary_when_numbers_grow() {
        // Wherever the zero is, before and after the first number gets more digits.
        for at in 95..file(2).len() - 20 {
            let mut text = file(2).into_bytes();
            if text[at] != b'\n' {
                continue;
            }
            text.splice(at..at, *b" \0");
            let Ok(document) = crate::Document::parse(text, Some("stl")) else { continue };
            let mut points = document.points().to_vec();
            points[1].x = 2.525;
            let again = read(document.with_points(&points).unwrap(), "stl");
            assert_eq!(again.points(), points, "{at}");
        }
    }

    #[test]
    fn a_zero_in_a_text_does_not_make_it_binary_when_numbers_shrink() {
        for name in [0, 30, 60, 90] {
            for zero in 0..200 {
                let mut bytes = format!("solid {:name$}\n{}", "", FACET.repeat(2)).into_bytes();
                bytes = String::from_utf8(bytes).unwrap().replace("0.6", "0.600000000000000").into_bytes();
                bytes.insert(zero, 0);
                let Ok(document) = crate::Document::parse(bytes, Some("stl")) else { continue };
                let points: Vec<_> = document.points().iter().map(|p| p * 2.0).collect();
                let bytes = document.with_points(&points).unwrap();
                assert_eq!(read(bytes, "stl").points(), points, "{name} {zero}");
            }
        }
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
