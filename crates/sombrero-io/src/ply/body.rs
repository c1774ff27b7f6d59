//! The rows behind the header, as text or binary, walked value by value.

use std::ops::Range;

use super::element::{Element, Kind};
use super::scalar::Scalar;
use crate::error::{ParseError, Place};
use crate::text::{self, Words};

/// A walk over values.
pub(super) trait Body<'a> {
    /// All bytes of the file.
    fn bytes(&self) -> &'a [u8];
    /// The byte the walk has come to.
    fn at(&self) -> usize;
    /// Goes on from byte `at`.
    fn seek(&mut self, at: usize);
    /// Passes over one value and tells where it stands; `None` at the end of the file.
    fn pass(&mut self, scalar: Scalar) -> Option<Range<usize>>;
    /// The value at a span that [`pass`](Self::pass) told; `None` if it is no number.
    fn value(&self, scalar: Scalar, span: Range<usize>) -> Option<f64>;
    /// Appends a value.
    fn push(&self, scalar: Scalar, value: f64, out: &mut Vec<u8>);
    /// Takes note that so many rows follow.
    fn expect(&mut self, _rows: u64) {}
    /// Ends a row: what its line holds beyond it belongs to nobody, where lines are rows.
    fn end_row(&mut self) {}
    /// Whether lines held more than their rows.
    fn has_excess(&self) -> bool {
        false
    }
    /// How an error names the place of a value.
    fn place(&self, element: &str, index: usize, span: Range<usize>) -> Place;
    /// Bytes that one value takes at least.
    fn least(scalar: Scalar) -> u64;
    /// Bytes of a row, if all have the same.
    fn row_size(element: &Element) -> Option<usize>;
}

/// Values as words of text; line ends are spaces. Where a line holds more than its row, and there are as many lines as rows,
/// each row has a line of its own.
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    words: Words<'a>,
    rows_left: u64,
    /// Whether rows have lines of their own, once a line made that worth knowing.
    by_line: Option<bool>,
}

impl<'a> Ascii<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, words: Words::new(bytes, at), rows_left: 0, by_line: None }
    }
}

impl<'a> Body<'a> for Ascii<'a> {
    fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    fn at(&self) -> usize {
        self.words.at()
    }

    fn seek(&mut self, at: usize) {
        self.words = Words::new(self.bytes, at);
    }

    fn pass(&mut self, _: Scalar) -> Option<Range<usize>> {
        self.words.word()
    }

    fn value(&self, scalar: Scalar, span: Range<usize>) -> Option<f64> {
        let word = &self.bytes[span];
        // Most integers are short, and reading them as such is several times faster.
        if scalar.is_float() || word.len() > 15 {
            return text::number(word);
        }
        text::integer(word).map(|n| n as f64).or_else(|| text::number(word))
    }

    fn push(&self, _: Scalar, value: f64, out: &mut Vec<u8>) {
        text::push_number(out, value);
    }

    fn expect(&mut self, rows: u64) {
        self.rows_left = rows;
    }

    fn end_row(&mut self) {
        self.rows_left = self.rows_left.saturating_sub(1);
        if self.words.is_at_line_end() {
            return;
        }
        let Self { words, rows_left, by_line, .. } = self;
        if *by_line.get_or_insert_with(|| words.lines_left() >= *rows_left) {
            words.skip_line();
        }
    }

    fn has_excess(&self) -> bool {
        self.by_line == Some(true)
    }

    fn place(&self, _: &str, _: usize, span: Range<usize>) -> Place {
        text::line_at(self.bytes, span.start)
    }

    fn least(_: Scalar) -> u64 {
        // A digit and a space.
        2
    }

    fn row_size(_: &Element) -> Option<usize> {
        None
    }
}

/// Values in their binary types; `BIG` tells the most significant byte comes first.
pub(super) struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }
}

