//! The ZIP container: unpacking an entry, and putting other content in an entry's place.
//!
//! Putting content in place copies the archive and touches as little of it as can be: the packed bytes of the
//! entry, its sizes and checksum wherever they are written, and the offsets of what moved behind it. Names,
//! times, flags, extra fields, comments, gaps and the order of everything stay, whoever wrote the archive.

use std::borrow::Cow;

use super::directory::{
    End, Entry, damaged, data, descriptor, find_end, mark_alone, read_entry, span, unsupported,
};
use super::fields::{Slot, central_slots, get, local_slots, set, u32_at};
use super::packing::{checksum, deflate, inflate};
use crate::error::{ParseError, WriteError};
use crate::format::Format;
use crate::splice::Splice;
use crate::text;

const STORED: u16 = 0;
const DEFLATED: u16 = 8;

/// The flags of entries that are encrypted, in whole or in their headers.
const ENCRYPTED: u16 = 1 | 1 << 6 | 1 << 13;
/// How many bytes may still be unpacked.
#[derive(Debug)]
pub(super) struct Budget {
    limit: u64,
    left: u64,
}

impl Budget {
    pub(super) fn new(limit: u64) -> Self {
        Self { limit, left: limit }
    }
}

/// An archive whose directory was read.
#[derive(Debug)]
pub(super) struct Archive<'a> {
    bytes: &'a [u8],
    end: End,
    entries: Vec<Entry>,
}

/// Other content for an entry, packed.
#[derive(Debug)]
pub(super) struct Packed {
    entry: usize,
    bytes: Vec<u8>,
    checksum: u32,
    unpacked: u64,
}

impl<'a> Archive<'a> {
    /// Reads the directory.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ParseError> {
        let end = find_end(bytes)?;
        let mut entries = Vec::new();
        let mut at = end.directory;
        while (entries.len() as u64) < end.count {
            let cut = || damaged(format!("has a directory that breaks off at entry {}", entries.len()));
            let (entry, next) =
                read_entry(bytes, at).filter(|&(_, next)| next <= end.last).ok_or_else(cut)?;
            entries.push(entry);
            at = next;
        }
        mark_alone(bytes, &mut entries, end.directory);
        Ok(Self { bytes, end, entries })
    }

    /// How many entries there are.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// An entry's name as the directory spells it.
    pub(super) fn name(&self, index: usize) -> &'a [u8] {
        self.entries.get(index).and_then(|entry| self.bytes.get(entry.name.clone())).unwrap_or_default()
    }

    /// An entry's name, made fit for a message.
    pub(super) fn title(&self, index: usize) -> String {
        text::quoted(self.name(index))
    }

    /// An error if other content could not be put in an entry's place without harm to another entry.
    pub(super) fn check_alone(&self, index: usize) -> Result<(), ParseError> {
        match self.entries.get(index) {
            Some(entry) if entry.alone => Ok(()),
            _ => Err(damaged(format!("has other entries in the same bytes as `{}`", self.title(index)))),
        }
    }

    /// The content of an entry.
    pub(super) fn unpack(&self, index: usize, budget: &mut Budget) -> Result<Cow<'a, [u8]>, ParseError> {
        let broken = |problem: &str| damaged(format!("holds `{}`, {problem}", self.title(index)));
        let entry = self.entries.get(index).ok_or_else(|| broken("which is missing"))?;
        if entry.flags & ENCRYPTED != 0 {
            return Err(unsupported(format!("the encrypted entry `{}`", self.title(index))));
        }
        let data = data(self.bytes, entry).and_then(|range| self.bytes.get(range));
        let data = data.ok_or_else(|| broken("whose content is not where the directory says"))?;
        let content = match entry.method {
            STORED => Cow::Borrowed(data),
            DEFLATED => Cow::Owned(inflate(data, budget.left).ok_or_else(|| broken("which is damaged"))?),
            method => {
                let what = format!("{} in the entry `{}`", method_name(method), self.title(index));
                return Err(unsupported(what));
            }
        };
        let length = content.len() as u64;
        let what = || format!("the 3MF archive, at `{}`,", self.title(index));
        budget.left = budget
            .left
            .checked_sub(length)
            .ok_or_else(|| ParseError::Unpacked { what: what(), limit: budget.limit })?;
        if length != entry.unpacked || checksum(&content) != entry.checksum {
            return Err(broken("which is damaged: its checksum or its size is another"));
        }
        Ok(content)
    }

    /// Packs other content for an entry, in the way that it is packed now.
    pub(super) fn pack(&self, index: usize, content: &[u8]) -> Packed {
        let stored = self.entries.get(index).is_some_and(|entry| entry.method == STORED);
        let bytes = if stored { content.to_vec() } else { deflate(content) };
        Packed { entry: index, bytes, checksum: checksum(content), unpacked: content.len() as u64 }
    }

    /// The archive with other content in place of some entries.
    ///
    /// Every one of them has to be [alone](Self::check_alone).
    pub(super) fn replace(&self, mut packed: Vec<Packed>) -> Result<Vec<u8>, WriteError> {
        packed.sort_by_key(|new| self.entries.get(new.entry).map(|entry| entry.header));
        self.replaced(&packed)
            .ok_or(WriteError::TooMany { format: Format::ThreeMf, count: u32::MAX as usize })
    }

    /// `None` when a size or an offset no longer fits its field.
    fn replaced(&self, packed: &[Packed]) -> Option<Vec<u8>> {
        let mut splice = Splice::new(self.bytes);
        // What stands behind each of these offsets moves by so many bytes.
        let mut moves: Vec<(usize, i64)> = Vec::new();
        let mut shift = 0;
        for new in packed {
            let entry = self.entries.get(new.entry)?;
            let span = span(self.bytes, entry)?;
            let record = local_record(self.bytes, entry, new)?;
            shift += i64::try_from(record.len()).ok()? - i64::try_from(span.len()).ok()?;
            moves.push((span.start, shift));
            splice.replace(span, |out| out.extend_from_slice(&record));
        }
        let mut out = splice.finish();
        let moved = |at: usize| {
            let before = moves.partition_point(|&(start, _)| start < at);
            let shift = before.checked_sub(1).and_then(|i| moves.get(i)).map_or(0, |&(_, shift)| shift);
            (at as u64).checked_add_signed(shift)
        };
        let mut news = vec![None; self.entries.len()];
        for new in packed {
            *news.get_mut(new.entry)? = Some(new);
        }
        for (entry, new) in self.entries.iter().zip(news) {
            let at = usize::try_from(moved(entry.central)?).ok()?;
            patch_central(&mut out, at, moved(entry.header)?, new)?;
        }
        self.patch_end(&mut out, moved)?;
        Some(out)
    }

    fn patch_end(&self, out: &mut [u8], moved: impl Fn(usize) -> Option<u64>) -> Option<()> {
        let directory = moved(self.end.directory)?;
        let at = usize::try_from(moved(self.end.at)?).ok()?;
        // Large archives have ones here and the number elsewhere.
        if self.end.wide.is_none() || u32_at(out, at + 16)? != u32::MAX {
            set(out, Slot::Narrow(at + 16), directory)?;
        }
        if let Some((wide, locator)) = self.end.wide {
            set(out, Slot::Wide(usize::try_from(moved(wide)?).ok()? + 48), directory)?;
            set(out, Slot::Wide(usize::try_from(moved(locator)?).ok()? + 8), moved(wide)?)?;
        }
        Some(())
    }
}

