//! The elements of an accessor: their number type, and where each stands among the bytes of the buffers.

use super::json::Shape;
use crate::coordinate;
use crate::error::WriteError;

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The smallest and the largest whole number; `None` for floats.
    pub(super) fn bounds(self) -> Option<(f64, f64)> {
        match self {
            Self::I8 => Some((i8::MIN.into(), i8::MAX.into())),
            Self::U8 => Some((0.0, u8::MAX.into())),
            Self::I16 => Some((i16::MIN.into(), i16::MAX.into())),
            Self::U16 => Some((0.0, u16::MAX.into())),
            Self::U32 => Some((0.0, u32::MAX.into())),
            Self::F32 => None,
        }
    }

    /// The number that `bytes` begin with.
    pub(super) fn get(self, bytes: &[u8]) -> f64 {
        fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.first_chunk().copied().unwrap_or([0; N])
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes)).into(),
            Self::U8 => u8::from_le_bytes(first(bytes)).into(),
            Self::I16 => i16::from_le_bytes(first(bytes)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes)).into(),
            Self::F32 => f32::from_le_bytes(first(bytes)).into(),
        }
    }

    /// Writes a number that is known to fit at the front of `bytes`.
    pub(super) fn put(self, value: f64, bytes: &mut [u8]) {
        let all = match self {
            // Whole numbers: the conversion is exact, and the low bytes are those of the smaller types.
            Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::U32 => {
                (value as i64).to_le_bytes().first_chunk().copied().unwrap_or_default()
            }
            Self::F32 => (value as f32).to_le_bytes(),
        };
        for (slot, byte) in bytes.iter_mut().zip(&all[..self.size()]) {
            *slot = *byte;
        }
    }
}

/// How far beyond the range of its type a coordinate may go to be held at the end of it, in ranges.
const HELD: f64 = 0.02;

/// Elements at equal distances in one store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub(super) store: usize,
    pub(super) offset: usize,
    pub(super) stride: usize,
}

/// Where the elements of an accessor stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Elements {
    pub(super) component: Component,
    pub(super) normalized: bool,
    pub(super) shape: Shape,
    pub(super) count: usize,
    /// `None` if the elements are zero.
    pub(super) base: Option<Run>,
    /// Elements that stand elsewhere, in ascending order, and where.
    pub(super) sparse: Vec<(u32, usize)>,
    pub(super) sparse_store: usize,
}

/// What two accessors have in common that are one and the same in all but name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Key {
    Plain { run: Run, component: Component, normalized: bool, width: u8, count: usize },
    Own(u32),
}

impl Elements {
    /// Bytes of one element.
    pub(super) fn size(&self) -> usize {
        self.component.size() * usize::from(self.shape.width())
    }

    /// The store and the offset of an element, if it is stored.
    pub(super) fn slot(&self, element: usize) -> Option<(usize, usize)> {
        if !self.sparse.is_empty()
            && let Ok(element) = u32::try_from(element)
            && let Ok(found) = self.sparse.binary_search_by_key(&element, |(e, _)| *e)
        {
            return self.sparse.get(found).map(|(_, offset)| (self.sparse_store, *offset));
        }
        let run = self.base.filter(|_| element < self.count)?;
        Some((run.store, run.offset + element * run.stride))
    }

    /// The stores that elements stand in.
    pub(super) fn stores(&self) -> impl Iterator<Item = usize> + use<> {
        let sparse = (!self.sparse.is_empty()).then_some(self.sparse_store);
        self.base.map(|run| run.store).into_iter().chain(sparse)
    }

    /// Whether elements exist that are not stored.
    pub(super) fn has_gaps(&self) -> bool {
        self.base.is_none()
    }

    /// The run, when it is without holes and the accessor is nothing else.
    pub(super) fn run(&self) -> Option<Run> {
        self.base.filter(|_| self.sparse.is_empty())
    }

    /// What makes this accessor the same as another.
    pub(super) fn key(&self, accessor: u32) -> Key {
        let Self { component, normalized, count, .. } = *self;
        let width = self.shape.width();
        self.run().map_or(Key::Own(accessor), |run| Key::Plain { run, component, normalized, width, count })
    }

    /// The first three numbers of an element as they are stored.
    pub(super) fn raw(&self, bytes: &[u8], offset: usize) -> [f64; 3] {
        let size = self.component.size();
        std::array::from_fn(|axis| self.component.get(bytes.get(offset + axis * size..).unwrap_or_default()))
    }

    /// The number that a stored one stands for.
    pub(super) fn meaning(&self, raw: f64) -> f64 {
        match self.component.bounds().filter(|_| self.normalized) {
            Some((_, largest)) => (raw / largest).max(-1.0),
            None => raw,
        }
    }

    /// The number to store; not yet checked to fit.
    pub(super) fn spelling(&self, value: f64) -> f64 {
        match self.component.bounds() {
            Some((_, largest)) if self.normalized => (value * largest).round(),
            Some(_) => value.round(),
            None => f64::from(value as f32),
        }
    }

    /// The number to store for a coordinate of a vertex, unless it does not fit.
    pub(super) fn coordinate(&self, vertex: usize, value: f64) -> Result<f64, WriteError> {
        let Some((least, largest)) = self.component.bounds() else {
            return coordinate::narrow(vertex, value).map(f64::from);
        };
        let raw = self.spelling(value);
        // What goes a little beyond the end of the range is held there: grids often end at the box.
        let beyond = (least - raw).max(raw - largest);
        if beyond <= HELD * (largest - least) {
            Ok(raw.clamp(least, largest))
        } else {
            Err(WriteError::OffGrid { vertex, value })
        }
    }
}
