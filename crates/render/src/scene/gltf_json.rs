//! What a glTF 2.0 file says, as far as it is used here: the file's own names, its defaults filled in.
//! Source: the glTF 2.0 specification and the specifications of its extensions.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

/// Declares objects of the file whose fields may all be missing.
macro_rules! objects {
    ($($(#[$meta:meta])* $name:ident { $($fields:tt)* })*) => { $(
        $(#[$meta])*
        #[derive(Debug, Default, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub(super) struct $name { $($fields)* }
    )* };
}

objects! {
    /// The whole file.
    Document {
        pub(super) asset: Asset,
        pub(super) extensions_used: Vec<String>,
        pub(super) extensions_required: Vec<String>,
        pub(super) accessors: Vec<Accessor>,
        pub(super) animations: Vec<Animation>,
        pub(super) buffers: Vec<Buffer>,
        pub(super) buffer_views: Vec<BufferView>,
        pub(super) cameras: Vec<Camera>,
        pub(super) images: Vec<Image>,
        pub(super) materials: Vec<Material>,
        pub(super) meshes: Vec<Mesh>,
        pub(super) nodes: Vec<Node>,
        pub(super) samplers: Vec<Sampler>,
        /// The scene to show.
        pub(super) scene: Option<usize>,
        pub(super) scenes: Vec<Scene>,
        pub(super) skins: Vec<IgnoredAny>,
        pub(super) textures: Vec<Texture>,
        pub(super) extensions: RootExtensions,
    }

    Asset {
        pub(super) version: String,
        pub(super) min_version: Option<String>,
    }

    /// Numbers in a buffer; zeros where it has no view.
    Accessor {
        pub(super) buffer_view: Option<usize>,
        pub(super) byte_offset: usize,
        pub(super) component_type: u64,
        pub(super) normalized: bool,
        pub(super) count: usize,
        /// `SCALAR`, `VEC2` and so on.
        #[serde(rename = "type")]
        pub(super) shape: String,
        pub(super) min: Option<Vec<f64>>,
        pub(super) max: Option<Vec<f64>>,
        pub(super) sparse: Option<Sparse>,
    }

    /// Elements that replace those of the view.
    Sparse {
        pub(super) count: usize,
        pub(super) indices: SparsePart,
        pub(super) values: SparsePart,
    }

    SparsePart {
        pub(super) buffer_view: usize,
        pub(super) byte_offset: usize,
        pub(super) component_type: u64,
    }

    Animation {
        pub(super) channels: Vec<Channel>,
        pub(super) samplers: Vec<IgnoredAny>,
    }

    Channel {
        pub(super) sampler: usize,
    }

    Buffer {
        pub(super) uri: Option<String>,
        pub(super) byte_length: usize,
    }

    BufferView {
        pub(super) buffer: usize,
        pub(super) byte_offset: usize,
        pub(super) byte_length: usize,
        pub(super) byte_stride: Option<usize>,
    }

    Camera {
        pub(super) name: Option<String>,
        #[serde(rename = "type")]
        pub(super) projection: String,
        pub(super) perspective: Option<Perspective>,
    }

    Perspective {
        pub(super) yfov: f64,
        pub(super) aspect_ratio: Option<f64>,
    }

    Image {
        pub(super) uri: Option<String>,
        pub(super) buffer_view: Option<usize>,
    }

    Material {
        pub(super) name: Option<String>,
        pub(super) pbr_metallic_roughness: MetallicRoughness,
        pub(super) normal_texture: Option<NormalTextureInfo>,
        pub(super) emissive_texture: Option<TextureInfo>,
        pub(super) emissive_factor: [f64; 3],
        pub(super) alpha_mode: Option<String>,
        pub(super) extensions: MaterialExtensions,
    }

    MaterialExtensions {
        #[serde(rename = "KHR_materials_emissive_strength")]
        pub(super) emissive_strength: Option<EmissiveStrength>,
        #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
        pub(super) specular_glossiness: Option<SpecularGlossiness>,
        #[serde(rename = "KHR_materials_ior")]
        pub(super) ior: Option<RefractiveIndex>,
        #[serde(rename = "KHR_materials_unlit")]
        pub(super) unlit: Option<IgnoredAny>,
    }

    TextureInfo {
        pub(super) index: usize,
        pub(super) tex_coord: u32,
        pub(super) extensions: TextureInfoExtensions,
    }

    TextureInfoExtensions {
        #[serde(rename = "KHR_texture_transform")]
        pub(super) transform: Option<TextureTransform>,
    }

    Mesh {
        pub(super) name: Option<String>,
        pub(super) primitives: Vec<Primitive>,
    }

    Primitive {
        pub(super) attributes: BTreeMap<String, usize>,
        pub(super) indices: Option<usize>,
        pub(super) material: Option<usize>,
        /// Triangles where it is missing.
        pub(super) mode: Option<u64>,
    }

    Node {
        pub(super) name: Option<String>,
        pub(super) camera: Option<usize>,
        pub(super) children: Vec<usize>,
        pub(super) mesh: Option<usize>,
        pub(super) matrix: Option<[f64; 16]>,
        pub(super) translation: Option<[f64; 3]>,
        pub(super) rotation: Option<[f64; 4]>,
        pub(super) scale: Option<[f64; 3]>,
        pub(super) extensions: NodeExtensions,
    }

    NodeExtensions {
        #[serde(rename = "KHR_lights_punctual")]
        pub(super) light: Option<NodeLight>,
        #[serde(rename = "KHR_node_visibility")]
        pub(super) visibility: Option<NodeVisibility>,
    }

    NodeLight {
        pub(super) light: usize,
    }

    NodeVisibility {
        /// True where it is missing.
        pub(super) visible: Option<bool>,
    }

    Sampler {
        pub(super) mag_filter: Option<u64>,
        pub(super) wrap_s: Option<u64>,
        pub(super) wrap_t: Option<u64>,
    }

    Scene {
        pub(super) nodes: Vec<usize>,
    }

    Texture {
        pub(super) sampler: Option<usize>,
        pub(super) source: Option<usize>,
    }

    RootExtensions {
        #[serde(rename = "KHR_lights_punctual")]
        pub(super) punctual: Lights,
    }

    Lights {
        pub(super) lights: Vec<PunctualLight>,
    }
}

/// The metallic-roughness model of a material.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub(super) base_color_factor: [f64; 4],
    pub(super) base_color_texture: Option<TextureInfo>,
    pub(super) metallic_factor: f64,
    pub(super) roughness_factor: f64,
    pub(super) metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

/// The specular-glossiness model of a material, whose diffuse part is Lambertian.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub(super) diffuse_factor: [f64; 4],
    pub(super) diffuse_texture: Option<TextureInfo>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
        }
    }
}

