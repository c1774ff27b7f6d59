//! Four bytes of every element, and how each differs from those of the element before.

use super::groups::GROUP;

/// Bytes of a channel.
pub(super) const WIDTH: usize = 4;

/// How elements are told from those before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Channel {
    /// Byte by byte, with the sign in the lowest bit.
    Bytes,
    /// Likewise as two numbers of 16 bits.
    Pairs,
    /// Which of the 32 bits differ, turned left by some.
    Bits(u32),
}

impl Channel {
    /// From the byte that stands for it.
    pub(super) fn of(byte: u8) -> Option<Self> {
        match (byte & 15, byte >> 4) {
            (0, 0) => Some(Self::Bytes),
            (1, 0) => Some(Self::Pairs),
            (2, turn) => Some(Self::Bits(turn.into())),
            _ => None,
        }
    }

    /// The byte that stands for it.
    pub(super) fn byte(self) -> u8 {
        match self {
            Self::Bytes => 0,
            Self::Pairs => 1,
            Self::Bits(turn) => 2 | (turn as u8) << 4,
        }
    }

    /// What comes after `before`.
    fn after(self, before: [u8; WIDTH], delta: [u8; WIDTH]) -> [u8; WIDTH] {
        match self {
            Self::Bytes => std::array::from_fn(|i| {
                let step = if delta[i] & 1 == 0 { delta[i] >> 1 } else { !(delta[i] >> 1) };
                before[i].wrapping_add(step)
            }),
            Self::Pairs => halves(before, delta, |before, delta| {
                let step = if delta & 1 == 0 { delta >> 1 } else { !(delta >> 1) };
                before.wrapping_add(step)
            }),
            Self::Bits(turn) => {
                let [before, delta] = [before, delta].map(u32::from_le_bytes);
                (before ^ delta.rotate_right(turn)).to_le_bytes()
            }
        }
    }

    /// What takes `before` to `after`.
    fn delta(self, before: [u8; WIDTH], after: [u8; WIDTH]) -> [u8; WIDTH] {
        match self {
            Self::Bytes => std::array::from_fn(|i| {
                let step = after[i].wrapping_sub(before[i]);
                if step < 0x80 { step << 1 } else { !(step << 1) }
            }),
            Self::Pairs => halves(before, after, |before, after| {
                let step = after.wrapping_sub(before);
                if step < 0x8000 { step << 1 } else { !(step << 1) }
            }),
            Self::Bits(turn) => {
                let [before, after] = [before, after].map(u32::from_le_bytes);
                (before ^ after).rotate_left(turn).to_le_bytes()
            }
        }
    }
}

fn halves(a: [u8; WIDTH], b: [u8; WIDTH], of: impl Fn(u16, u16) -> u16) -> [u8; WIDTH] {
    let [p, q, r, s] = a;
    let [t, u, v, w] = b;
    let [low, high] = [([p, q], [t, u]), ([r, s], [v, w])]
        .map(|(a, b)| of(u16::from_le_bytes(a), u16::from_le_bytes(b)).to_le_bytes());
    [low[0], low[1], high[0], high[1]]
}

/// The deltas of a channel: for each of its bytes those of all elements of a block.
pub(super) type Deltas = [Vec<[u8; GROUP]>; WIDTH];

/// Turns deltas into elements. `column` are the channel's bytes of a block, `stride` apart, `before` those of the element before.
pub(super) fn restore(
    channel: Channel,
    deltas: &Deltas,
    before: &mut [u8; WIDTH],
    column: &mut [u8],
    stride: usize,
) {
    for (at, element) in column.chunks_mut(stride).enumerate() {
        let delta = deltas.each_ref().map(|byte| byte[at / GROUP][at % GROUP]);
        *before = channel.after(*before, delta);
        for (byte, new) in element.iter_mut().zip(*before) {
            *byte = new;
        }
    }
}

/// The deltas of a channel's bytes of a block; those beyond the last element are zero.
pub(super) fn differences(
    channel: Channel,
    before: &mut [u8; WIDTH],
    column: &[u8],
    stride: usize,
) -> Deltas {
    let groups = column.chunks(stride).len().div_ceil(GROUP);
    let mut deltas: Deltas = std::array::from_fn(|_| vec![[0; GROUP]; groups]);
    for (at, element) in column.chunks(stride).enumerate() {
        let after: [u8; WIDTH] = element.first_chunk().copied().unwrap_or_default();
        let delta = channel.delta(*before, after);
        for (byte, delta) in deltas.iter_mut().zip(delta) {
            byte[at / GROUP][at % GROUP] = delta;
        }
        *before = after;
    }
    deltas
}
