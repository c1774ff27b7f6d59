//! Elements of any kind: blocks of at most 256, in each of which every byte of the elements stands apart, as what it differs by
//! from the same byte before.
//!
//! Behind the blocks stand zeros up to a least length, the element that the first one differs from, and in version 1 a byte for
//! each channel that says how elements differ.

use super::Cursor;
use super::channels::{Channel, Deltas, WIDTH, differences, restore};
use super::groups::{self, FINE, GROUP, PLAIN};

/// The first byte of a stream, and with it what may be in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    Zero,
    One,
}

impl Version {
    fn of(stream: &[u8]) -> Option<Self> {
        match stream.first()? {
            0xa0 => Some(Self::Zero),
            0xa1 => Some(Self::One),
            _ => None,
        }
    }

    fn header(self) -> u8 {
        match self {
            Self::Zero => 0xa0,
            Self::One => 0xa1,
        }
    }

    /// How many channels have a mode of their own.
    fn modes(self, stride: usize) -> usize {
        match self {
            Self::Zero => 0,
            Self::One => stride / WIDTH,
        }
    }

    /// How long the tail is.
    fn tail(self, stride: usize) -> usize {
        let least = match self {
            Self::Zero => 32,
            Self::One => 24,
        };
        (stride + self.modes(stride)).max(least)
    }
}

/// Elements of a block.
fn block_length(stride: usize) -> usize {
    ((8192 / stride) & !(GROUP - 1)).min(256)
}

/// How each byte of the elements of a block is stored in version 1.
const NOTHING: u8 = 2;
const LITERAL: u8 = 3;

/// Reads `count` elements of `stride` bytes, at least one, a multiple of four up to 256 each; `None` when the stream is damaged.
pub(super) fn decode(stream: &[u8], stride: usize, count: usize) -> Option<Vec<u8>> {
    let version = Version::of(stream)?;
    let (body, tail) = stream.split_at_checked(stream.len().checked_sub(version.tail(stride))?)?;
    let mut cursor = Cursor(body.get(1..)?);
    let (tail, modes) = tail.split_at_checked(tail.len().checked_sub(version.modes(stride))?)?;
    let mut before = tail.get(tail.len().checked_sub(stride)?..)?.to_vec();
    let mut channels = vec![Channel::Bytes; stride / WIDTH];
    for (channel, mode) in channels.iter_mut().zip(modes) {
        *channel = Channel::of(*mode)?;
    }
    let mut out = vec![0; count.checked_mul(stride)?];
    for block in out.chunks_mut(block_length(stride) * stride) {
        let controls = cursor.take(version.modes(stride))?;
        let groups = (block.len() / stride).div_ceil(GROUP);
        for (at, channel) in channels.iter().enumerate() {
            let mut deltas: Deltas = std::array::from_fn(|_| vec![[0; GROUP]; groups]);
            for (byte, groups) in deltas.iter_mut().enumerate() {
                let control = controls.get(at).map(|control| control >> (2 * byte) & 3);
                read_byte(&mut cursor, control, block.len() / stride, groups)?;
            }
            let before = before.get_mut(at * WIDTH..)?.first_chunk_mut()?;
            restore(*channel, &deltas, before, block.get_mut(at * WIDTH..)?, stride);
        }
    }
    cursor.0.is_empty().then_some(out)
}

/// Reads one byte of all elements of a block. Version 0 has no `control`.
fn read_byte(
    cursor: &mut Cursor<'_>,
    control: Option<u8>,
    elements: usize,
    out: &mut [[u8; GROUP]],
) -> Option<()> {
    match control {
        None => groups::decode(cursor, &PLAIN, out),
        Some(NOTHING) => Some(()),
        Some(LITERAL) => {
            let literal = cursor.take(elements)?;
            for (group, chunk) in out.iter_mut().zip(literal.chunks(GROUP)) {
                group.iter_mut().zip(chunk).for_each(|(delta, byte)| *delta = *byte);
            }
            Some(())
        }
        Some(fine) => groups::decode(cursor, FINE.get(usize::from(fine))?, out),
    }
}

