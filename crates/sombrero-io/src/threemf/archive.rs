//! The ZIP container: its directory, unpacking an entry, and putting other content in an entry's place.
//!
//! Putting content in place copies the archive and touches as little of it as can be: the packed bytes of the
//! entry, its sizes and checksum wherever they are written, and the offsets of what moved behind it. Names,
//! times, flags, extra fields, comments, gaps and the order of everything stay, whoever wrote the archive.

use std::borrow::Cow;
use std::io::{Read, Write};
use std::ops::Range;

use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

use crate::error::{ParseError, WriteError};
use crate::format::Format;
use crate::splice::Splice;
use crate::text;

const LOCAL: &[u8] = b"PK\x03\x04";
const CENTRAL: &[u8] = b"PK\x01\x02";
const END: &[u8] = b"PK\x05\x06";
const WIDE_END: &[u8] = b"PK\x06\x06";
const LOCATOR: &[u8] = b"PK\x06\x07";
const DESCRIPTOR: &[u8] = b"PK\x07\x08";

/// The lengths of the headers without names, extra fields and comments.
const LOCAL_LENGTH: usize = 30;
const CENTRAL_LENGTH: usize = 46;
const END_LENGTH: usize = 22;
const LOCATOR_LENGTH: usize = 20;
const WIDE_END_LENGTH: usize = 56;

const STORED: u16 = 0;
const DEFLATED: u16 = 8;

/// The flags of entries that are encrypted, in whole or in their headers.
const ENCRYPTED: u16 = 1 | 1 << 6 | 1 << 13;
/// The flag of entries whose sizes follow their content.
const DESCRIBED: u16 = 1 << 3;

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

/// A field of a header: 32 bits wide, or 64 bits in the extra field that large archives have.
#[derive(Debug, Clone, Copy)]
enum Slot {
    Narrow(usize),
    Wide(usize),
}

/// What the directory says about an entry.
#[derive(Debug)]
struct Entry {
    name: Range<usize>,
    flags: u16,
    method: u16,
    checksum: u32,
    packed: u64,
    unpacked: u64,
    /// Where its local header stands.
    header: usize,
    /// Where its header in the directory stands.
    central: usize,
    /// Whether no other entry shares any of its bytes.
    alone: bool,
}

/// Where the directory ends.
#[derive(Debug)]
struct End {
    at: usize,
    /// The end of large archives, if there is one, and what points to it.
    wide: Option<(usize, usize)>,
    directory: usize,
    /// Where the directory must have ended.
    last: usize,
    count: u64,
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

fn damaged(problem: String) -> ParseError {
    ParseError::Archive { problem }
}

fn unsupported(what: String) -> ParseError {
    ParseError::Unsupported { what, cure: "export the model again as plain 3MF" }
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

fn chunk<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    chunk(bytes, at).map(u16::from_le_bytes)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    chunk(bytes, at).map(u32::from_le_bytes)
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    chunk(bytes, at).map(u64::from_le_bytes)
}

fn length_at(bytes: &[u8], at: usize) -> Option<usize> {
    u16_at(bytes, at).map(usize::from)
}

fn offset_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u64_at(bytes, at)?).ok()
}

fn is_at(bytes: &[u8], at: usize, signature: &[u8]) -> bool {
    bytes.get(at..).is_some_and(|rest| rest.starts_with(signature))
}

fn get(bytes: &[u8], slot: Slot) -> Option<u64> {
    match slot {
        Slot::Narrow(at) => u32_at(bytes, at).map(u64::from),
        Slot::Wide(at) => u64_at(bytes, at),
    }
}

/// `None` when the value does not fit.
fn set(bytes: &mut [u8], slot: Slot, value: u64) -> Option<()> {
    match slot {
        Slot::Narrow(at) => {
            let value = u32::try_from(value).ok().filter(|&value| value != u32::MAX)?;
            bytes.get_mut(at..at.checked_add(4)?)?.copy_from_slice(&value.to_le_bytes());
        }
        Slot::Wide(at) => bytes.get_mut(at..at.checked_add(8)?)?.copy_from_slice(&value.to_le_bytes()),
    }
    Some(())
}

