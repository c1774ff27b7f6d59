//! Accessors: where each element of geometry stands among the bytes of the buffers.
//!
//! Everything a file claims is checked here, before anything is reserved for it.

use std::cell::Cell;

use super::buffers::Buffers;
use super::json::{Accessor, BufferView, Root, Shape, Sparse};
use super::malformed;
use crate::error::ParseError;

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
    fn of(code: u32) -> Option<Self> {
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
    base: Option<Run>,
    /// Elements that stand elsewhere, in ascending order, and where.
    sparse: Vec<(u32, usize)>,
    sparse_store: usize,
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

    /// Whether elements exist that are not stored.
    pub(super) fn has_gaps(&self) -> bool {
        self.base.is_none()
    }

    /// The run, when it is without holes and the accessor is nothing else.
    fn run(&self) -> Option<Run> {
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

    /// Whether a stored number fits its type.
    pub(super) fn fits(&self, raw: f64) -> bool {
        match self.component.bounds() {
            Some((least, largest)) => (least..=largest).contains(&raw),
            None => raw.is_finite(),
        }
    }
}

/// A buffer view that was found sound.
struct View {
    store: usize,
    start: u64,
    length: u64,
    stride: Option<u64>,
}

/// The accessors of a file, over its buffers.
pub(super) struct Accessors<'a> {
    root: &'a Root<'a>,
    buffers: &'a Buffers<'a>,
    /// How many sparse elements may still be listed: many accessors may share their bytes.
    sparse_left: Cell<u64>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(root: &'a Root<'a>, buffers: &'a Buffers<'a>) -> Self {
        let bytes: usize = buffers.lengths().iter().sum();
        Self { root, buffers, sparse_left: Cell::new(bytes as u64) }
    }

    pub(super) fn bytes(&self, store: usize) -> &'a [u8] {
        self.buffers.bytes(store)
    }

    /// How many bytes every store has.
    pub(super) fn lengths(&self) -> Vec<usize> {
        self.buffers.lengths()
    }

    /// Finds the elements of an accessor.
    pub(super) fn elements(&self, index: u32) -> Result<Elements, ParseError> {
        let accessor = get(self.root, index)?;
        let wrong = |problem: &str| malformed("accessor", index as usize, problem);
        let component = Component::of(accessor.component_type)
            .ok_or_else(|| wrong("its component type is none of glTF"))?;
        if accessor.shape == Shape::Unknown {
            return Err(wrong("its type is none of glTF"));
        }
        let count = usize::try_from(accessor.count).map_err(|_| wrong("its count is too large"))?;
        let mut elements = Elements {
            component,
            normalized: accessor.normalized && component.bounds().is_some(),
            shape: accessor.shape,
            count,
            base: None,
            sparse: Vec::new(),
            sparse_store: 0,
        };
        if let Some(view) = accessor.buffer_view {
            elements.base = Some(self.run(index, view, accessor.byte_offset, &elements)?);
        }
        if let Some(sparse) = &accessor.sparse {
            self.add_sparse(index, sparse, &mut elements)?;
        }
        Ok(elements)
    }

    fn run(&self, index: u32, view: u32, offset: u64, elements: &Elements) -> Result<Run, ParseError> {
        let view = self.view(view)?;
        let size = elements.size() as u64;
        // Zero is not allowed but written, and means the same as none.
        let stride = view.stride.filter(|s| *s != 0).unwrap_or(size);
        let offset = within(index, &view, offset, stride, size, elements.count as u64)?;
        let stride = usize::try_from(stride).unwrap_or(usize::MAX);
        // With one element or none there is no distance, whatever the file says.
        let stride = if elements.count <= 1 { elements.size() } else { stride };
        Ok(Run { store: view.store, offset, stride })
    }

    fn add_sparse(&self, index: u32, sparse: &Sparse, elements: &mut Elements) -> Result<(), ParseError> {
        let wrong = |problem: &str| malformed("accessor", index as usize, problem);
        let kind = Component::of(sparse.indices.component_type)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| wrong("its sparse indices are of a wrong type"))?;
        if sparse.count > elements.count as u64 {
            return Err(wrong("it has more sparse elements than elements"));
        }
        let (step, size) = (kind.size(), elements.size());
        let places = self.view(sparse.indices.buffer_view)?;
        let values = self.view(sparse.values.buffer_view)?;
        let from =
            within(index, &places, sparse.indices.byte_offset, step as u64, step as u64, sparse.count)?;
        let to = within(index, &values, sparse.values.byte_offset, size as u64, size as u64, sparse.count)?;
        let left = self.sparse_left.get().checked_sub(sparse.count).ok_or_else(again_and_again)?;
        self.sparse_left.set(left);
        let bytes = self.bytes(places.store);
        let count = usize::try_from(sparse.count).unwrap_or(0);
        elements.sparse.reserve_exact(count);
        for i in 0..count {
            // Whole and not larger than the type, so nothing is lost.
            let element = kind.get(bytes.get(from + i * step..).unwrap_or_default()) as u32;
            let ascends = elements.sparse.last().is_none_or(|(last, _)| *last < element);
            if !ascends || element as usize >= elements.count {
                return Err(wrong("its sparse indices do not ascend or are out of range"));
            }
            elements.sparse.push((element, to + i * size));
        }
        elements.sparse_store = values.store;
        Ok(())
    }

    fn view(&self, index: u32) -> Result<View, ParseError> {
        let wrong = |problem: &str| malformed("buffer view", index as usize, problem);
        let view = view_of(self.root, index)?;
        let store = self.buffers.store(view.buffer).ok_or_else(|| wrong("its buffer was not loaded"))?;
        let buffer = self.root.buffers.get(view.buffer as usize).map_or(0, |b| b.byte_length);
        let end = view.byte_offset.checked_add(view.byte_length);
        if end.is_none_or(|end| end > buffer) {
            return Err(ParseError::Overclaimed {
                element: format!("byte of buffer view {index}"),
                count: view.byte_length,
                needed: end.unwrap_or(u64::MAX),
                available: buffer,
            });
        }
        Ok(View { store, start: view.byte_offset, length: view.byte_length, stride: view.byte_stride })
    }

    /// Every stretch of loaded bytes that an accessor refers to; `None` when it is unsound.
    pub(super) fn stretches(&self, index: u32) -> Option<Vec<(Holds, Stretch)>> {
        let accessor = get(self.root, index).ok()?;
        let component = Component::of(accessor.component_type)?;
        let size = (component.size() * usize::from(accessor.shape.width())) as u64;
        let mut found = Vec::new();
        let mut add = |kind: Holds, view: u32, offset, size: u64, count| {
            let Ok(view) = self.view(view) else { return };
            let stride = view.stride.filter(|s| kind == Holds::Base && *s != 0).unwrap_or(size);
            if let Ok(start) = within(index, &view, offset, stride, size, count) {
                let [size, stride, count] =
                    [size, stride, count].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
                found.push((kind, Stretch { store: view.store, start, size, stride, count }));
            }
        };
        if let Some(view) = accessor.buffer_view {
            add(Holds::Base, view, accessor.byte_offset, size, accessor.count);
        }
        if let Some(sparse) = &accessor.sparse {
            let step = Component::of(sparse.indices.component_type).map_or(1, Component::size) as u64;
            let (places, values) = (&sparse.indices, &sparse.values);
            add(Holds::Places, places.buffer_view, places.byte_offset, step, sparse.count);
            add(Holds::Values, values.buffer_view, values.byte_offset, size, sparse.count);
        }
        Some(found)
    }

    /// The bytes of a whole buffer view, if they were loaded.
    pub(super) fn whole_view(&self, index: u32) -> Option<Stretch> {
        let view = self.view(index).ok()?;
        let size = usize::try_from(view.length).ok()?;
        Some(Stretch {
            store: view.store,
            start: usize::try_from(view.start).ok()?,
            size,
            stride: size,
            count: 1,
        })
    }
}

