//! The form of a glTF 2.0 file: the properties that have a meaning for geometry, materials, lights and cameras, and the
//! references of all others. Words and codes out of lists stay unchecked: what knows them not says so where it reads them.
//! Source: the JSON schemas of the glTF 2.0 specification and of its extensions.

use super::gltf_check::Kind::{
    self, Attributes, Flag, Index, List, Number, NumberIn, Numbers, Object, Text, Whole,
};
use super::gltf_check::Property;

const fn must(name: &'static str, kind: Kind) -> Property {
    Property {
        name,
        required: true,
        kind,
    }
}

const fn may(name: &'static str, kind: Kind) -> Property {
    Property {
        name,
        required: false,
        kind,
    }
}

const ANY_WHOLE: Kind = Whole(0, u64::MAX);
const FRACTION: Kind = NumberIn(0.0, 1.0);
const NOT_NEGATIVE: Kind = NumberIn(0.0, f64::INFINITY);

/// The file.
pub(super) static ROOT: [Property; 18] = [
    must("asset", Object(&ASSET)),
    may("extensionsUsed", List(&Text)),
    may("extensionsRequired", List(&Text)),
    may("accessors", List(&Object(&ACCESSOR))),
    may("animations", List(&Object(&ANIMATION))),
    may("buffers", List(&Object(&BUFFER))),
    may("bufferViews", List(&Object(&BUFFER_VIEW))),
    may("cameras", List(&Object(&CAMERA))),
    may("images", List(&Object(&IMAGE))),
    may("materials", List(&Object(&MATERIAL))),
    may("meshes", List(&Object(&MESH))),
    may("nodes", List(&Object(&NODE))),
    may("samplers", List(&Object(&SAMPLER))),
    may("scenes", List(&Object(&SCENE))),
    may("textures", List(&Object(&TEXTURE))),
    may("scene", Index("scenes")),
    may("skins", List(&Object(&SKIN))),
    may("extensions", Object(&ROOT_EXTENSIONS)),
];

static ASSET: [Property; 2] = [must("version", Text), may("minVersion", Text)];

static ACCESSOR: [Property; 9] = [
    may("bufferView", Index("bufferViews")),
    may("byteOffset", ANY_WHOLE),
    must("componentType", ANY_WHOLE),
    may("normalized", Flag),
    must("count", ANY_WHOLE),
    must("type", Text),
    may("min", List(&Number)),
    may("max", List(&Number)),
    may("sparse", Object(&SPARSE)),
];

static SPARSE: [Property; 3] = [
    must("count", ANY_WHOLE),
    must("indices", Object(&SPARSE_INDICES)),
    must("values", Object(&SPARSE_VALUES)),
];

static SPARSE_INDICES: [Property; 3] = [
    must("bufferView", Index("bufferViews")),
    may("byteOffset", ANY_WHOLE),
    must("componentType", ANY_WHOLE),
];

static SPARSE_VALUES: [Property; 2] = [
    must("bufferView", Index("bufferViews")),
    may("byteOffset", ANY_WHOLE),
];

static ANIMATION: [Property; 2] = [
    must("channels", List(&Object(&CHANNEL))),
    must("samplers", List(&Object(&ANIMATION_SAMPLER))),
];

static CHANNEL: [Property; 2] = [
    must("sampler", ANY_WHOLE),
    must("target", Object(&CHANNEL_TARGET)),
];

static CHANNEL_TARGET: [Property; 2] = [may("node", Index("nodes")), must("path", Text)];

static ANIMATION_SAMPLER: [Property; 3] = [
    must("input", Index("accessors")),
    must("output", Index("accessors")),
    may("interpolation", Text),
];

static BUFFER: [Property; 2] = [may("uri", Text), must("byteLength", ANY_WHOLE)];

static BUFFER_VIEW: [Property; 4] = [
    must("buffer", Index("buffers")),
    may("byteOffset", ANY_WHOLE),
    must("byteLength", ANY_WHOLE),
    may("byteStride", Whole(4, 252)),
];

static CAMERA: [Property; 4] = [
    may("name", Text),
    must("type", Text),
    may("perspective", Object(&PERSPECTIVE)),
    may("orthographic", Object(&ORTHOGRAPHIC)),
];

static PERSPECTIVE: [Property; 4] = [
    must("yfov", Number),
    may("aspectRatio", Number),
    must("znear", NOT_NEGATIVE),
    may("zfar", NOT_NEGATIVE),
];

static ORTHOGRAPHIC: [Property; 4] = [
    must("xmag", Number),
    must("ymag", Number),
    must("znear", NOT_NEGATIVE),
    must("zfar", NOT_NEGATIVE),
];

static IMAGE: [Property; 3] = [
    may("uri", Text),
    may("mimeType", Text),
    may("bufferView", Index("bufferViews")),
];