/// The end record: the last signature from which a comment of the length it states fits into the file.
fn find_end(bytes: &[u8]) -> Result<End, ParseError> {
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
fn read_entry(bytes: &[u8], at: usize) -> Option<(Entry, usize)> {
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

/// Unpacked size, packed size and offset of an entry in the directory.
fn central_slots(bytes: &[u8], at: usize) -> Option<[Slot; 3]> {
    let extra = at + CENTRAL_LENGTH + length_at(bytes, at + 28)?;
    let end = extra + length_at(bytes, at + 30)?;
    slots(bytes, [at + 24, at + 20, at + 42], extra..end)
}

/// Unpacked and packed size in a local header.
fn local_slots(bytes: &[u8], at: usize) -> Option<[Slot; 2]> {
    let extra = at + LOCAL_LENGTH + length_at(bytes, at + 26)?;
    let end = extra + length_at(bytes, at + 28)?;
    slots(bytes, [at + 22, at + 18], extra..end)
}

/// Fields that are all ones stand in the extra field of large archives, in this order.
fn slots<const N: usize>(bytes: &[u8], fields: [usize; N], extra: Range<usize>) -> Option<[Slot; N]> {
    let mut wide = find_wide_extra(bytes, extra);
    let mut slots = fields.map(Slot::Narrow);
    for (slot, at) in slots.iter_mut().zip(fields) {
        if u32_at(bytes, at)? == u32::MAX && wide.len() >= 8 {
            *slot = Slot::Wide(wide.start);
            wide.start += 8;
        }
    }
    Some(slots)
}

fn find_wide_extra(bytes: &[u8], extra: Range<usize>) -> Range<usize> {
    let mut at = extra.start;
    while let (Some(id), Some(length)) = (u16_at(bytes, at), length_at(bytes, at + 2)) {
        let end = at + 4 + length;
        if end > extra.end {
            break;
        }
        if id == 1 {
            return at + 4..end;
        }
        at = end;
    }
    0..0
}

/// Where the packed bytes of an entry stand.
fn data(bytes: &[u8], entry: &Entry) -> Option<Range<usize>> {
    let at = entry.header;
    if !is_at(bytes, at, LOCAL) {
        return None;
    }
    let start = at + LOCAL_LENGTH + length_at(bytes, at + 26)? + length_at(bytes, at + 28)?;
    let end = start.checked_add(usize::try_from(entry.packed).ok()?)?;
    (end <= bytes.len()).then_some(start..end)
}

/// All that stands at an entry's place: local header, content, and the sizes behind it if there are any.
fn span(bytes: &[u8], entry: &Entry) -> Option<Range<usize>> {
    let data = data(bytes, entry)?;
    Some(entry.header..data.end + descriptor(bytes, entry, data.end).map_or(0, |d| d.length()))
}

/// How the sizes behind an entry's content are written.
#[derive(Clone, Copy)]
struct Descriptor {
    signed: bool,
    wide: bool,
}

impl Descriptor {
    fn length(self) -> usize {
        4 + if self.signed { 4 } else { 0 } + if self.wide { 16 } else { 8 }
    }

    fn write(self, checksum: u32, packed: u64, unpacked: u64) -> Option<Vec<u8>> {
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
fn descriptor(bytes: &[u8], entry: &Entry, at: usize) -> Option<Descriptor> {
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
fn mark_alone(bytes: &[u8], entries: &mut [Entry], directory: usize) {
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

fn checksum(bytes: &[u8]) -> u32 {
    let mut sum = Crc::new();
    sum.update(bytes);
    sum.sum()
}

/// Unpacks at most one byte more than `most`; `None` when the data are damaged.
fn inflate(data: &[u8], most: u64) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    DeflateDecoder::new(data).take(most.saturating_add(1)).read_to_end(&mut out).ok()?;
    Some(out)
}

fn deflate(content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(content);
    debug_assert!(written.is_ok(), "a Vec takes all that is written to it");
    encoder.finish().unwrap_or_default()
}

/// The first day that the format knows, for archives that are the same whenever they are written.
const DAY: u16 = 1 << 5 | 1;

/// A new archive; `None` when it would be too large.
pub(super) fn build(parts: &[(&str, Vec<u8>)]) -> Option<Vec<u8>> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in parts {
        let start = u32::try_from(out.len()).ok()?;
        let packed = deflate(content);
        let header = shared_header(name, content, packed.len())?;
        out.extend_from_slice(LOCAL);
        out.extend_from_slice(&header);
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(&packed);
        directory.extend_from_slice(CENTRAL);
        directory.extend_from_slice(&20_u16.to_le_bytes());
        directory.extend_from_slice(&header);
        // No comment, first volume, no attributes.
        directory.extend_from_slice(&[0; 10]);
        directory.extend_from_slice(&start.to_le_bytes());
        directory.extend_from_slice(name.as_bytes());
    }
    let (start, size) = (u32::try_from(out.len()).ok()?, u32::try_from(directory.len()).ok()?);
    let count = u16::try_from(parts.len()).ok()?.to_le_bytes();
    out.extend(directory);
    out.extend_from_slice(END);
    out.extend_from_slice(&[0; 4]);
    out.extend_from_slice(&[count, count].concat());
    out.extend_from_slice(&size.to_le_bytes());
    out.extend_from_slice(&start.to_le_bytes());
    out.extend_from_slice(&[0; 2]);
    Some(out)
}

/// What a local header and one in the directory have in common.
fn shared_header(name: &str, content: &[u8], packed: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    // Version needed, flags, method, time, day.
    for field in [20, 0, DEFLATED, 0, DAY] {
        out.extend_from_slice(&field.to_le_bytes());
    }
    for field in [checksum(content), u32::try_from(packed).ok()?, u32::try_from(content.len()).ok()?] {
        out.extend_from_slice(&field.to_le_bytes());
    }
    out.extend_from_slice(&u16::try_from(name.len()).ok()?.to_le_bytes());
    out.extend_from_slice(&[0; 2]);
    Some(out)
}
