//! What a file holds beside positions and faces, by name.

use super::geometry::TRIANGLES;
use super::json::{Primitive, Root};
use crate::attributes::Attributes;

/// What the file holds beside positions and faces.
pub(super) fn attributes(root: &Root<'_>) -> Attributes {
    let mut names = Attributes::default();
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        note_vertices(primitive, &mut names);
        match primitive.mode {
            0 => names.note("points"),
            1..TRIANGLES => names.note("lines"),
            _ => {}
        }
        if primitive.material.is_some() {
            names.note("materials");
        }
        if !primitive.targets.is_empty() {
            names.note("morph targets");
        }
    }
    let nodes = &root.nodes;
    let others = [
        ("materials", !root.materials.is_empty()),
        ("images", !root.images.is_empty()),
        ("skins", !root.skins.is_empty() || nodes.iter().any(|n| n.skin.is_some())),
        ("animations", !root.animations.is_empty()),
        ("cameras", !root.cameras.is_empty()),
        ("lights", root.extensions.lights.is_some()),
        ("instances", nodes.iter().any(|n| n.extensions.instances.is_some())),
    ];
    others.iter().filter(|(_, there)| *there).for_each(|(name, _)| names.note(name));
    names
}

fn note_vertices(primitive: &Primitive, names: &mut Attributes) {
    let vertices = &primitive.attributes;
    if vertices.normal.is_some() {
        names.note("normals");
    }
    if vertices.tangent.is_some() {
        names.note("tangents");
    }
    for name in &vertices.others {
        let common = [
            ("TEXCOORD_", "texture coordinates"),
            ("COLOR_", "colours"),
            ("JOINTS_", "skins"),
            ("WEIGHTS_", "skins"),
        ];
        let known = common.iter().find(|(prefix, _)| name.starts_with(prefix));
        names.note(known.map_or(name, |(_, common)| common));
    }
}
