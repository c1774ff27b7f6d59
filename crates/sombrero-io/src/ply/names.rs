//! What the properties and elements of a file are called among its attributes.

use super::element::{AXES, is_corners};
use super::header::Header;
use crate::attributes::Attributes;

/// The names, in the order of the header.
pub(super) fn attributes(header: &Header) -> Attributes {
    let mut attributes = Attributes::default();
    for (index, element) in header.elements.iter().enumerate() {
        let vertex = index == header.vertex;
        let faces = element.is_faces();
        if !vertex && !faces {
            attributes.note(&element.name);
            continue;
        }
        for property in &element.properties {
            let position = vertex && AXES.contains(&property.name.as_str());
            let corners = faces && is_corners(property);
            if !(position || corners) {
                attributes.note(common_name(&property.name));
            }
        }
    }
    attributes
}

/// The name that all formats use for what a property belongs to, or its own.
fn common_name(property: &str) -> &str {
    match property {
        "nx" | "ny" | "nz" => "normals",
        "red" | "green" | "blue" | "alpha" | "diffuse_red" | "diffuse_green" | "diffuse_blue" => "colours",
        "s" | "t" | "u" | "v" | "texture_u" | "texture_v" | "texcoord" => "texture coordinates",
        other => other,
    }
}
