//! Which meshes of a file are read, and which buffers that takes.

use std::collections::{BTreeSet, HashSet};

use super::accessor::{view_of, views_of};
use super::json::Root;
use super::scene::Shown;
use crate::error::ParseError;
use crate::notes;

/// What holds geometry of the meshes that are shown.
#[derive(Debug, Default)]
pub(super) struct Needed {
    /// Buffers.
    pub(super) buffers: BTreeSet<u32>,
    /// Compressed buffer views.
    pub(super) packed: BTreeSet<u32>,
    /// Buffers that hold the same as compressed buffer views, for those who cannot read these; they may be missing.
    pub(super) plain: BTreeSet<u32>,
}

impl Needed {
    fn accessor(&mut self, root: &Root<'_>, accessor: u32) -> Result<(), ParseError> {
        views_of(root, accessor)?.try_for_each(|view| self.view(root, view))
    }

    fn view(&mut self, root: &Root<'_>, index: u32) -> Result<(), ParseError> {
        let view = view_of(root, index)?;
        match &view.extensions.packed {
            Some(packed) => {
                self.packed.insert(index);
                self.plain.insert(view.buffer);
                self.buffers.insert(packed.buffer);
            }
            None => {
                self.buffers.insert(view.buffer);
            }
        }
        Ok(())
    }
}

/// What is needed to read the meshes that are shown.
pub(super) fn needed(root: &Root<'_>, shown: &[Shown]) -> Result<Needed, ParseError> {
    let placed = shown.iter().filter(|s| s.placement.is_some());
    let meshes: BTreeSet<usize> = placed.map(|s| s.mesh).collect();
    let mut needed = Needed::default();
    for Shown { bind, instances, .. } in shown {
        let copies = instances.map(|a| [a.translation, a.rotation, a.scale]).into_iter().flatten();
        for accessor in copies.chain([*bind]).flatten() {
            needed.accessor(root, accessor)?;
        }
    }
    let primitives = meshes.iter().filter_map(|m| root.meshes.get(*m)).flat_map(|m| &m.primitives);
    let mut seen = HashSet::new();
    for primitive in primitives.filter(|p| p.is_surface()) {
        if let Some(draco) = &primitive.extensions.draco {
            draco.buffer_view.map_or(Ok(()), |view| needed.view(root, view))?;
            continue;
        }
        let vertices = &primitive.attributes;
        let accessors = [vertices.position, primitive.indices, vertices.normal, vertices.tangent];
        for accessor in accessors.into_iter().flatten().filter(|a| seen.insert(*a)) {
            needed.accessor(root, accessor)?;
        }
    }
    Ok(needed)
}

/// Sentences about the meshes that are not read.
pub(super) fn left_alone(root: &Root<'_>, shown: &[Shown]) -> Vec<String> {
    const UNSEEN: u8 = 0;
    const FLAT: u8 = 1;
    const READ: u8 = 2;
    let mut states = vec![UNSEEN; root.meshes.len()];
    for shown in shown {
        if let Some(state) = states.get_mut(shown.mesh) {
            *state = (*state).max(if shown.placement.is_some() { READ } else { FLAT });
        }
    }
    let of = |state: u8| states.iter().filter(|s| **s == state).count();
    let meshes = |count, which| notes::unmarked(count, ["mesh", "meshes"], which);
    let unseen = meshes(of(UNSEEN), "that no scene shows");
    let flat = meshes(of(FLAT), "that a node scales to nothing or beyond all numbers");
    unseen.into_iter().chain(flat).collect()
}
