//! Copying a source while some of its spans are replaced.

use std::ops::Range;

/// The source with replacements, built from front to back.
pub(crate) struct Splice<'a> {
    source: &'a [u8],
    copied: usize,
    out: Vec<u8>,
}

impl<'a> Splice<'a> {
    /// Starts at the front of `source`.
    pub(crate) fn new(source: &'a [u8]) -> Self {
        Self::of(source, 0..source.len())
    }

    /// A part of `source` alone, whose spans count from the front of all of it.
    pub(crate) fn of(source: &'a [u8], part: Range<usize>) -> Self {
        // Moved coordinates usually need more digits than the source had.
        let out = Vec::with_capacity(part.len() + part.len() / 2);
        Self { source: source.get(..part.end).unwrap_or(source), copied: part.start, out }
    }

    /// Copies up to `span`, then lets `write` append what stands in its place.
    ///
    /// Spans must come in ascending order; what was already passed is not copied again.
    pub(crate) fn replace(&mut self, span: Range<usize>, write: impl FnOnce(&mut Vec<u8>)) {
        if let Some(between) = self.source.get(self.copied..span.start) {
            self.out.extend_from_slice(between);
            write(&mut self.out);
            self.copied = span.end;
        } else {
            debug_assert!(false, "spans out of order: {span:?} after {}", self.copied);
        }
    }

    /// Copies the rest.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(self.source.get(self.copied..).unwrap_or_default());
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replacements_may_be_longer_or_shorter() {
        let mut splice = Splice::new(b"one two three");
        splice.replace(0..3, |out| out.extend_from_slice(b"1"));
        splice.replace(4..7, |out| out.extend_from_slice(b"second"));
        assert_eq!(splice.finish(), b"1 second three");
    }

    #[test]
    fn parts_are_put_together_again() {
        let source = b"one two three";
        let mut pieces = [0..4, 4..13].map(|part| Splice::of(source, part));
        pieces[1].replace(4..7, |out| out.extend_from_slice(b"2"));
        assert_eq!(pieces.map(Splice::finish).concat(), b"one 2 three");
    }

    #[test]
    fn nothing_replaced_is_a_copy() {
        assert_eq!(Splice::new(b"same").finish(), b"same");
    }
}
