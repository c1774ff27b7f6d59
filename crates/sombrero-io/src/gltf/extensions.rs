//! The extensions that a file may require: those that say nothing about where vertices are, and those that are read.

use super::error::{compressed, unknown_extension};
use crate::error::ParseError;

/// Extensions that are read, or that leave the triangles of meshes what they are without them. `*` stands for any end.
const KNOWN: &[&str] = &[
    "KHR_mesh_quantization",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_node_visibility",
    "EXT_mesh_gpu_instancing",
    // What surfaces look like.
    "KHR_materials_*",
    "EXT_materials_*",
    "ADOBE_materials_*",
    "NV_materials_mdl",
    "FB_materials_modmap",
    "KHR_technique*",
    "KHR_texture_*",
    "EXT_texture_*",
    "MSFT_texture_dds",
    "GOOGLE_texture_basis",
    "KHR_lights_*",
    "EXT_lights_*",
    "CESIUM_primitive_outline",
    "AGI_stk_metadata",
    // What is done with the model.
    "KHR_animation_pointer",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_audio*",
    "KHR_xmp*",
    "KHR_physics_*",
    "KHR_rigid_bodies",
    "KHR_implicit_shapes",
    "KHR_collision_shapes",
    "KHR_environment_map",
    "AGI_articulations",
    "CESIUM_RTC",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
    "EXT_feature_metadata",
    "MSFT_lod",
    "MSFT_packing_*",
    "MSFT_audio_emitter",
    "OMI_*",
    "VRM*",
    "VRMC_*",
    "MOZ_*",
];

/// Refuses the first required extension that may change what the triangles are.
pub(super) fn check(required: &[String]) -> Result<(), ParseError> {
    let is_known = |name: &&String| {
        let mut known = KNOWN.iter();
        known.any(|known| known.strip_suffix('*').map_or(*name == known, |start| name.starts_with(start)))
    };
    match required.iter().find(|name| !is_known(name)) {
        None => Ok(()),
        Some(name) => {
            let lower = name.to_ascii_lowercase();
            let packed = ["compression", "draco", "meshopt"].iter().any(|word| lower.contains(word));
            Err(if packed { compressed(name) } else { unknown_extension(name) })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_named() {
        let required = |names: &[&str]| check(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
        assert_eq!(
            required(&["KHR_mesh_quantization", "KHR_materials_unlit", "VRMC_vrm", "OMI_seat"]),
            Ok(())
        );
        assert_eq!(required(&["KHR_materials_unlit", "ACME_spline"]), Err(unknown_extension("ACME_spline")));
        assert_eq!(required(&["ACME_compression"]), Err(compressed("ACME_compression")));
        assert_eq!(required(&["KHR_gaussian_splatting"]), Err(unknown_extension("KHR_gaussian_splatting")));
    }
}