static MATERIAL: [Property; 9] = [
    may("name", Text),
    may("pbrMetallicRoughness", Object(&METALLIC_ROUGHNESS)),
    may("normalTexture", Object(&NORMAL_TEXTURE_INFO)),
    may("occlusionTexture", Object(&TEXTURE_INFO)),
    may("emissiveTexture", Object(&TEXTURE_INFO)),
    may("emissiveFactor", Numbers(3)),
    may("alphaMode", Text),
    may("doubleSided", Flag),
    may("extensions", Object(&MATERIAL_EXTENSIONS)),
];

static METALLIC_ROUGHNESS: [Property; 5] = [
    may("baseColorFactor", Numbers(4)),
    may("baseColorTexture", Object(&TEXTURE_INFO)),
    may("metallicFactor", FRACTION),
    may("roughnessFactor", FRACTION),
    may("metallicRoughnessTexture", Object(&TEXTURE_INFO)),
];

static MATERIAL_EXTENSIONS: [Property; 3] = [
    may("KHR_materials_ior", Object(&REFRACTIVE_INDEX)),
    may(
        "KHR_materials_emissive_strength",
        Object(&EMISSIVE_STRENGTH),
    ),
    may(
        "KHR_materials_pbrSpecularGlossiness",
        Object(&SPECULAR_GLOSSINESS),
    ),
];

static REFRACTIVE_INDEX: [Property; 1] = [may("ior", NOT_NEGATIVE)];

static EMISSIVE_STRENGTH: [Property; 1] = [may("emissiveStrength", NOT_NEGATIVE)];

static SPECULAR_GLOSSINESS: [Property; 2] = [
    may("diffuseFactor", Numbers(4)),
    may("diffuseTexture", Object(&TEXTURE_INFO)),
];

static TEXTURE_INFO: [Property; 3] = [
    must("index", Index("textures")),
    may("texCoord", Whole(0, u32::MAX as u64)),
    may("extensions", Object(&TEXTURE_INFO_EXTENSIONS)),
];

static NORMAL_TEXTURE_INFO: [Property; 4] = [
    must("index", Index("textures")),
    may("texCoord", Whole(0, u32::MAX as u64)),
    may("scale", Number),
    may("extensions", Object(&TEXTURE_INFO_EXTENSIONS)),
];

static TEXTURE_INFO_EXTENSIONS: [Property; 1] =
    [may("KHR_texture_transform", Object(&TEXTURE_TRANSFORM))];

static TEXTURE_TRANSFORM: [Property; 4] = [
    may("offset", Numbers(2)),
    may("rotation", Number),
    may("scale", Numbers(2)),
    may("texCoord", Whole(0, u32::MAX as u64)),
];

static MESH: [Property; 2] = [
    may("name", Text),
    must("primitives", List(&Object(&PRIMITIVE))),
];

static PRIMITIVE: [Property; 5] = [
    must("attributes", Attributes),
    may("indices", Index("accessors")),
    may("material", Index("materials")),
    may("mode", Whole(0, 6)),
    may("targets", List(&Attributes)),
];

static NODE: [Property; 11] = [
    may("name", Text),
    may("camera", Index("cameras")),
    may("children", List(&Index("nodes"))),
    may("skin", Index("skins")),
    may("matrix", Numbers(16)),
    may("mesh", Index("meshes")),
    may("translation", Numbers(3)),
    may("rotation", Numbers(4)),
    may("scale", Numbers(3)),
    may("weights", List(&Number)),
    may("extensions", Object(&NODE_EXTENSIONS)),
];

static NODE_EXTENSIONS: [Property; 2] = [
    may("KHR_lights_punctual", Object(&NODE_LIGHT)),
    may("KHR_node_visibility", Object(&NODE_VISIBILITY)),
];

static NODE_LIGHT: [Property; 1] = [must("light", Index("lights"))];

static NODE_VISIBILITY: [Property; 1] = [may("visible", Flag)];

static SAMPLER: [Property; 4] = [
    may("magFilter", ANY_WHOLE),
    may("minFilter", ANY_WHOLE),
    may("wrapS", ANY_WHOLE),
    may("wrapT", ANY_WHOLE),
];

static SCENE: [Property; 1] = [may("nodes", List(&Index("nodes")))];

static SKIN: [Property; 3] = [
    may("inverseBindMatrices", Index("accessors")),
    may("skeleton", Index("nodes")),
    must("joints", List(&Index("nodes"))),
];

static TEXTURE: [Property; 2] = [
    may("sampler", Index("samplers")),
    may("source", Index("images")),
];

static ROOT_EXTENSIONS: [Property; 1] = [may("KHR_lights_punctual", Object(&LIGHTS))];

static LIGHTS: [Property; 1] = [must("lights", List(&Object(&LIGHT)))];

static LIGHT: [Property; 5] = [
    may("name", Text),
    must("type", Text),
    may("color", Numbers(3)),
    may("intensity", Number),
    may("spot", Object(&SPOT)),
];

static SPOT: [Property; 2] = [may("innerConeAngle", Number), may("outerConeAngle", Number)];
