//! Words, lines and numbers of the ASCII formats.
//!
//! Nothing here allocates while it reads: words are byte ranges of the source, so the writer can find them
//! again. Line numbers are counted only when an error needs one.

use std::io::Write;
use std::ops::Range;

use nalgebra::Point3;

use crate::error::{ParseError, Place};
use crate::splice::Splice;

/// A byte order mark that some editors put before UTF-8 text.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Where the text begins: after a byte order mark, if there is one.
pub(crate) fn beginning(bytes: &[u8]) -> usize {
    if bytes.starts_with(MARK) { MARK.len() } else { 0 }
}

/// Whether a file is text in UTF-16, by its byte order mark or by letters of which every other byte is zero.
pub(crate) fn is_utf16(bytes: &[u8]) -> bool {
    const LOOKED_AT: usize = 8;
    let is_letter = |byte: u8| byte.is_ascii_graphic() || is_space(byte);
    let pairs = bytes.as_chunks::<2>().0.get(..LOOKED_AT).unwrap_or_default();
    let little = pairs.iter().all(|[low, high]| *high == 0 && is_letter(*low));
    let big = pairs.iter().all(|[high, low]| *high == 0 && is_letter(*low));
    let marked = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
    marked || (!pairs.is_empty() && (little || big))
}

/// The line that holds the byte at `offset`. Lines end with LF, CR LF or a lone CR.
pub(crate) fn line_at(bytes: &[u8], offset: usize) -> Place {
    let before = bytes.get(..offset).unwrap_or(bytes);
    let ends = memchr::memchr2_iter(b'\n', b'\r', before)
        .filter(|&i| bytes[i] == b'\n' || bytes.get(i + 1) != Some(&b'\n'))
        .count();
    Place::Line(ends + 1)
}

/// The bytes of a word, made fit for an error message.
pub(crate) fn quoted(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let shown = &word[..word.len().min(LONGEST)];
    let mut text: String = String::from_utf8_lossy(shown).chars().flat_map(char::escape_debug).collect();
    if shown.len() < word.len() {
        text.push('…');
    }
    text
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// Whether words are separated by `byte`.
pub(crate) fn is_space(byte: u8) -> bool {
    is_blank(byte) || is_line_end(byte)
}

/// What joins a line to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Joining {
    Never,
    /// A backslash at its end.
    Backslash,
    /// Line ends are spaces.
    Always,
}

/// A walk over lines of words, where `#` begins a comment.
pub(crate) struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    joining: Joining,
}

impl<'a> Lines<'a> {
    /// Starts at byte `at`.
    pub(crate) fn new(bytes: &'a [u8], at: usize, joining: Joining) -> Self {
        Self { bytes, at, joining }
    }

    /// The byte the walk has come to.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// The next word of this line; `None` at its end or at a comment.
    pub(crate) fn word(&mut self) -> Option<Range<usize>> {
        loop {
            let word = self.word_here();
            if word.is_some() || self.joining != Joining::Always || !self.next_line() {
                return word;
            }
        }
    }

    fn word_here(&mut self) -> Option<Range<usize>> {
        self.skip_blanks();
        let start = self.at;
        match self.bytes.get(start) {
            None | Some(b'\n' | b'\r' | b'#') => return None,
            Some(_) => {}
        }
        while let Some(&byte) = self.bytes.get(self.at) {
            if is_space(byte) || self.is_comment() || (byte == b'\\' && self.joint() > 0) {
                break;
            }
            self.at += 1;
        }
        Some(start..self.at)
    }

    /// Whether a comment begins here. `1.#QNAN` and its like, as some C libraries write what is no number, hold none.
    fn is_comment(&self) -> bool {
        let is_number = self.at > 0 && self.bytes.get(self.at - 1) == Some(&b'.');
        self.bytes.get(self.at) == Some(&b'#') && !is_number
    }

    /// Goes to the beginning of the next line; `false` when there is none.
    pub(crate) fn next_line(&mut self) -> bool {
        while let Some(step) = memchr::memchr2(b'\n', b'\r', self.bytes.get(self.at..).unwrap_or_default()) {
            let end = self.at + step;
            let line = &self.bytes[self.at..end];
            let joined = self.joining == Joining::Backslash && line.ends_with(b"\\") && !has_comment(line);
            let pair = self.bytes[end..].starts_with(b"\r\n");
            self.at = end + if pair { 2 } else { 1 };
            if !joined {
                return true;
            }
        }
        self.at = self.bytes.len();
        false
    }

