//! The headers of a ZIP archive: how they begin, how long they are, and the numbers in them.

use std::ops::Range;

pub(super) const LOCAL: &[u8] = b"PK\x03\x04";
pub(super) const CENTRAL: &[u8] = b"PK\x01\x02";
pub(super) const END: &[u8] = b"PK\x05\x06";
pub(super) const WIDE_END: &[u8] = b"PK\x06\x06";
pub(super) const LOCATOR: &[u8] = b"PK\x06\x07";
pub(super) const DESCRIPTOR: &[u8] = b"PK\x07\x08";

/// The lengths of the headers without names, extra fields and comments.
pub(super) const LOCAL_LENGTH: usize = 30;
pub(super) const CENTRAL_LENGTH: usize = 46;
pub(super) const END_LENGTH: usize = 22;
pub(super) const LOCATOR_LENGTH: usize = 20;
pub(super) const WIDE_END_LENGTH: usize = 56;

/// A field of a header: 32 bits wide, or 64 bits in the extra field that large archives have.
#[derive(Debug, Clone, Copy)]
pub(super) enum Slot {
    Narrow(usize),
    Wide(usize),
}

fn chunk<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    chunk(bytes, at).map(u16::from_le_bytes)
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    chunk(bytes, at).map(u32::from_le_bytes)
}

pub(super) fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    chunk(bytes, at).map(u64::from_le_bytes)
}

pub(super) fn length_at(bytes: &[u8], at: usize) -> Option<usize> {
    u16_at(bytes, at).map(usize::from)
}

pub(super) fn offset_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u64_at(bytes, at)?).ok()
}

pub(super) fn is_at(bytes: &[u8], at: usize, signature: &[u8]) -> bool {
    bytes.get(at..).is_some_and(|rest| rest.starts_with(signature))
}

pub(super) fn get(bytes: &[u8], slot: Slot) -> Option<u64> {
    match slot {
        Slot::Narrow(at) => u32_at(bytes, at).map(u64::from),
        Slot::Wide(at) => u64_at(bytes, at),
    }
}

/// `None` when the value does not fit.
pub(super) fn set(bytes: &mut [u8], slot: Slot, value: u64) -> Option<()> {
    match slot {
        Slot::Narrow(at) => {
            let value = u32::try_from(value).ok().filter(|&value| value != u32::MAX)?;
            bytes.get_mut(at..at.checked_add(4)?)?.copy_from_slice(&value.to_le_bytes());
        }
        Slot::Wide(at) => bytes.get_mut(at..at.checked_add(8)?)?.copy_from_slice(&value.to_le_bytes()),
    }
    Some(())
}

/// Unpacked size, packed size and offset of an entry in the directory.
pub(super) fn central_slots(bytes: &[u8], at: usize) -> Option<[Slot; 3]> {
    let extra = at + CENTRAL_LENGTH + length_at(bytes, at + 28)?;
    let end = extra + length_at(bytes, at + 30)?;
    slots(bytes, [at + 24, at + 20, at + 42], extra..end)
}

/// Unpacked and packed size in a local header.
pub(super) fn local_slots(bytes: &[u8], at: usize) -> Option<[Slot; 2]> {
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
