//! Accessors: where each element of geometry stands among the bytes of the buffers.
//!
//! Everything a file claims is checked here, before anything is reserved for it.

use std::cell::Cell;
use std::collections::HashMap;

use super::buffers::Buffers;
use super::claims::Stretch;
use super::elements::{Component, Elements, Run};
use super::error::{again_and_again, malformed};
use super::json::{Accessor, BufferView, Root, Shape, Sparse};
use crate::error::ParseError;

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
    /// The accessors that stand in Draco streams.
    decoded: &'a HashMap<u32, Elements>,
    /// How many sparse elements may still be listed: many accessors may share their bytes.
    sparse_left: Cell<u64>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(
        root: &'a Root<'a>,
        buffers: &'a Buffers<'a>,
        decoded: &'a HashMap<u32, Elements>,
    ) -> Self {
        let bytes: usize = buffers.lengths().iter().sum();
        Self { root, buffers, decoded, sparse_left: Cell::new(bytes as u64) }
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
        if let Some(elements) = self.decoded.get(&index) {
            return Ok(elements.clone());
        }
        let accessor = get(self.root, index)?;
        let mut elements = claimed(accessor, index)?;
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
        if let Some(store) = self.buffers.packed(index) {
            return Ok(View { store, start: 0, length: view.byte_length, stride: view.byte_stride });
        }
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

/// The elements that an accessor is said to have, none of which stands anywhere yet.
pub(super) fn claimed(accessor: &Accessor<'_>, index: u32) -> Result<Elements, ParseError> {
    let wrong = |problem: &str| malformed("accessor", index as usize, problem);
    let component =
        Component::of(accessor.component_type).ok_or_else(|| wrong("its component type is none of glTF"))?;
    if accessor.shape == Shape::Unknown {
        return Err(wrong("its type is none of glTF"));
    }
    Ok(Elements {
        component,
        normalized: accessor.normalized && component.bounds().is_some(),
        shape: accessor.shape,
        count: usize::try_from(accessor.count).map_err(|_| wrong("its count is too large"))?,
        base: None,
        sparse: Vec::new(),
        sparse_store: 0,
    })
}

/// An accessor by its number.
pub(super) fn get<'a>(root: &'a Root<'_>, index: u32) -> Result<&'a Accessor<'a>, ParseError> {
    let missing = || malformed("accessor", index as usize, "there is no such accessor");
    root.accessors.get(index as usize).ok_or_else(missing)
}

/// A buffer view by its number.
pub(super) fn view_of<'a>(root: &'a Root<'_>, index: u32) -> Result<&'a BufferView, ParseError> {
    let missing = || malformed("buffer view", index as usize, "there is no such buffer view");
    root.buffer_views.get(index as usize).ok_or_else(missing)
}

/// The buffer views that an accessor needs.
pub(super) fn views_of(root: &Root<'_>, accessor: u32) -> Result<impl Iterator<Item = u32>, ParseError> {
    let accessor = get(root, accessor)?;
    let sparse = accessor.sparse.iter().flat_map(|s| [s.indices.buffer_view, s.values.buffer_view]);
    Ok(accessor.buffer_view.into_iter().chain(sparse))
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
