//! The corners of triangles: a byte for each triangle tells which recent edge it shares and where its third corner is from.

use super::{Cursor, unzigzag};

/// The last things that were pushed. The newest has the index 0.
struct Recent<T> {
    ring: [T; 16],
    pushed: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Self {
        Self { ring: [T::default(); 16], pushed: 0 }
    }

    fn push(&mut self, value: T) {
        self.ring[self.pushed % 16] = value;
        self.pushed += 1;
    }

    /// `None` when it was never pushed.
    fn get(&self, index: u8) -> Option<T> {
        let back = usize::from(index) + 1;
        (back <= 16.min(self.pushed)).then(|| self.ring[(self.pushed - back) % 16])
    }
}

/// What the decoder knows.
struct State<'a> {
    data: Cursor<'a>,
    /// The next index that was not used yet.
    next: u32,
    /// The last one that was spelled out.
    last: u32,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
}

/// Reads three corners for each of `count` triangles; `None` when the stream is damaged.
pub(super) fn decode(stream: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut cursor = Cursor(stream);
    if cursor.byte()? != 0xe1 {
        return None;
    }
    let codes = cursor.take(count)?;
    let data = cursor.take(cursor.0.len().checked_sub(16)?)?;
    let table: &[u8; 16] = cursor.0.first_chunk()?;
    let mut state =
        State { data: Cursor(data), next: 0, last: 0, edges: Recent::new(), vertices: Recent::new() };
    let mut out = Vec::with_capacity(3 * count);
    for &code in codes {
        let corners = if code < 0xf0 { state.on_edge(code)? } else { state.alone(code, table)? };
        out.extend(corners);
    }
    state.data.0.is_empty().then_some(out)
}

impl State<'_> {
    fn take_next(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    fn spelled(&mut self) -> Option<u32> {
        self.last = self.last.wrapping_add(unzigzag(self.data.varint()?));
        Some(self.last)
    }

    /// A triangle that shares a recent edge.
    fn on_edge(&mut self, code: u8) -> Option<[u32; 3]> {
        let [a, b] = self.edges.get(code >> 4)?;
        let (c, is_new) = match code & 15 {
            0 => (self.take_next(), true),
            recent @ 1..13 => (self.vertices.get(recent)?, false),
            15 => (self.spelled()?, true),
            neighbour => {
                let step = if neighbour == 13 { u32::MAX } else { 1 };
                self.last = self.last.wrapping_add(step);
                (self.last, true)
            }
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if is_new {
            self.vertices.push(c);
        }
        Some([a, b, c])
    }

    /// A triangle that shares nothing that is known.
    fn alone(&mut self, code: u8, table: &[u8; 16]) -> Option<[u32; 3]> {
        let index = code & 15;
        let (how, starts_anew) = match index {
            14 | 15 => {
                let how = self.data.byte()?;
                (how, how == 0)
            }
            _ => (table[usize::from(index)], false),
        };
        if starts_anew {
            self.next = 0;
        }
        let a = if index == 15 { self.spelled()? } else { self.take_next() };
        let (b, b_is_new) = self.corner(how >> 4)?;
        let (c, c_is_new) = self.corner(how & 15)?;
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        self.vertices.push(a);
        for (corner, is_new) in [(b, b_is_new), (c, c_is_new)] {
            if is_new {
                self.vertices.push(corner);
            }
        }
        Some([a, b, c])
    }

    /// A corner, and whether it is a new one.
    fn corner(&mut self, how: u8) -> Option<(u32, bool)> {
        match how {
            0 => Some((self.take_next(), true)),
            15 => Some((self.spelled()?, true)),
            recent => Some((self.vertices.get(recent - 1)?, false)),
        }
    }
}
