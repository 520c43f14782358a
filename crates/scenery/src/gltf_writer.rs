//! Models as binary glTF 2.0 (`.glb`) with an embedded texture.
//!
//! glTF has +y up: world (x, y, z) is stored as (x, z, −y), which readers undo by (x, y, z) → (x, −z, y).
//! Source: Khronos glTF 2.0 specification, sections 3.4 (coordinates) and 4.4 (GLB layout).

use super::SceneryError;
use super::image_file::jpeg_bytes;
use super::mesh::{Mesh, Vec3, turn};
use super::models::{AssetModel, Surface};
use super::sites::{Place, Site};
use super::textures::ReflectanceImage;
use serde_json::{Value, json};

const GLB_MAGIC: &[u8; 4] = b"glTF";
const GLB_VERSION: u32 = 2;
const CHUNK_JSON: &[u8; 4] = b"JSON";
const CHUNK_BINARY: &[u8; 4] = b"BIN\0";

/// glTF enumerants: component types, buffer targets, sampler settings.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const NEAREST: u32 = 9728;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;
const REPEAT: u32 = 10_497;

/// The bytes of a `.glb` file with the model and its texture (as JPEG of `jpeg_quality`, 1..=100).
pub fn glb_bytes(
    model: &AssetModel,
    texture: &ReflectanceImage,
    jpeg_quality: u8,
) -> Result<Vec<u8>, SceneryError> {
    let mut document = Document::default();
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for (index, part) in model.parts.iter().enumerate() {
        materials.push(material(part.name, part.surface));
        meshes.push(
            json!({"name": part.name, "primitives": [document.primitive(&part.mesh, index)]}),
        );
        nodes.push(json!({"name": part.name, "mesh": index}));
    }
    let image_view = document.view(&jpeg_bytes(texture, jpeg_quality)?, None);
    let root = json!({
        "asset": {"version": "2.0", "generator": concat!("uw-survey ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"name": model.name, "nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "textures": [{"sampler": 0, "source": 0}],
        "samplers": [{"magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": REPEAT, "wrapT": REPEAT}],
        "images": [{"name": model.pattern.name(), "mimeType": "image/jpeg", "bufferView": image_view}],
        "accessors": document.accessors,
        "bufferViews": document.views,
        "buffers": [{"byteLength": document.binary.len()}],
    });
    container(root.to_string().into_bytes(), document.binary)
}

/// The bytes of a `.glb` file that shows one mesh at many places (m, in the world frame), with the picture `texture` that
/// stands beside the file, looked up by the nearest texel.
pub fn tiled_glb_bytes(
    name: &str,
    mesh: &Mesh,
    positions: &[Vec3],
    texture: &str,
) -> Result<Vec<u8>, SceneryError> {
    let mut document = Document::default();
    let primitive = document.primitive(mesh, 0);
    let nodes: Vec<Value> = positions
        .iter()
        .map(|&position| json!({"mesh": 0, "translation": y_up(position)}))
        .collect();
    let root = json!({
        "asset": {"version": "2.0", "generator": concat!("uw-survey ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"name": name, "nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": [{"name": name, "primitives": [primitive]}],
        "materials": [material(name, Surface::Textured)],
        "textures": [{"sampler": 0, "source": 0}],
        "samplers": [{"magFilter": NEAREST, "minFilter": NEAREST, "wrapS": REPEAT, "wrapT": REPEAT}],
        "images": [{"uri": texture}],
        "accessors": document.accessors,
        "bufferViews": document.views,
        "buffers": [{"byteLength": document.binary.len()}],
    });
    container(root.to_string().into_bytes(), document.binary)
}

/// The bytes of a `.glb` file of a place, with the pictures of `../textures` on it.
pub fn site_glb_bytes(site: &Site) -> Result<Vec<u8>, SceneryError> {
    let mut document = Document::default();
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    let mut pictures: Vec<&str> = Vec::new();
    for (index, part) in site.parts.iter().enumerate() {
        let (picture, [r, g, b]) = part.skin;
        let texture = pictures.iter().position(|known| *known == picture);
        let texture = texture.unwrap_or_else(|| {
            pictures.push(picture);
            pictures.len() - 1
        });
        materials.push(json!({"name": part.name, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture}, "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        }}));
        meshes.push(
            json!({"name": part.name, "primitives": [document.primitive(&part.mesh, index)]}),
        );
        for place in &part.places {
            nodes.push(node(part.name, index, place));
        }
    }
    let textures = (0..pictures.len()).map(|source| json!({"sampler": 0, "source": source}));
    let images = pictures
        .iter()
        .map(|name| json!({"uri": format!("../textures/{name}.png")}));
    let root = json!({
        "asset": {"version": "2.0", "generator": concat!("uw-survey ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"name": site.name, "nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "textures": textures.collect::<Vec<_>>(),
        "samplers": [{"magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": REPEAT, "wrapT": REPEAT}],
        "images": images.collect::<Vec<_>>(),
        "accessors": document.accessors,
        "bufferViews": document.views,
        "buffers": [{"byteLength": document.binary.len()}],
    });
    container(root.to_string().into_bytes(), document.binary)
}

/// A mesh at a place.
fn node(name: &str, mesh: usize, place: &Place) -> Value {
    let mut node = json!({"name": name, "mesh": mesh});
    if place.at_m != [0.0; 3] {
        node["translation"] = json!(y_up(place.at_m));
    }
    if place.turn != 0.0 {
        // About the world's +z, which is the file's +y.
        let [cosine, sine] = turn(0.5 * place.turn);
        node["rotation"] = json!([0.0, sine as f32, 0.0, cosine as f32]);
    }
    if place.size != 1.0 {
        let size = place.size as f32;
        node["scale"] = json!([size, size, size]);
    }
    node
}

fn material(name: &str, surface: Surface) -> Value {
    let colour = match surface {
        Surface::Textured => {
            json!({"baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 1.0})
        }
        Surface::Plain([r, g, b]) => {
            json!({"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0})
        }
    };
    json!({"name": name, "pbrMetallicRoughness": colour})
}

/// The binary chunk as it grows, with what the JSON chunk says about it.
#[derive(Default)]
struct Document {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Document {
    fn primitive(&mut self, mesh: &Mesh, material: usize) -> Value {
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|&p| y_up(p)).collect();
        let normals: Vec<[f32; 3]> = mesh.normals.iter().map(|&n| y_up(n)).collect();
        let uvs: Vec<[f32; 2]> = mesh.uvs.iter().map(|uv| uv.map(|v| v as f32)).collect();
        let position = self.floats(&positions, "VEC3");
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..3)
                .map(|k| positions.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0))
                .collect()
        };
        self.accessors[position]["min"] = json!(bound(f32::min));
        self.accessors[position]["max"] = json!(bound(f32::max));
        let attributes = json!({
            "POSITION": position,
            "NORMAL": self.floats(&normals, "VEC3"),
            "TEXCOORD_0": self.floats(&uvs, "VEC2"),
        });
        json!({"attributes": attributes, "indices": self.indices(mesh), "material": material})
    }

    /// An accessor over float vectors; returns its index.
    fn floats<const N: usize>(&mut self, vectors: &[[f32; N]], kind: &str) -> usize {
        let bytes: Vec<u8> = vectors
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        self.accessor(&bytes, ARRAY_BUFFER, FLOAT, vectors.len(), kind)
    }

    fn indices(&mut self, mesh: &Mesh) -> usize {
        let indices = || mesh.triangles.iter().flatten();
        let count = 3 * mesh.triangles.len();
        // The largest 16-bit index is reserved as a restart mark.
        if mesh.positions.len() < usize::from(u16::MAX) {
            let bytes: Vec<u8> = indices().flat_map(|&i| (i as u16).to_le_bytes()).collect();
            self.accessor(
                &bytes,
                ELEMENT_ARRAY_BUFFER,
                UNSIGNED_SHORT,
                count,
                "SCALAR",
            )
        } else {
            let bytes: Vec<u8> = indices().flat_map(|i| i.to_le_bytes()).collect();
            self.accessor(&bytes, ELEMENT_ARRAY_BUFFER, UNSIGNED_INT, count, "SCALAR")
        }
    }

    fn accessor(
        &mut self,
        bytes: &[u8],
        target: u32,
        component: u32,
        count: usize,
        kind: &str,
    ) -> usize {
        let view = self.view(bytes, Some(target));
        self.accessors.push(
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        );
        self.accessors.len() - 1
    }

    /// Appends bytes as a buffer view that begins at a multiple of four; returns its index.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        pad(&mut self.binary, 0);
        let mut view =
            json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }
}

/// World coordinates (+z up) in glTF's (+y up).
fn y_up([x, y, z]: Vec3) -> [f32; 3] {
    [x as f32, z as f32, -y as f32]
}

fn pad(bytes: &mut Vec<u8>, filler: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), filler);
}

/// The GLB container: header, JSON chunk, binary chunk.
fn container(mut text: Vec<u8>, mut binary: Vec<u8>) -> Result<Vec<u8>, SceneryError> {
    pad(&mut text, b' ');
    pad(&mut binary, 0);
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| SceneryError::ModelTooLarge { bytes: total })
    };
    let mut file = Vec::with_capacity(total);
    file.extend_from_slice(GLB_MAGIC);
    file.extend_from_slice(&GLB_VERSION.to_le_bytes());
    file.extend_from_slice(&length(total)?.to_le_bytes());
    for (kind, chunk) in [(CHUNK_JSON, &text), (CHUNK_BINARY, &binary)] {
        file.extend_from_slice(&length(chunk.len())?.to_le_bytes());
        file.extend_from_slice(kind);
        file.extend_from_slice(chunk);
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::{seabed, ship_hull};

    /// The model as written with a small texture and read again.
    fn written(model: &AssetModel) -> gltf::Gltf {
        let texture = model.pattern.draw(&model.tile, 32);
        gltf::Gltf::from_slice(&glb_bytes(model, &texture, 92).unwrap()).unwrap()
    }

    /// Size of the embedded texture, texels.
    fn texture_size(file: &gltf::Gltf) -> (u32, u32) {
        let gltf::image::Source::View { view, mime_type } = file.images().next().unwrap().source()
        else {
            panic!("the texture is not embedded")
        };
        assert_eq!(mime_type, "image/jpeg");
        let bytes = &file.blob.as_ref().unwrap()[view.offset()..view.offset() + view.length()];
        let picture = image::load_from_memory(bytes).unwrap();
        (picture.width(), picture.height())
    }

    #[test]
    fn models_are_valid_gltf_with_sane_geometry() {
        for (model, size_m, triangles) in [
            (ship_hull(1), [1.5, 5.0, 12.0], 20_000..60_000),
            (seabed(1), [12.0, 1.5, 12.0], 60_000..100_000),
        ] {
            assert!(
                triangles.contains(&model.triangle_count()),
                "{}: {}",
                model.name,
                model.triangle_count()
            );
            let file = written(&model);
            assert_eq!(texture_size(&file), (32, 32));
            let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
            for mesh in file.meshes() {
                for primitive in mesh.primitives() {
                    let reader = primitive.reader(|_| file.blob.as_deref());
                    let positions: Vec<_> = reader.read_positions().unwrap().collect();
                    for p in &positions {
                        (0..3).for_each(|k| {
                            (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]))
                        });
                    }
                    for n in reader.read_normals().unwrap() {
                        let squared: f32 = n.iter().map(|v| v * v).sum();
                        assert!((squared - 1.0).abs() < 1e-5, "{}: normal {n:?}", model.name);
                    }
                    for uv in reader.read_tex_coords(0).unwrap().into_f32() {
                        assert!(
                            uv.iter().all(|v| (-1.0..3.0).contains(v)),
                            "{}: uv {uv:?}",
                            model.name
                        );
                    }
                    let indices: Vec<_> = reader.read_indices().unwrap().into_u32().collect();
                    assert!(indices.iter().all(|&i| (i as usize) < positions.len()));
                }
            }
            for k in 0..3 {
                let extent = high[k] - low[k];
                assert!(
                    extent <= size_m[k] + 0.01 && extent > 0.25 * size_m[k],
                    "{}: axis {k}: {extent} m",
                    model.name
                );
            }
        }
    }

    #[test]
    fn triangles_wind_the_way_their_normals_point() {
        for model in [ship_hull(2), seabed(2)] {
            for part in &model.parts {
                let mesh = &part.mesh;
                for &triangle in &mesh.triangles {
                    use crate::mesh::{cross, dot, minus};
                    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                    let facing = cross(minus(b, a), minus(c, a));
                    assert!(
                        dot(facing, facing) > 0.0,
                        "{}: a triangle without area",
                        part.name
                    );
                    assert!(
                        dot(facing, mesh.normals[triangle[0] as usize]) > 0.0,
                        "{}",
                        part.name
                    );
                }
            }
        }
    }

    #[test]
    fn the_written_frame_has_y_up() {
        // The seabed faces up: +z in the world, +y in the file.
        let file = written(&seabed(1));
        let sand = file.meshes().next().unwrap().primitives().next().unwrap();
        let reader = sand.reader(|_| file.blob.as_deref());
        assert!(reader.read_normals().unwrap().all(|n| n[1] > 0.5));
        // Its first vertex is the far left corner: world (-6, 6), file (-6, .., -6).
        let first = reader.read_positions().unwrap().next().unwrap();
        assert_eq!((first[0], first[2]), (-6.0, -6.0));
    }
}
