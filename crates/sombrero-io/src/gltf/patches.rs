//! Bytes of buffers that get other content.

use super::buffers::Origin;
use super::elements::Elements;
use crate::parsed::Companion;

/// The stores, as far as they change.
pub(super) struct Patches<'a> {
    source: &'a [u8],
    origins: &'a [Origin],
    companions: &'a [Companion],
    changed: Vec<Option<Vec<u8>>>,
}

impl<'a> Patches<'a> {
    pub(super) fn new(source: &'a [u8], origins: &'a [Origin], companions: &'a [Companion]) -> Self {
        Self { source, origins, companions, changed: vec![None; origins.len()] }
    }

    /// A store as it was read.
    pub(super) fn old(&self, store: usize) -> &'a [u8] {
        self.origins.get(store).map_or(&[], |origin| origin.bytes(self.source, self.companions))
    }

    /// Whether a companion that was read holds geometry.
    pub(super) fn holds_geometry(&self, companion: usize) -> bool {
        self.companions.get(companion).is_some_and(|companion| companion.holds_geometry)
    }

    /// A store as it will be.
    pub(super) fn new_bytes(&self, store: usize) -> &[u8] {
        self.changed(store).unwrap_or_else(|| self.old(store))
    }

    /// A store as it will be, if it changes.
    pub(super) fn changed(&self, store: usize) -> Option<&[u8]> {
        self.changed.get(store).and_then(Option::as_deref)
    }

    /// A store to be changed; it may become longer. `None` when there is no such store.
    pub(super) fn change(&mut self, store: usize) -> Option<&mut Vec<u8>> {
        let old = self.old(store);
        Some(self.changed.get_mut(store)?.get_or_insert_with(|| old.to_vec()))
    }

    /// Writes the first three numbers of an element; `false` when it is not stored.
    pub(super) fn put(&mut self, elements: &Elements, element: usize, raw: [f64; 3]) -> bool {
        let Some((store, offset)) = elements.slot(element) else { return false };
        let Some(bytes) = self.change(store) else { return false };
        let size = elements.component.size();
        for (axis, value) in raw.into_iter().enumerate() {
            if let Some(place) = bytes.get_mut(offset + axis * size..) {
                elements.component.put(value, place);
            }
        }
        true
    }
}