/// The stream of elements of `stride` bytes each, in the version of the stream whose place it takes.
pub(in super::super) fn encode(elements: &[u8], stride: usize, like: &[u8]) -> Vec<u8> {
    let version = Version::of(like).unwrap_or(Version::Zero);
    let first = elements.get(..stride).unwrap_or_default();
    let columns = (0..stride / WIDTH).map(|channel| Column { elements, stride, at: channel * WIDTH });
    let columns: Vec<_> = columns.map(|column| column.best(version)).collect();
    let mut out = vec![version.header()];
    for block in 0..elements.len().div_ceil((block_length(stride) * stride).max(1)) {
        let parts = columns.iter().filter_map(|(_, blocks)| blocks.get(block));
        out.extend(parts.clone().map(|part| part.control).take(version.modes(stride)));
        parts.for_each(|part| out.extend_from_slice(&part.bytes));
    }
    let tail = stride + version.modes(stride);
    out.resize(out.len() + version.tail(stride) - tail, 0);
    out.extend_from_slice(first);
    out.extend(columns.iter().map(|(channel, _)| channel.byte()).take(version.modes(stride)));
    out
}

/// The same channel of all elements.
struct Column<'a> {
    elements: &'a [u8],
    stride: usize,
    at: usize,
}

/// A channel of a block as it is stored.
struct Part {
    /// Two bits for each of its bytes.
    control: u8,
    bytes: Vec<u8>,
}

impl Column<'_> {
    /// The way to tell elements apart that takes the least room.
    fn best(&self, version: Version) -> (Channel, Vec<Part>) {
        let plain = (Channel::Bytes, self.parts(Channel::Bytes, version));
        let others: &[Channel] = match version {
            Version::Zero => &[],
            Version::One => &[Channel::Pairs, Channel::Bits(0)],
        };
        let size = |parts: &[Part]| parts.iter().map(|part| part.bytes.len()).sum::<usize>();
        others.iter().fold(plain, |best, &channel| {
            let parts = self.parts(channel, version);
            if size(&parts) < size(&best.1) { (channel, parts) } else { best }
        })
    }

    fn parts(&self, channel: Channel, version: Version) -> Vec<Part> {
        let column = self.elements.get(self.at..).unwrap_or_default();
        // The first element differs from itself by nothing.
        let mut before = column.first_chunk().copied().unwrap_or_default();
        let blocks = column.chunks(block_length(self.stride) * self.stride);
        blocks
            .map(|block| {
                let elements = block.chunks(self.stride).len();
                part(&differences(channel, &mut before, block, self.stride), elements, version)
            })
            .collect()
    }
}

fn part(deltas: &Deltas, elements: usize, version: Version) -> Part {
    let mut part = Part { control: 0, bytes: Vec::new() };
    for (at, groups) in deltas.iter().enumerate() {
        match version {
            Version::Zero => groups::encode(groups, &PLAIN, &mut part.bytes),
            Version::One => {
                let (control, bytes) = smallest(groups, elements);
                part.control |= control << (2 * at);
                part.bytes.extend(bytes);
            }
        }
    }
    part
}

/// One byte of all elements of a block as version 1 stores it in the least room.
fn smallest(groups: &[[u8; GROUP]], elements: usize) -> (u8, Vec<u8>) {
    if groups.iter().flatten().all(|delta| *delta == 0) {
        return (NOTHING, Vec::new());
    }
    let literal = (LITERAL, groups.iter().flatten().copied().take(elements).collect::<Vec<u8>>());
    FINE.iter().zip(0..).fold(literal, |best, (widths, control)| {
        let mut bytes = Vec::new();
        // What is not nothing has a width of at most four bits only if it has sentinels.
        groups::encode(groups, widths, &mut bytes);
        if bytes.len() < best.1.len() { (control, bytes) } else { best }
    })
}
