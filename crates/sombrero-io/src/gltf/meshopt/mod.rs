//! The codec of `EXT_meshopt_compression` and `KHR_meshopt_compression`, after the bitstream that the appendices of these
//! extensions specify (Khronos Group, glTF extension registry).
//!
//! A stream is as long as the JSON says, and how many elements it holds stands there too. Three modes: [`attributes`], which
//! is also written here, [`triangles`] and [`indices`]. A [`Filter`] may come after the first.

mod attributes;
mod channels;
mod filters;
mod groups;
mod indices;
#[cfg(test)]
mod tests;
mod triangles;

pub(super) use attributes::encode;
use serde::Deserialize;

/// What a stream holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    /// Elements of any kind.
    Attributes,
    /// The corners of triangles.
    Triangles,
    /// Other indices.
    Indices,
    #[default]
    #[serde(other)]
    Unknown,
}

/// What becomes of attributes after they were unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    /// Directions.
    Octahedral,
    /// Rotations.
    Quaternion,
    /// Floats as mantissa and exponent.
    Exponential,
    /// Colours as brightness and two differences.
    Color,
    #[serde(other)]
    Unknown,
}

/// The layout of what a stream holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form {
    pub(super) mode: Mode,
    pub(super) filter: Filter,
    /// Bytes of an element.
    pub(super) stride: usize,
    pub(super) count: usize,
}

impl Form {
    /// Whether the extensions allow it.
    pub(super) fn is_sound(&self) -> bool {
        let Self { mode, filter, stride, count } = *self;
        let stride_fits = match mode {
            Mode::Attributes => (4..=256).contains(&stride) && stride.is_multiple_of(4),
            Mode::Triangles => matches!(stride, 2 | 4) && count.is_multiple_of(3),
            Mode::Indices => matches!(stride, 2 | 4),
            Mode::Unknown => false,
        };
        let filter_fits = match filter {
            Filter::None => true,
            Filter::Octahedral | Filter::Color => mode == Mode::Attributes && matches!(stride, 4 | 8),
            Filter::Quaternion => mode == Mode::Attributes && stride == 8,
            Filter::Exponential => mode == Mode::Attributes,
            Filter::Unknown => false,
        };
        stride_fits && filter_fits
    }
}

/// The elements of a stream, `stride` times `count` bytes; `None` when it is damaged. The caller bounds how much that is.
pub(super) fn decode(stream: &[u8], form: &Form) -> Option<Vec<u8>> {
    let Form { mode, filter, stride, count } = *form;
    if !form.is_sound() {
        return None;
    }
    if count == 0 {
        return Some(Vec::new());
    }
    let mut bytes = match mode {
        Mode::Attributes => attributes::decode(stream, stride, count)?,
        Mode::Triangles => narrowed(&triangles::decode(stream, count / 3)?, stride),
        Mode::Indices => narrowed(&indices::decode(stream, count)?, stride),
        Mode::Unknown => return None,
    };
    filters::undo(filter, stride, &mut bytes);
    Some(bytes)
}

/// Indices of two or four bytes.
fn narrowed(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}

/// What is left of a stream.
#[derive(Debug, Clone, Copy)]
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    /// A number of one to five bytes, seven bits in each, low ones first; a high bit says that more follow.
    fn varint(&mut self) -> Option<u32> {
        let mut value = 0_u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }
}

/// A signed number from one in which the lowest bit is the sign.
fn unzigzag(value: u32) -> u32 {
    if value & 1 == 0 { value >> 1 } else { !(value >> 1) }
}
