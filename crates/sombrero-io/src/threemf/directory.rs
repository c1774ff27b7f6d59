//! The directory of a ZIP archive: its entries, and which bytes belong to each.

use std::ops::Range;

use super::fields::{
    CENTRAL, CENTRAL_LENGTH, DESCRIPTOR, END, END_LENGTH, LOCAL, LOCAL_LENGTH, LOCATOR, LOCATOR_LENGTH,
    WIDE_END, WIDE_END_LENGTH, central_slots, get, is_at, length_at, offset_at, u16_at, u32_at, u64_at,
};
use crate::error::ParseError;

/// The flag of entries whose sizes follow their content.
const DESCRIBED: u16 = 1 << 3;

/// What the directory says about an entry.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) name: Range<usize>,
    pub(super) flags: u16,
    pub(super) method: u16,
    pub(super) checksum: u32,
    pub(super) packed: u64,
    pub(super) unpacked: u64,
    /// Where its local header stands.
    pub(super) header: usize,
    /// Where its header in the directory stands.
    pub(super) central: usize,
    /// Whether no other entry shares any of its bytes.
    pub(super) alone: bool,
}

/// Where the directory ends.
#[derive(Debug)]
pub(super) struct End {
    pub(super) at: usize,
    /// The end of large archives, if there is one, and what points to it.
    pub(super) wide: Option<(usize, usize)>,
    pub(super) directory: usize,
    /// Where the directory must have ended.
    pub(super) last: usize,
    pub(super) count: u64,
}

pub(super) fn damaged(problem: String) -> ParseError {
    ParseError::Archive { problem }
}

pub(super) fn unsupported(what: String) -> ParseError {
    ParseError::Unsupported { what, cure: "export the model again as plain 3MF" }
}

/// The end record: the last signature from which a comment of the length it states fits into the file.
pub(super) fn find_end(bytes: &[u8]) -> Result<End, ParseError> {
    const LONGEST: usize = END_LENGTH + u16::MAX as usize;
    let start = bytes.len().saturating_sub(LONGEST);
    let tail = bytes.get(start..).unwrap_or_default();
    let end = memchr::memmem::rfind_iter(tail, END).find_map(|at| read_end(bytes, start + at));
    end.unwrap_or_else(|| Err(damaged("has no directory at its end; it was cut off".into())))
}

/// `None` where there is no end record, an error where there is one that cannot be used.
fn read_end(bytes: &[u8], at: usize) -> Option<Result<End, ParseError>> {
    let comment = length_at(bytes, at + 20)?;
    if at + END_LENGTH + comment > bytes.len() {
        return None;
    }
    let volumes = [u16_at(bytes, at + 4)?, u16_at(bytes, at + 6)?];
    let (mut count, mut size) = (u64::from(u16_at(bytes, at + 10)?), u64::from(u32_at(bytes, at + 12)?));
    let mut directory = u64::from(u32_at(bytes, at + 16)?);
    let mut last = at;
    let wide = find_wide_end(bytes, at);
    if let Some((wide, _)) = wide {
        count = u64_at(bytes, wide + 32)?;
        size = u64_at(bytes, wide + 40)?;
        directory = u64_at(bytes, wide + 48)?;
        last = wide;
    } else if volumes.iter().any(|&volume| volume != 0) {
        return Some(Err(unsupported("a ZIP archive in several volumes".into())));
    }
    let fits = directory.checked_add(size).is_some_and(|end| end <= last as u64);
    let directory = usize::try_from(directory).ok().filter(|_| fits);
    let Some(directory) = directory else {
        return Some(Err(damaged("has a directory that is not where its end says".into())));
    };
    Some(Ok(End { at, wide, directory, last, count }))
}

/// The end of large archives and its locator, which stand before the end.
fn find_wide_end(bytes: &[u8], end: usize) -> Option<(usize, usize)> {
    let locator = end.checked_sub(LOCATOR_LENGTH).filter(|&at| is_at(bytes, at, LOCATOR))?;
    let wide = offset_at(bytes, locator + 8)?;
    let fits = wide.checked_add(WIDE_END_LENGTH).is_some_and(|end| end <= locator);
    (fits && is_at(bytes, wide, WIDE_END)).then_some((wide, locator))
}

