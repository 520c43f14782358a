//! What the format forbids is refused, with the place and what would be right.

use crate::files::{CAMERA, scene_of, triangle};

#[test]
fn each_class_of_invalid_file_is_refused_with_its_place() {
    let position = r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}"#;
    let cases = [
        (
            r#""indices": 2"#,
            r#""indices": 2, "mode": 7"#,
            "meshes[0].primitives[0].mode must be a whole number in [0, 6], got 7",
        ),
        (
            r#"{"POSITION": 0, "NORMAL": 1}"#,
            "{}",
            "attributes must be an object with one attribute at least, got {}",
        ),
        (
            r#"{"bufferView": 1, "#,
            r#"{"byteOffset": 4, "#,
            "accessors[1].byteOffset must be left out where bufferView is, got 4",
        ),
        (
            r#""min": [0, 0, 0]"#,
            r#""min": [0, 0]"#,
            "accessors[0] lacks min and max of three numbers each",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"extensions": {"KHR_lights_punctual": {"light": 0}}}], "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot"}]}}"#,
            "light 0: lacks the required field `spot`",
        ),
        (
            r#""version": "2.0""#,
            r#""version": "1.0""#,
            r#"asset.version must be "2.0", got "1.0""#,
        ),
        (
            r#"{"version": "2.0"}"#,
            r#"{}"#,
            "asset lacks the required field `version`",
        ),
        (
            r#"{"version": "2.0"}"#,
            r#"{"version": "2.0", "minVersion": "2.1"}"#,
            "asset.minVersion must be at most",
        ),
        (
            r#""bufferView": 0"#,
            r#""bufferView": 7"#,
            "accessors[0].bufferView must be an index below 3 (bufferViews), got 7",
        ),
        (
            r#""bufferView": 0"#,
            r#""bufferView": -1"#,
            "accessors[0].bufferView must be an index below 3 (bufferViews), got -1",
        ),
        (
            r#""bufferView": 0"#,
            r#""bufferView": "0""#,
            "accessors[0].bufferView must be an index below 3 (bufferViews), got \"0\"",
        ),
        (
            r#""count": 3, "#,
            "",
            "accessors[0] lacks the required field `count`",
        ),
        (
            r#""count": 3, "#,
            r#""count": 2.5, "#,
            "accessors[0].count must be a whole number",
        ),
        (
            r#""type": "VEC3""#,
            r#""type": "VEC5""#,
            "must have 3 components per element, got type \"VEC5\"",
        ),
        (
            r#""componentType": 5126"#,
            r#""componentType": 5125"#,
            "must have a componentType of [F32, I8, U8, I16, U16], got 5125",
        ),
        (
            r#""componentType": 5123"#,
            r#""componentType": 5122"#,
            "must have a componentType of [U8, U16, U32], got 5122",
        ),
        (
            position,
            r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}"#,
            "accessors[0] lacks min and max",
        ),
        (
            r#""buffer": 0"#,
            r#""buffer": 1"#,
            "bufferViews[0].buffer must be an index below 1 (buffers), got 1",
        ),
        (
            r#""byteLength": 36"#,
            r#""byteLength": 36, "byteStride": 256"#,
            "bufferViews[0].byteStride must be a whole number in [4, 252], got 256",
        ),
        (
            r#""POSITION": 0"#,
            r#""POSITION": 0, "WARMTH": 0"#,
            "meshes[0].primitives[0].attributes.WARMTH must be a known attribute",
        ),
        (
            r#""POSITION": 0"#,
            r#""POSITION": 0, "TEXCOORD_x": 0"#,
            "attributes.TEXCOORD_x must be a known attribute",
        ),
        (
            r#""POSITION": 0"#,
            r#""POSITION": 9"#,
            "meshes[0].primitives[0].attributes.POSITION must be an index below 3 (accessors), got 9",
        ),
        (
            r#""indices": 2"#,
            r#""indices": 2, "material": 0"#,
            "material must be an index below 0 (materials), got 0",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"mesh": 1}"#,
            "nodes[0].mesh must be an index below 1 (meshes), got 1",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"mesh": null}"#,
            "nodes[0].mesh must be an index below 1 (meshes), got null",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"children": [0]}"#,
            "nodes[0] must not be inside itself",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"children": [2]}, {"children": [2]}, {}"#,
            "nodes[2] must be a child once, but is one of nodes[0] and of nodes[1]",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"matrix": [1, 0]}"#,
            "nodes[0].matrix must be 16 numbers, got [1,0]",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"translation": [0, 0, 1e999]}"#,
            "number out of range",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "scene": 0"#,
            "scene must be an index below 0 (scenes), got 0",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "scenes": [{"nodes": [0, 0]}]"#,
            "node 0: must be reached once",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "skins": [{"joints": [4]}]"#,
            "skins[0].joints[0] must be an index below 1 (nodes), got 4",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "textures": [{"source": 0}]"#,
            "textures[0].source must be an index below 0 (images), got 0",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "animations": [{"channels": [{"sampler": 1, "target": {"path": "scale"}}], "samplers": []}]"#,
            "animations[0].channels[0].sampler must be an index below 0 (samplers), got 1",
        ),
        (
            r#"{"mesh": 0}"#,
            r#"{"extensions": {"KHR_lights_punctual": {"light": 0}}}"#,
            "light must be an index below 0 (lights), got 0",
        ),
        (
            r#"{"mesh": 0}]"#,
            r#"{"mesh": 0}], "cameras": {}"#,
            "cameras must be a list, got {}",
        ),
        (
            r#""asset""#,
            r#""property""#,
            "the file lacks the required field `asset`",
        ),
    ];
    let (buffer, json) = triangle();
    let json = format!(r#"{json}, "nodes": [{{"mesh": 0}}]"#);
    let whole = buffer.document(&json, Some(&buffer.data_uri()));
    assert!(scene_of(whole.as_bytes(), "", CAMERA).is_ok());
    for (from, to, expected) in cases {
        assert!(whole.contains(from), "{from}");
        let file = whole.replacen(from, to, 1);
        let error = scene_of(file.as_bytes(), "", CAMERA).expect_err(to);
        assert!(error.contains(expected), "{to}: {error}");
    }
}

#[test]
fn a_binary_file_of_another_version_or_order_is_refused() {
    let (buffer, json) = triangle();
    let whole = buffer.glb(&format!(r#"{json}, "nodes": [{{"mesh": 0}}]"#));
    let damaged = |place: usize, byte: u8| {
        let mut file = whole.clone();
        file[place] = byte;
        scene_of(&file, "", CAMERA).expect_err("damaged")
    };
    let cases = [
        (4, 1, "the header must state version 2, got 1"),
        (15, 0x7f, "a chunk must not reach beyond the file"),
        (16, b'K', "the first chunk must be JSON"),
    ];
    for (place, byte, expected) in cases {
        let error = damaged(place, byte);
        assert!(error.contains(expected), "{error}");
    }
}
