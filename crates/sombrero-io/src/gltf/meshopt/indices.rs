//! Indices of any kind: each differs by so much from the last of one of two sequences.

use super::{Cursor, unzigzag};

/// Reads `count` indices; `None` when the stream is damaged.
pub(super) fn decode(stream: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut cursor = Cursor(stream);
    if cursor.byte()? != 0xd1 {
        return None;
    }
    let mut data = Cursor(cursor.take(cursor.0.len().checked_sub(4)?)?);
    // Each takes a byte.
    if count > data.0.len() {
        return None;
    }
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let value = data.varint()?;
        let last = &mut last[(value & 1) as usize];
        *last = last.wrapping_add(unzigzag(value >> 1));
        out.push(*last);
    }
    data.0.is_empty().then_some(out)
}
