//! glTF files made for the tests, and scenes that hold one.

use std::fs;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use glam::DVec3;
use uw_render::scene::Scene;

pub const CAMERA: &str = "[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nhfov_deg = 60\nwidth = 32\nheight = 18\n";

/// Bytes of a buffer and the JSON of the views into it.
#[derive(Default)]
pub struct Buffer {
    pub bytes: Vec<u8>,
    pub views: Vec<String>,
}

impl Buffer {
    pub fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> &mut Self {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.views.push(format!(
            r#"{{"buffer": 0, "byteOffset": {start}, "byteLength": {length}}}"#
        ));
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self
    }

    pub fn floats(&mut self, values: &[f32]) -> &mut Self {
        self.view(values.iter().flat_map(|value| value.to_le_bytes()))
    }

    pub fn indices(&mut self, values: &[u16]) -> &mut Self {
        self.view(values.iter().flat_map(|value| value.to_le_bytes()))
    }

    /// A whole file around the given JSON; `uri` is the buffer's, `None` for binary glTF.
    pub fn document(&self, json: &str, uri: Option<&str>) -> String {
        let uri = uri
            .map(|uri| format!(r#""uri": "{uri}", "#))
            .unwrap_or_default();
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{{uri}"byteLength": {}}}], "bufferViews": [{}], {json}}}"#,
            self.bytes.len(),
            self.views.join(", ")
        )
    }

    pub fn data_uri(&self) -> String {
        format!(
            "data:application/octet-stream;base64,{}",
            BASE64.encode(&self.bytes)
        )
    }

    pub fn glb(&self, json: &str) -> Vec<u8> {
        let mut json = self.document(json, None).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend(((28 + json.len() + self.bytes.len()) as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }
}

/// One triangle with normals.
pub fn triangle() -> (Buffer, &'static str) {
    let mut buffer = Buffer::default();
    buffer
        .floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
        .floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
        .indices(&[0, 1, 2, 2, 2, 1]);
    let json = r#""accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}]"#;
    (buffer, json)
}

/// A textured, glowing triangle that two nodes show.
pub fn painted_triangle() -> (Buffer, &'static str) {
    let mut picture = Vec::new();
    let texels = image::RgbImage::from_raw(2, 1, vec![128, 0, 255, 255, 255, 255]).expect("2 x 1");
    texels
        .write_to(
            &mut std::io::Cursor::new(&mut picture),
            image::ImageFormat::Png,
        )
        .expect("encoded");
    let mut buffer = Buffer::default();
    buffer
        .floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
        .view([0, 0, 255, 0, 0, 255])
        .view(picture);
    let json = r#""accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC2", "normalized": true}],
        "images": [{"bufferView": 2, "mimeType": "image/png"}],
        "samplers": [{"magFilter": 9728}], "textures": [{"source": 0, "sampler": 0}],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "materials": [{"emissiveFactor": [0, 0.5, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
            "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.6, 0.7, 1], "baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "nodes": [{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 1]}]"#;
    (buffer, json)
}

/// Reads a scene of one glTF object in a folder of its own; `object` holds further fields of the object.
pub fn scene_of(file: &[u8], object: &str, camera: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("hull.glb"), file).expect("writable");
    let text =
        format!("format = \"uw-scene/1\"\n{camera}\n[[object]]\ngltf = \"hull.glb\"\n{object}\n");
    Scene::parse(&text, folder.path(), "test.toml").map_err(|error| error.to_string())
}

pub fn assert_near(got: DVec3, expected: [f64; 3]) {
    assert!(
        (got - DVec3::from_array(expected)).length() < 1e-6,
        "{got} instead of {expected:?}"
    );
}
