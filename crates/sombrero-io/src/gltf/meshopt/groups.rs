//! Sixteen byte deltas at a time: each as few bits, or all of them as bytes. A delta whose bits are all set stands, as a
//! byte, behind the others.

use super::Cursor;

/// Deltas of a group.
pub(super) const GROUP: usize = 16;

/// How wide the deltas of a group may be: which of four widths it is, two bits tell for each group.
pub(super) type Widths = [u8; 4];

/// Version 0.
pub(super) const PLAIN: Widths = [0, 2, 4, 8];
/// The two choices of version 1.
pub(super) const FINE: [Widths; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// Reads as many groups as `out` has, after the widths of all of them.
pub(super) fn decode(cursor: &mut Cursor<'_>, widths: &Widths, out: &mut [[u8; GROUP]]) -> Option<()> {
    let header = cursor.take(out.len().div_ceil(4))?;
    for (at, group) in out.iter_mut().enumerate() {
        let which = header.get(at / 4)? >> (2 * (at % 4)) & 3;
        *group = one(cursor, *widths.get(usize::from(which))?)?;
    }
    Some(())
}

fn one(cursor: &mut Cursor<'_>, width: u8) -> Option<[u8; GROUP]> {
    match width {
        0 => Some([0; GROUP]),
        8 => cursor.take(GROUP)?.first_chunk().copied(),
        _ => {
            let packed = cursor.take(2 * usize::from(width))?;
            let mut group = [0; GROUP];
            for (at, delta) in group.iter_mut().enumerate() {
                let (byte, shift) = place(at, width);
                *delta = packed.get(byte)? >> shift & all_set(width);
                if *delta == all_set(width) {
                    *delta = cursor.byte()?;
                }
            }
            Some(group)
        }
    }
}

/// Where a delta of less than eight bits stands: its byte, and how far from the low end. Single bits begin at the low end of
/// a byte, all others at the high end.
fn place(at: usize, width: u8) -> (usize, u8) {
    let each = usize::from(8 / width);
    let slot = (at % each) as u8;
    (at / each, if width == 1 { slot } else { 8 - width * (slot + 1) })
}

/// The delta that says that the real one follows.
fn all_set(width: u8) -> u8 {
    u8::MAX >> (8 - width)
}

/// Writes groups in the narrowest of `widths`.
pub(super) fn encode(groups: &[[u8; GROUP]], widths: &Widths, out: &mut Vec<u8>) {
    let header = out.len();
    out.resize(header + groups.len().div_ceil(4), 0);
    for (at, group) in groups.iter().enumerate() {
        let sizes = widths.map(|width| size(group, width));
        // The last width that can hold all of them is always there.
        let which = (0..4).min_by_key(|which| sizes[*which]).unwrap_or(3);
        if let Some(byte) = out.get_mut(header + at / 4) {
            *byte |= (which as u8) << (2 * (at % 4));
        }
        put(group, widths[which], out);
    }
}

/// How many bytes a group takes; no number of bytes when it cannot be so narrow.
fn size(group: &[u8; GROUP], width: u8) -> usize {
    match width {
        0 if group.iter().all(|delta| *delta == 0) => 0,
        0 => usize::MAX,
        8 => GROUP,
        _ => 2 * usize::from(width) + group.iter().filter(|delta| **delta >= all_set(width)).count(),
    }
}

fn put(group: &[u8; GROUP], width: u8, out: &mut Vec<u8>) {
    match width {
        0 => {}
        8 => out.extend_from_slice(group),
        _ => {
            let start = out.len();
            out.resize(start + 2 * usize::from(width), 0);
            for (at, delta) in group.iter().enumerate() {
                let (byte, shift) = place(at, width);
                if let Some(byte) = out.get_mut(start + byte) {
                    *byte |= (*delta).min(all_set(width)) << shift;
                }
            }
            out.extend(group.iter().filter(|delta| **delta >= all_set(width)));
        }
    }
}
