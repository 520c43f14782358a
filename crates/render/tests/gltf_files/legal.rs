//! What the format allows and few files have: each loads, with the geometry that it stands for.

use uw_render::scene::Scene;

use crate::files::{Buffer, CAMERA, assert_near, painted_triangle, scene_of, triangle};

const NODE: &str = r#""nodes": [{"mesh": 0}]"#;

/// The scene of one triangle whose file has further parts and one of whose parts is written otherwise.
fn changed(from: &str, to: &str, more: &str) -> Scene {
    let (buffer, json) = triangle();
    let whole = format!("{json}, {NODE}{more}");
    assert!(whole.contains(from), "{from}");
    let json = whole.replacen(from, to, 1);
    scene_of(&buffer.glb(&json), "", CAMERA).unwrap_or_else(|error| panic!("{to}{more}: {error}"))
}

fn warns(scene: &Scene, what: &str) -> bool {
    let about = |warning: &&String| warning.contains(what);
    scene.warnings.iter().filter(about).count() == 1
}

#[test]
fn an_accessor_without_a_view_holds_zeros() {
    // Normals of zeros have no direction, positions of zeros no area.
    let normals = changed(r#"{"bufferView": 1, "#, "{", "");
    assert_eq!(normals.meshes[0].positions.len(), 3);
    assert!(normals.meshes[0].normals.is_empty());
    let positions = changed(r#"{"bufferView": 0, "#, "{", "");
    assert!(positions.meshes.is_empty());
    assert!(warns(&positions, "2 triangles without area"));
}

#[test]
fn a_sparse_accessor_needs_no_view_of_its_own() {
    let (mut buffer, json) = triangle();
    let corners = [1.0, 0.0, 0.0, 0.0, 5.0, 0.0];
    buffer.indices(&[1, 2]).floats(&corners);
    let sparse = r#"{"sparse": {"count": 2, "indices": {"bufferView": 3, "componentType": 5123}, "values": {"bufferView": 4}}, "#;
    let json = json.replacen(r#"{"bufferView": 0, "#, sparse, 1);
    let json = format!("{json}, {NODE}");
    let mesh = scene_of(&buffer.glb(&json), "", CAMERA)
        .expect("valid")
        .meshes
        .remove(0);
    assert_near(mesh.positions[0], [0.0; 3]);
    assert_near(mesh.positions[1], [1.0, 0.0, 0.0]);
    assert_near(mesh.positions[2], [0.0, 0.0, 5.0]);
}

#[test]
fn what_a_file_holds_beside_its_geometry_may_be_of_any_legal_form() {
    let more = [
        // Buffers that an extension fills, and views into them, as long as nothing shown needs them.
        r#", "materials": [{}], "textures": [{}], "images": [], "samplers": [{}]"#,
        r#", "animations": [{"channels": [{"sampler": 0, "target": {"path": "pointer", "extensions":
            {"KHR_animation_pointer": {"pointer": "/nodes/0/translation"}}}}], "samplers": [{"input": 0, "output": 1}]}]"#,
        r#", "animations": [{"channels": [{"sampler": 0, "target": {"path": "of tomorrow"}}],
            "samplers": [{"input": 0, "output": 1, "interpolation": "TOMORROW"}]}]"#,
        r#", "skins": [{"joints": [0], "skeleton": 0}]"#,
        r#", "cameras": [{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}]"#,
        r#", "extras": [1, "x", null], "unknown": {"nodes": 5}"#,
        r#", "extensions": {"VENDOR_thing": {}}, "extensionsUsed": ["VENDOR_thing"]"#,
    ];
    for more in more {
        assert_eq!(
            changed(NODE, NODE, more).meshes[0].triangles.len(),
            1,
            "{more}"
        );
    }
    let changes = [
        (
            r#""NORMAL": 1"#,
            r#""NORMAL": 1, "_TEMPERATURE": 1, "_wetness": 1"#,
        ),
        (
            r#""indices": 2"#,
            r#""indices": 2.0, "mode": 4, "extras": 5"#,
        ),
        (r#""count": 6"#, r#""count": 6.0, "name": "corners""#),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "children": [1]}, {}"#),
        (
            NODE,
            r#""nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]"#,
        ),
        (
            NODE,
            r#""nodes": [{"mesh": 0}, {}], "scenes": [{"name": "empty"}, {"nodes": [0]}], "scene": 1"#,
        ),
        (
            r#""NORMAL": 1}"#,
            r#""NORMAL": 1}, "targets": [{"POSITION": 0}]"#,
        ),
    ];
    for (from, to) in changes {
        assert_eq!(changed(from, to, "").meshes[0].triangles.len(), 1, "{to}");
    }
}