fn method_name(method: u16) -> String {
    match method {
        9 => "compression by Deflate64".into(),
        12 => "compression by bzip2".into(),
        14 => "compression by LZMA".into(),
        93 => "compression by Zstandard".into(),
        95 => "compression by XZ".into(),
        98 => "compression by PPMd".into(),
        99 => "AES encryption".into(),
        other => format!("compression method {other}"),
    }
}

/// What stands at an entry's place once it has other content.
fn local_record(bytes: &[u8], entry: &Entry, new: &Packed) -> Option<Vec<u8>> {
    let data = data(bytes, entry)?;
    let mut out = bytes.get(entry.header..data.start)?.to_vec();
    // Where the sizes follow the content they are zeros here, and stay zeros.
    if u32_at(&out, 14)? == entry.checksum {
        out.get_mut(14..18)?.copy_from_slice(&new.checksum.to_le_bytes());
    }
    let sizes = [(entry.unpacked, new.unpacked), (entry.packed, new.bytes.len() as u64)];
    for (slot, (before, after)) in local_slots(&out, 0)?.into_iter().zip(sizes) {
        if get(&out, slot)? == before {
            set(&mut out, slot, after)?;
        }
    }
    out.extend_from_slice(&new.bytes);
    if let Some(way) = descriptor(bytes, entry, data.end) {
        out.extend(way.write(new.checksum, new.bytes.len() as u64, new.unpacked)?);
    }
    Some(out)
}

fn patch_central(out: &mut [u8], at: usize, header: u64, new: Option<&Packed>) -> Option<()> {
    let [unpacked, packed, offset] = central_slots(out, at)?;
    if get(out, offset)? != header {
        set(out, offset, header)?;
    }
    if let Some(new) = new {
        out.get_mut(at + 16..at + 20)?.copy_from_slice(&new.checksum.to_le_bytes());
        set(out, unpacked, new.unpacked)?;
        set(out, packed, new.bytes.len() as u64)?;
    }
    Some(())
}