impl<'a, const BIG: bool> Body<'a> for Binary<'a, BIG> {
    fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    fn at(&self) -> usize {
        self.at
    }

    fn seek(&mut self, at: usize) {
        self.at = at;
    }

    fn pass(&mut self, scalar: Scalar) -> Option<Range<usize>> {
        let start = self.at;
        let end = start + scalar.size();
        (end <= self.bytes.len()).then(|| {
            self.at = end;
            start..end
        })
    }

    fn value(&self, scalar: Scalar, span: Range<usize>) -> Option<f64> {
        scalar.decode::<BIG>(self.bytes, span)
    }

    fn push(&self, scalar: Scalar, value: f64, out: &mut Vec<u8>) {
        // Positions of integer types are never rewritten.
        match scalar {
            Scalar::F32 if BIG => out.extend_from_slice(&(value as f32).to_be_bytes()),
            Scalar::F32 => out.extend_from_slice(&(value as f32).to_le_bytes()),
            _ if BIG => out.extend_from_slice(&value.to_be_bytes()),
            _ => out.extend_from_slice(&value.to_le_bytes()),
        }
    }

    fn place(&self, element: &str, index: usize, _: Range<usize>) -> Place {
        Place::Element { name: element.into(), index }
    }

    fn least(scalar: Scalar) -> u64 {
        scalar.size() as u64
    }

    fn row_size(element: &Element) -> Option<usize> {
        element.row_size()
    }
}

/// Refuses a count of rows that the rest of the file cannot hold, before anything is allocated for them.
pub(super) fn check_claim<'a, B: Body<'a>>(body: &B, element: &Element) -> Result<(), ParseError> {
    let row: u64 = element
        .properties
        .iter()
        .map(|p| match p.kind {
            Kind::One(scalar) | Kind::List { count: scalar, .. } => B::least(scalar),
        })
        .sum();
    let count = element.count as u64;
    // The last value of a text needs no space behind it, and the first may stand right behind the header.
    let slack = u64::from(B::row_size(element).is_none() && row > 0);
    let needed = row.saturating_mul(count).saturating_sub(slack);
    let available = (body.bytes().len().saturating_sub(body.at())) as u64;
    if needed > available {
        return Err(ParseError::Overclaimed { element: element.name.clone(), count, needed, available });
    }
    Ok(())
}

/// Passes over one value, which belongs to row `index`.
pub(super) fn pass<'a, B: Body<'a>>(
    body: &mut B,
    scalar: Scalar,
    element: &Element,
    index: usize,
) -> Result<Range<usize>, ParseError> {
    body.pass(scalar).ok_or_else(|| ParseError::Truncated { element: element.name.clone(), index })
}

/// Reads one whole number: the length of a list, or an index in one.
pub(super) fn whole<'a, B: Body<'a>>(
    body: &mut B,
    scalar: Scalar,
    element: &Element,
    index: usize,
) -> Result<i64, ParseError> {
    let span = pass(body, scalar, element, index)?;
    let place = |body: &B| body.place(&element.name, index, span.clone());
    match body.value(scalar, span.clone()) {
        // Every integer type of PLY fits.
        Some(value) if value.fract() == 0.0 && value.abs() <= f64::from(u32::MAX) => Ok(value as i64),
        Some(value) => {
            let problem = format!("expected a whole number of at most 32 bits, found {value:?}");
            Err(ParseError::Malformed { place: place(body), problem })
        }
        None => Err(ParseError::NotANumber {
            place: place(body),
            found: text::quoted(&body.bytes()[span.clone()]),
        }),
    }
}

/// Reads the length of a list.
pub(super) fn length<'a, B: Body<'a>>(
    body: &mut B,
    scalar: Scalar,
    element: &Element,
    index: usize,
) -> Result<u64, ParseError> {
    let start = body.at();
    let length = whole(body, scalar, element, index)?;
    u64::try_from(length).map_err(|_| {
        let span = start..body.at();
        let problem = format!("a list cannot have {length} items");
        // Behind the value rather than before it: the line end between them belongs to the row before.
        ParseError::Malformed { place: body.place(&element.name, index, span.end..span.end), problem }
    })
}

/// Passes over one property of row `index`.
pub(super) fn skip<'a, B: Body<'a>>(
    body: &mut B,
    kind: Kind,
    element: &Element,
    index: usize,
) -> Result<(), ParseError> {
    match kind {
        Kind::One(scalar) => pass(body, scalar, element, index).map(drop),
        Kind::List { count, item } => {
            for _ in 0..length(body, count, element, index)? {
                pass(body, item, element, index)?;
            }
            Ok(())
        }
    }
}

/// Passes over all rows of an element. Their claim was checked.
pub(super) fn skip_rows<'a, B: Body<'a>>(body: &mut B, element: &Element) -> Result<(), ParseError> {
    if element.properties.is_empty() {
        // Rows of nothing: no bytes, however many they are.
        return Ok(());
    }
    if let Some(size) = B::row_size(element) {
        let at = body.at() + size * element.count;
        body.seek(at);
        return Ok(());
    }
    for index in 0..element.count {
        for property in &element.properties {
            skip(body, property.kind, element, index)?;
        }
        body.end_row();
    }
    Ok(())
}