/// What an accessor keeps in a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Holds {
    /// Its elements.
    Base,
    /// Which of them are sparse.
    Places,
    /// Its sparse elements.
    Values,
}

/// Equal pieces of a store at equal distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Stretch {
    pub(super) store: usize,
    pub(super) start: usize,
    pub(super) size: usize,
    pub(super) stride: usize,
    pub(super) count: usize,
}

/// An accessor by its number.
pub(super) fn get<'a>(root: &'a Root<'_>, index: u32) -> Result<&'a Accessor<'a>, ParseError> {
    let missing = || malformed("accessor", index as usize, "there is no such accessor");
    root.accessors.get(index as usize).ok_or_else(missing)
}

/// A buffer view by its number, which must not be compressed.
fn view_of<'a>(root: &'a Root<'_>, index: u32) -> Result<&'a BufferView, ParseError> {
    let missing = || malformed("buffer view", index as usize, "there is no such buffer view");
    let view = root.buffer_views.get(index as usize).ok_or_else(missing)?;
    if view.extensions.ext_meshopt.is_some() {
        return Err(super::compressed("EXT_meshopt_compression"));
    }
    if view.extensions.khr_meshopt.is_some() {
        return Err(super::compressed("KHR_meshopt_compression"));
    }
    Ok(view)
}

/// The buffers that an accessor needs.
pub(super) fn buffers_of(root: &Root<'_>, accessor: u32) -> Result<Vec<u32>, ParseError> {
    let accessor = get(root, accessor)?;
    let sparse = accessor.sparse.iter().flat_map(|s| [s.indices.buffer_view, s.values.buffer_view]);
    accessor.buffer_view.into_iter().chain(sparse).map(|view| Ok(view_of(root, view)?.buffer)).collect()
}