    /// The first word of the next line that has one, this line included.
    pub(crate) fn first_word(&mut self) -> Option<Range<usize>> {
        loop {
            if let Some(word) = self.word() {
                return Some(word);
            }
            if !self.next_line() {
                return None;
            }
        }
    }

    fn skip_blanks(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            let step = match byte {
                b'\\' => self.joint(),
                byte => usize::from(is_blank(byte)),
            };
            if step == 0 {
                return;
            }
            self.at += step;
        }
    }

    /// Length of the backslash and line end that stand here and join two lines; 0 if none do.
    fn joint(&self) -> usize {
        match (self.joining, self.bytes.get(self.at..)) {
            (Joining::Backslash, Some([b'\\', b'\r', b'\n', ..])) => 3,
            (Joining::Backslash, Some([b'\\', b'\n' | b'\r', ..])) => 2,
            _ => 0,
        }
    }
}

/// Whether a comment begins in what is left of a line: at its front or behind a blank. A comment ends with its line
/// even if it ends with a backslash, as Windows paths in comments may.
fn has_comment(line: &[u8]) -> bool {
    memchr::memchr_iter(b'#', line).any(|i| i.checked_sub(1).is_none_or(|before| is_blank(line[before])))
}

/// A walk over words that takes line ends for spaces.
pub(crate) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    /// Starts at byte `at`.
    pub(crate) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    /// The byte the walk has come to.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// The next word.
    pub(crate) fn word(&mut self) -> Option<Range<usize>> {
        let rest = self.bytes.get(self.at..)?;
        let start = self.at + rest.iter().position(|&b| !is_space(b))?;
        let length = self.bytes[start..].iter().position(|&b| is_space(b));
        self.at = length.map_or(self.bytes.len(), |n| start + n);
        Some(start..self.at)
    }

    /// Whether nothing but blanks is left of this line.
    pub(crate) fn is_at_line_end(&self) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        rest.iter().find(|&&byte| !is_blank(byte)).is_none_or(|&byte| is_line_end(byte))
    }

    /// How many lines behind this one have words.
    pub(crate) fn lines_left(&self) -> u64 {
        let mut words = Self::new(self.bytes, self.at);
        let mut count = 0;
        loop {
            words.skip_line();
            if words.word().is_none() {
                return count;
            }
            count += 1;
        }
    }

    /// Passes over what is left of this line.
    pub(crate) fn skip_line(&mut self) {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        self.at += memchr::memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
    }
}

/// The whole number that `word` spells.
pub(crate) fn integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let size = digits.iter().try_fold(0_i64, |sum, &byte| {
        let digit = byte.is_ascii_digit().then(|| i64::from(byte - b'0'))?;
        sum.checked_mul(10)?.checked_add(digit)
    })?;
    Some(if negative { -size } else { size })
}

/// The number that `word` spells; not necessarily finite.
pub(crate) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The number at `span`, or NaN where there is none: whether that matters, only the faces tell.
pub(crate) fn coordinate(bytes: &[u8], span: Range<usize>) -> f64 {
    number(&bytes[span]).unwrap_or(f64::NAN)
}

/// Whether a word is how C libraries spell what is no number, or more than all of them.
fn is_not_finite(word: &[u8]) -> bool {
    let unsigned = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word).to_ascii_lowercase();
    number(word).is_some_and(|value| !value.is_finite())
        || [&b"nan("[..], b"1.#", b"snan", b"qnan"].iter().any(|start| unsigned.starts_with(start))
}

/// What is wrong with the first of some coordinates that is no finite number.
pub(crate) fn misplaced(bytes: &[u8], coordinates: impl IntoIterator<Item = Range<usize>>) -> ParseError {
    let wrong = |span: &Range<usize>| !coordinate(bytes, span.clone()).is_finite();
    let span = coordinates.into_iter().find(wrong).unwrap_or(0..0);
    let (place, word) = (line_at(bytes, span.start), &bytes[span]);
    if is_not_finite(word) {
        ParseError::NonFinite { place }
    } else {
        ParseError::NotANumber { place, found: quoted(word) }
    }
}

/// Appends the shortest text that reads back as `value`.
pub(crate) fn push_number(out: &mut Vec<u8>, value: f64) {
    // Debug rather than Display: it uses an exponent for huge and tiny numbers instead of 300 zeros.
    let written = write!(out, "{value:?}");
    debug_assert!(written.is_ok(), "a Vec takes all that is written to it");
}