/// The entry whose header stands at `at` in the directory, and where the next one stands.
pub(super) fn read_entry(bytes: &[u8], at: usize) -> Option<(Entry, usize)> {
    if !is_at(bytes, at, CENTRAL) {
        return None;
    }
    let name = at + CENTRAL_LENGTH..at + CENTRAL_LENGTH + length_at(bytes, at + 28)?;
    let next = name.end + length_at(bytes, at + 30)? + length_at(bytes, at + 32)?;
    let [unpacked, packed, header] = central_slots(bytes, at)?.map(|slot| get(bytes, slot));
    let entry = Entry {
        name,
        flags: u16_at(bytes, at + 8)?,
        method: u16_at(bytes, at + 10)?,
        checksum: u32_at(bytes, at + 16)?,
        packed: packed?,
        unpacked: unpacked?,
        header: usize::try_from(header?).ok()?,
        central: at,
        alone: false,
    };
    Some((entry, next))
}

/// Where the packed bytes of an entry stand.
pub(super) fn data(bytes: &[u8], entry: &Entry) -> Option<Range<usize>> {
    let at = entry.header;
    if !is_at(bytes, at, LOCAL) {
        return None;
    }
    let start = at + LOCAL_LENGTH + length_at(bytes, at + 26)? + length_at(bytes, at + 28)?;
    let end = start.checked_add(usize::try_from(entry.packed).ok()?)?;
    (end <= bytes.len()).then_some(start..end)
}

/// All that stands at an entry's place: local header, content, and the sizes behind it if there are any.
pub(super) fn span(bytes: &[u8], entry: &Entry) -> Option<Range<usize>> {
    let data = data(bytes, entry)?;
    Some(entry.header..data.end + descriptor(bytes, entry, data.end).map_or(0, |d| d.length()))
}

/// How the sizes behind an entry's content are written.
#[derive(Clone, Copy)]
pub(super) struct Descriptor {
    signed: bool,
    wide: bool,
}

impl Descriptor {
    pub(super) fn length(self) -> usize {
        4 + if self.signed { 4 } else { 0 } + if self.wide { 16 } else { 8 }
    }

    pub(super) fn write(self, checksum: u32, packed: u64, unpacked: u64) -> Option<Vec<u8>> {
        let mut out = if self.signed { DESCRIPTOR.to_vec() } else { Vec::new() };
        out.extend_from_slice(&checksum.to_le_bytes());
        for size in [packed, unpacked] {
            if self.wide {
                out.extend_from_slice(&size.to_le_bytes());
            } else {
                out.extend_from_slice(&u32::try_from(size).ok()?.to_le_bytes());
            }
        }
        Some(out)
    }
}

/// Nothing tells the four ways apart, so the one is taken that gives the sizes of the directory.
pub(super) fn descriptor(bytes: &[u8], entry: &Entry, at: usize) -> Option<Descriptor> {
    if entry.flags & DESCRIBED == 0 {
        return None;
    }
    let ways = [(true, false), (true, true), (false, false), (false, true)];
    ways.map(|(signed, wide)| Descriptor { signed, wide }).into_iter().find(|way| {
        let expected = way.write(entry.checksum, entry.packed, entry.unpacked);
        expected.is_some_and(|expected| is_at(bytes, at, &expected))
    })
}

/// Marks the entries that stand before the directory and share no byte with another. One whose end cannot be told
/// may reach anywhere.
pub(super) fn mark_alone(bytes: &[u8], entries: &mut [Entry], directory: usize) {
    let mut spans: Vec<_> = entries
        .iter()
        .enumerate()
        .map(|(index, entry)| (span(bytes, entry).unwrap_or(entry.header..usize::MAX), index))
        .collect();
    spans.sort_by_key(|(span, _)| span.start);
    let mut reached = 0;
    for (i, (span, index)) in spans.iter().enumerate() {
        let next = spans.get(i + 1).map_or(directory, |(next, _)| next.start.min(directory));
        if let Some(entry) = entries.get_mut(*index) {
            entry.alone = !span.is_empty() && span.start >= reached && span.end <= next;
        }
        reached = reached.max(span.end);
    }
}
