//! Which meshes of a file are read, and which buffers that takes.

use std::collections::{BTreeSet, HashSet};

use super::accessor::buffers_of;
use super::error::compressed;
use super::json::Root;
use super::scene::Shown;
use crate::error::ParseError;
use crate::notes;

/// The buffers that hold geometry of the meshes that are shown.
pub(super) fn needed_buffers(root: &Root<'_>, shown: &[Shown]) -> Result<BTreeSet<u32>, ParseError> {
    let placed = shown.iter().filter(|s| s.placement.is_some());
    let meshes: BTreeSet<usize> = placed.map(|s| s.mesh).collect();
    let mut buffers = BTreeSet::new();
    for Shown { bind, instances, .. } in shown {
        let copies = instances.map(|a| [a.translation, a.rotation, a.scale]).into_iter().flatten();
        for accessor in copies.chain([*bind]).flatten() {
            buffers.extend(buffers_of(root, accessor)?);
        }
    }
    let primitives = meshes.iter().filter_map(|m| root.meshes.get(*m)).flat_map(|m| &m.primitives);
    let mut seen = HashSet::new();
    for primitive in primitives.filter(|p| p.is_surface()) {
        if primitive.extensions.draco.is_some() {
            return Err(compressed("KHR_draco_mesh_compression"));
        }
        let vertices = &primitive.attributes;
        let accessors = [vertices.position, primitive.indices, vertices.normal, vertices.tangent];
        for accessor in accessors.into_iter().flatten().filter(|a| seen.insert(*a)) {
            buffers.extend(buffers_of(root, accessor)?);
        }
    }
    Ok(buffers)
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
