//! The number types of PLY.

use std::ops::Range;

/// A number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Understands both generations of type names.
    pub(super) fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a binary value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The binary value at `span`, exactly: every type fits into a 64-bit float.
    pub(super) fn decode<const BIG: bool>(self, bytes: &[u8], span: Range<usize>) -> Option<f64> {
        let bytes = bytes.get(span)?;
        Some(match self {
            Self::I8 => i8::from_le_bytes(ordered::<1, BIG>(bytes)?).into(),
            Self::U8 => u8::from_le_bytes(ordered::<1, BIG>(bytes)?).into(),
            Self::I16 => i16::from_le_bytes(ordered::<2, BIG>(bytes)?).into(),
            Self::U16 => u16::from_le_bytes(ordered::<2, BIG>(bytes)?).into(),
            Self::I32 => i32::from_le_bytes(ordered::<4, BIG>(bytes)?).into(),
            Self::U32 => u32::from_le_bytes(ordered::<4, BIG>(bytes)?).into(),
            Self::F32 => f32::from_le_bytes(ordered::<4, BIG>(bytes)?).into(),
            Self::F64 => f64::from_le_bytes(ordered::<8, BIG>(bytes)?),
        })
    }
}

/// The first `N` bytes, least significant first.
fn ordered<const N: usize, const BIG: bool>(bytes: &[u8]) -> Option<[u8; N]> {
    let mut bytes = *bytes.first_chunk::<N>()?;
    if BIG {
        bytes.reverse();
    }
    Some(bytes)
}