/// Appends the shortest text that reads back as `value`, with zeros behind the point up to `decimals` digits where no
/// exponent stands.
pub(crate) fn push_number_with(out: &mut Vec<u8>, value: f64, decimals: usize) {
    let start = out.len();
    push_number(out, value);
    let written = &out[start..];
    if decimals > 1 && !written.contains(&b'e') {
        let zeros = decimals.saturating_sub(self::decimals(written));
        out.resize(out.len() + zeros, b'0');
    }
}

/// How many digits stand behind the point of a number; none when it has an exponent.
pub(crate) fn decimals(word: &[u8]) -> usize {
    let point = memchr::memchr(b'.', word).map(|at| &word[at + 1..]);
    point.filter(|digits| digits.iter().all(u8::is_ascii_digit)).map_or(0, <[u8]>::len)
}

/// Appends a whole number.
pub(crate) fn push_integer(out: &mut Vec<u8>, value: u64) {
    let written = write!(out, "{value}");
    debug_assert!(written.is_ok(), "a Vec takes all that is written to it");
}

/// Appends a line for each triangle: this letter, and the numbers of its corners, counted from `first`.
pub(crate) fn push_triangles(out: &mut Vec<u8>, letter: u8, triangles: &[[u32; 3]], first: u64) {
    for triangle in triangles {
        out.push(letter);
        for &corner in triangle {
            out.push(b' ');
            push_integer(out, u64::from(corner) + first);
        }
        out.push(b'\n');
    }
}

/// Appends three numbers with spaces between them.
pub(crate) fn push_point(out: &mut Vec<u8>, point: &Point3<f64>) {
    for (axis, &value) in point.iter().enumerate() {
        if axis > 0 {
            out.push(b' ');
        }
        push_number(out, value);
    }
}

/// Reads three coordinates from the line where `lines` stands, which is at `start`. They need not be finite.
pub(crate) fn point(lines: &mut Lines<'_>, bytes: &[u8], start: usize) -> Result<Point3<f64>, ParseError> {
    let mut point = Point3::origin();
    for axis in 0..3 {
        let span = lines.word().ok_or_else(|| ParseError::Malformed {
            place: line_at(bytes, start),
            problem: format!("a vertex needs 3 coordinates, but this one has {axis}"),
        })?;
        point[axis] = coordinate(bytes, span);
    }
    Ok(point)
}

/// `source` with new coordinates in place of the three words that follow each of `slots`.
///
/// A coordinate that did not change keeps its spelling.
pub(crate) fn rewrite_points(
    source: &[u8],
    slots: &[usize],
    joining: Joining,
    old: &[Point3<f64>],
    new: &[Point3<f64>],
) -> Vec<u8> {
    let mut splice = Splice::new(source);
    for ((&slot, old), new) in slots.iter().zip(old).zip(new) {
        if same(old, new) {
            continue;
        }
        let mut lines = Lines::new(source, slot, joining);
        for (old, new) in old.iter().zip(new.iter()) {
            if let Some(span) = lines.word()
                && old.to_bits() != new.to_bits()
            {
                let decimals = decimals(&source[span.clone()]);
                splice.replace(span, |out| push_number_with(out, *new, decimals));
            }
        }
    }
    splice.finish()
}

/// The three words that follow each of `slots`.
pub(crate) fn words_of_points(source: &[u8], slots: &[usize], joining: Joining) -> Vec<Range<usize>> {
    let words = |&slot: &usize| {
        let mut lines = Lines::new(source, slot, joining);
        std::iter::from_fn(move || lines.word()).take(3)
    };
    slots.iter().flat_map(words).collect()
}

/// The same without vertices that have no position, whose words stay as they are.
pub(crate) fn words_of_placed(source: &[u8], slots: &[usize], joining: Joining) -> Vec<Range<usize>> {
    let placed = |slot: &usize| {
        let words = words_of_points(source, std::slice::from_ref(slot), joining);
        let is_placed = words.len() == 3 && words.iter().all(|w| coordinate(source, w.clone()).is_finite());
        if is_placed { words } else { Vec::new() }
    };
    slots.iter().flat_map(placed).collect()
}