/// Where elements begin in the store, if all of them are inside the view.
fn within(
    accessor: u32,
    view: &View,
    offset: u64,
    stride: u64,
    size: u64,
    count: u64,
) -> Result<usize, ParseError> {
    // As wide as to hold any product of two claims.
    let [wide_stride, wide_size, wide_count] = [stride, size, count].map(u128::from);
    let span = if count == 0 { 0 } else { wide_stride * (wide_count - 1) + wide_size };
    let needed = u128::from(offset) + span;
    if needed > u128::from(view.length) {
        return Err(ParseError::Overclaimed {
            element: format!("element of accessor {accessor}"),
            count,
            needed: u64::try_from(needed).unwrap_or(u64::MAX),
            available: view.length,
        });
    }
    usize::try_from(view.start + offset)
        .map_err(|_| malformed("accessor", accessor as usize, "its offset is too large"))
}

/// The refusal of a file whose accessors cover the same bytes many times over, so that it unpacks to far more
/// than it is.
pub(super) fn again_and_again() -> ParseError {
    ParseError::Unsupported {
        what: "a glTF that uses the same bytes of its buffers again and again".into(),
        cure: "export the model again with data of their own for each part",
    }
}

/// Bytes that are taken.
#[derive(Debug)]
pub(super) struct Claims {
    /// A bit for each byte of each store.
    bits: Vec<Vec<u64>>,
}

impl Claims {
    /// Nothing is taken yet.
    pub(super) fn new(lengths: &[usize]) -> Self {
        Self { bits: lengths.iter().map(|length| vec![0; length.div_ceil(64)]).collect() }
    }

    /// Takes some bytes; `false` when some of them were taken before.
    pub(super) fn take(&mut self, store: usize, start: usize, size: usize) -> bool {
        let Some(bits) = self.bits.get_mut(store) else { return size == 0 };
        let mut free = true;
        for (word, mask) in masks(start, size) {
            if let Some(word) = bits.get_mut(word) {
                free &= *word & mask == 0;
                *word |= mask;
            }
        }
        free
    }

    /// Takes every stored element; `false` when some of their bytes were taken before.
    pub(super) fn take_all(&mut self, elements: &Elements) -> bool {
        let size = elements.size();
        let indices: Box<dyn Iterator<Item = usize>> = if elements.has_gaps() {
            Box::new(elements.sparse.iter().map(|(element, _)| *element as usize))
        } else {
            Box::new(0..elements.count)
        };
        for element in indices {
            if let Some((store, offset)) = elements.slot(element)
                && !self.take(store, offset, size)
            {
                return false;
            }
        }
        true
    }

    fn touches(&self, store: usize, start: usize, size: usize) -> bool {
        let Some(bits) = self.bits.get(store) else { return false };
        masks(start, size).any(|(word, mask)| bits.get(word).is_some_and(|word| word & mask != 0))
    }

    /// Whether some of these bytes are taken. What it costs to look is taken off `budget`; `None` when that is
    /// used up.
    pub(super) fn meets(&self, stretch: &Stretch, budget: &mut u64) -> Option<bool> {
        let Stretch { store, start, size, stride, count } = *stretch;
        // Pieces without gaps are looked at as one.
        let (size, stride, count) =
            if size == stride { (size * count, 0, count.min(1)) } else { (size, stride, count) };
        *budget = budget.checked_sub((count as u64) * (1 + size as u64 / 64))?;
        Some((0..count).any(|i| self.touches(store, start + i * stride, size)))
    }
}

/// The words of a bit set that a range of bits is in, and which bits of each.
fn masks(start: usize, size: usize) -> impl Iterator<Item = (usize, u64)> {
    let end = start + size;
    let words = if size == 0 { 0..0 } else { start / 64..end.div_ceil(64) };
    words.map(move |word| {
        let low = start.saturating_sub(word * 64);
        let high = (end - word * 64).min(64);
        (word, (u64::MAX >> (64 - (high - low))) << low)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_taken_once() {
        let mut claims = Claims::new(&[200, 10]);
        assert!(claims.take(0, 60, 10));
        assert!(claims.take(0, 70, 130));
        assert!(claims.take(1, 0, 10));
        assert!(claims.take(0, 0, 60));
        assert!(!claims.take(0, 128, 1));
    }

    #[test]
    fn every_byte_of_a_range_counts() {
        for (start, size) in [(0, 1), (63, 1), (63, 2), (64, 64), (1, 190), (191, 9)] {
            let mut claims = Claims::new(&[200]);
            assert!(claims.take(0, start, size));
            for byte in 0..200 {
                let inside = (start..start + size).contains(&byte);
                assert_eq!(claims.touches(0, byte, 1), inside, "{start} {size} {byte}");
            }
        }
    }

    #[test]
    fn looking_has_a_price() {
        let claims = Claims::new(&[100]);
        let stretch = Stretch { store: 0, start: 0, size: 2, stride: 4, count: 20 };
        let mut budget = 25;
        assert_eq!(claims.meets(&stretch, &mut budget), Some(false));
        assert_eq!(claims.meets(&stretch, &mut budget), None);
    }
}
