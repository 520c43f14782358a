//! What is done about each extension of a glTF file: honoured, left aside with a warning, or refused.

use super::gltf_json::{Document, Node};
use super::gltf_resource::{GltfError, GltfSource};

/// Extensions that are honoured.
const HONOURED: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Extensions that a file may even require, although they are left aside: without them shapes, base colours and lights
/// are the same. They change how light is reflected beyond a matt base and a microfacet layer, add choices beside the default one,
/// animate, or describe.
const HARMLESS: [&str; 20] = [
    "EXT_lights_image_based",
    "KHR_animation_pointer",
    "KHR_interactivity",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_lod",
];

/// Refuses a file that cannot be shown without an extension that is not known here.
pub(super) fn refuse_required(source: &GltfSource) -> Result<(), GltfError> {
    let required = source.document.extensions_required.iter().enumerate();
    let is_unknown = |name: &str| !HONOURED.contains(&name) && !HARMLESS.contains(&name);
    match required.into_iter().find(|(_, name)| is_unknown(name)) {
        Some((i, name)) => Err(source.value(
            format!("extensionsRequired[{i}]"),
            "an extension that is honoured or can be left aside; export the file without it",
            name,
        )),
        None => Ok(()),
    }
}

/// A sentence for each extension that is left aside.
pub(super) fn warnings(document: &Document) -> Vec<String> {
    let named = document
        .extensions_used
        .iter()
        .chain(&document.extensions_required);
    named
        .filter(|name| !HONOURED.contains(&name.as_str()))
        .map(|name| match name.as_str() {
            "KHR_materials_unlit" => {
                format!("extension {name} is not used; its base colours are lit as all others")
            }
            "KHR_materials_variants" => {
                format!("extension {name} is not used; every mesh has its default material")
            }
            "KHR_materials_transmission" | "KHR_materials_diffuse_transmission" => {
                format!("extension {name} is not used; what it lets through is rendered opaque")
            }
            _ => format!("extension {name} is not used"),
        })
        .collect()
}

/// Whether the node and what is below it is shown.
pub(super) fn is_visible(node: &Node) -> bool {
    let visibility = node.extensions.visibility.as_ref();
    visibility
        .and_then(|visibility| visibility.visible)
        .unwrap_or(true)
}