/// Whether two points are the same to the bit.
pub(crate) fn same(a: &Point3<f64>, b: &Point3<f64>) -> bool {
    a.iter().zip(b.iter()).all(|(a, b)| a.to_bits() == b.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words_by_line(text: &[u8], joining: Joining) -> Vec<Vec<String>> {
        let mut lines = Lines::new(text, beginning(text), joining);
        let mut all = Vec::new();
        loop {
            let words = std::iter::from_fn(|| lines.word());
            all.push(words.map(|w| String::from_utf8_lossy(&text[w]).into_owned()).collect());
            if !lines.next_line() {
                return all;
            }
        }
    }

    #[test]
    fn lines_end_in_three_ways() {
        assert_eq!(
            words_by_line(b"a b\nc\r\nd\re", Joining::Never),
            [vec!["a", "b"], vec!["c"], vec!["d"], vec!["e"]]
        );
    }

    #[test]
    fn a_backslash_joins_lines_only_where_it_may() {
        assert_eq!(
            words_by_line(b"a\\\nb \\\r\n c\nd", Joining::Backslash),
            [vec!["a", "b", "c"], vec!["d"]]
        );
        assert_eq!(words_by_line(b"a\\\nb", Joining::Never), [vec!["a\\"], vec!["b"]]);
    }

    #[test]
    fn a_comment_ends_with_its_line() {
        assert_eq!(
            words_by_line(b"a # C:\\\nb#c\\\nd", Joining::Backslash),
            [vec!["a"], vec!["b"], vec!["d"]]
        );
    }

    #[test]
    fn a_comment_may_stand_right_behind_a_word() {
        assert_eq!(
            words_by_line(b"1.5#x\n-1.#IND\n2 #", Joining::Never),
            [vec!["1.5"], vec!["-1.#IND"], vec!["2"]]
        );
    }

    #[test]
    fn a_comment_behind_words_that_nobody_reads_ends_with_its_line() {
        let text = b"g a # C:\\\nv 1";
        let mut lines = Lines::new(text, 0, Joining::Backslash);
        assert_eq!(lines.word().map(|w| &text[w]), Some(&b"g"[..]));
        assert!(lines.next_line());
        assert_eq!(lines.word().map(|w| &text[w]), Some(&b"v"[..]));
    }

    #[test]
    fn skipping_a_line_follows_its_continuation() {
        let text = b"skip this \\\nand this\nkeep";
        let mut lines = Lines::new(text, 0, Joining::Backslash);
        assert!(lines.next_line());
        assert_eq!(lines.word().map(|w| &text[w]), Some(&b"keep"[..]));
    }

    #[test]
    fn a_byte_order_mark_is_no_word() {
        assert_eq!(words_by_line(b"\xef\xbb\xbfv 1", Joining::Never), [vec!["v", "1"]]);
    }

    #[test]
    fn integers() {
        assert_eq!(integer(b"12"), Some(12));
        assert_eq!(integer(b"-7"), Some(-7));
        assert_eq!(integer(b"+7"), Some(7));
        for bad in [&b""[..], b"-", b"1.0", b"x", b"99999999999999999999"] {
            assert_eq!(integer(bad), None);
        }
    }

    #[test]
    fn line_numbers_for_each_line_end() {
        assert_eq!(line_at(b"a\r\nb\r\nc", 6), Place::Line(3));
        assert_eq!(line_at(b"a\rb\rc", 4), Place::Line(3));
        assert_eq!(line_at(b"a\nb\nc", 0), Place::Line(1));
    }

    #[test]
    fn long_and_odd_words_are_made_presentable() {
        assert_eq!(quoted(b"a\0b"), "a\\0b");
        assert!(quoted(&[b'x'; 500]).chars().count() <= 41);
    }

    #[test]
    fn a_number_keeps_the_decimals_of_the_one_before() {
        for (old, value, text) in
            [("0.50", 9.0, "9.00"), ("1", 0.25, "0.25"), ("1.5e3", 2.0, "2.0"), ("0.000000", 1e300, "1e300")]
        {
            let mut out = Vec::new();
            push_number_with(&mut out, value, decimals(old.as_bytes()));
            assert_eq!(String::from_utf8(out).unwrap(), text);
        }
    }

    #[test]
    fn numbers_are_short_and_read_back() {
        for (value, text) in
            [(0.1, "0.1"), (-0.0, "-0.0"), (1e300, "1e300"), (5e-324, "5e-324"), (3.0, "3.0")]
        {
            let mut out = Vec::new();
            push_number(&mut out, value);
            assert_eq!(out, text.as_bytes());
            assert_eq!(number(&out).map(f64::to_bits), Some(value.to_bits()));
        }
    }
}