/// Where normals are looked up, and what those along the surface are multiplied by.
#[derive(Debug, Deserialize)]
pub(super) struct NormalTextureInfo {
    #[serde(default = "one")]
    pub(super) scale: f64,
    #[serde(flatten)]
    pub(super) info: TextureInfo,
}

fn one() -> f64 {
    1.0
}

/// Of a dielectric; 0 stands for one that reflects everything.
#[derive(Debug, Deserialize)]
#[serde(default)]
pub(super) struct RefractiveIndex {
    pub(super) ior: f64,
}

impl Default for RefractiveIndex {
    fn default() -> Self {
        Self { ior: 1.5 }
    }
}

/// A factor of the emitted light.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    pub(super) emissive_strength: f64,
}

impl Default for EmissiveStrength {
    fn default() -> Self {
        Self {
            emissive_strength: 1.0,
        }
    }
}

/// Where in a texture the coordinates of a mesh look.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct TextureTransform {
    pub(super) offset: [f64; 2],
    /// Counter-clockwise in the picture, radians.
    pub(super) rotation: f64,
    pub(super) scale: [f64; 2],
    pub(super) tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self {
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
            tex_coord: None,
        }
    }
}

/// A light.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct PunctualLight {
    pub(super) name: Option<String>,
    /// `point`, `spot` or `directional`.
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) color: [f64; 3],
    /// Candela; lux of a directional light.
    pub(super) intensity: f64,
    pub(super) spot: Option<Spot>,
}

impl Default for PunctualLight {
    fn default() -> Self {
        Self {
            name: None,
            shape: String::new(),
            color: [1.0; 3],
            intensity: 1.0,
            spot: None,
        }
    }
}

/// Half angles of a spot light's cones, radians.
#[derive(Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Spot {
    pub(super) inner_cone_angle: f64,
    pub(super) outer_cone_angle: f64,
}

impl Default for Spot {
    fn default() -> Self {
        Self {
            inner_cone_angle: 0.0,
            outer_cone_angle: std::f64::consts::FRAC_PI_4,
        }
    }
}