#[test]
fn a_scene_without_nodes_shows_nothing() {
    for scenes in [
        r#", "scenes": [{}]"#,
        r#", "scenes": [{"name": "empty"}, {"nodes": [0]}], "scene": 0"#,
    ] {
        assert!(changed(NODE, NODE, scenes).meshes.is_empty(), "{scenes}");
    }
    let nothing = scene_of(br#"{"asset": {"version": "2.1"}}"#, "", CAMERA).expect("valid");
    assert!(nothing.meshes.is_empty());
}

#[test]
fn a_primitive_without_positions_or_without_triangles_is_left_out_with_a_warning() {
    let scene = changed(r#""POSITION": 0, "#, "", "");
    assert!(
        scene.meshes.is_empty() && warns(&scene, "no POSITION"),
        "{:?}",
        scene.warnings
    );
    let scene = changed(r#""indices": 2"#, r#""mode": 1"#, "");
    assert!(
        scene.meshes.is_empty() && warns(&scene, "points and lines"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn a_camera_that_cannot_be_used_is_left_out_with_a_warning() {
    let cameras = [
        r#"{"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}"#,
        r#"{"type": "perspective", "perspective": {"yfov": 3.2, "znear": 0.1}}"#,
        r#"{"type": "of tomorrow"}"#,
    ];
    for camera in cameras {
        let scene = changed(
            r#"{"mesh": 0}"#,
            r#"{"mesh": 0, "camera": 0}"#,
            &format!(r#", "cameras": [{camera}]"#),
        );
        assert_eq!(scene.meshes.len(), 1);
        assert!(
            warns(&scene, "camera 0 is not used"),
            "{camera}: {:?}",
            scene.warnings
        );
    }
}

#[test]
fn a_buffer_without_uri_is_an_error_only_where_something_shown_reads_it() {
    let (buffer, json) = triangle();
    let json = format!("{json}, {NODE}");
    let file = buffer.document(&json, Some(&buffer.data_uri()));
    let unused = file
        .replacen(r#""buffers": ["#, r#""buffers": [{"byteLength": 8}, "#, 1)
        .replace(r#""buffer": 0"#, r#""buffer": 1"#);
    let scene = scene_of(unused.as_bytes(), "", CAMERA).expect("valid");
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    let used = buffer.document(&json, None);
    let error = scene_of(used.as_bytes(), "", CAMERA).expect_err("no bytes");
    assert!(
        error.contains("mesh 0 primitive 0 POSITION (accessor 0): buffer 0 has no uri"),
        "{error}"
    );
}

#[test]
fn a_texture_without_an_image_is_white() {
    let (buffer, json) = painted_triangle();
    let json = json.replacen(r#"{"source": 0, "sampler": 0}"#, "{}", 1);
    let scene = scene_of(&buffer.glb(&json), "", CAMERA).expect("valid");
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!(material.texture, None);
    assert!((material.reflectance[0] - 0.5).abs() < 1e-9);
    assert!(
        warns(&scene, "texture 0 has no source"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn integers_of_short_vertices_are_read_as_they_are() {
    let mut buffer = Buffer::default();
    let corners: [i16; 12] = [0, 0, 0, 0, 300, 0, 0, 0, 0, 200, 0, 0];
    buffer.view(corners.iter().flat_map(|value| value.to_le_bytes()));
    let view = buffer.views[0].replace('}', r#", "byteStride": 8}"#);
    buffer.views[0] = view;
    let json = r#""accessors": [{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [300, 200, 0]}],
        "extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0, "scale": [0.01, 0.01, 0.01]}]"#;
    let scene = scene_of(&buffer.glb(json), "", CAMERA).expect("valid");
    assert_near(scene.meshes[0].positions[1], [3.0, 0.0, 0.0]);
    assert_near(scene.meshes[0].positions[2], [0.0, 0.0, 2.0]);
}
