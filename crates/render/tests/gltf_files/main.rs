//! glTF files: what a scene gets out of nodes, meshes, materials, lights and cameras, and that no damaged
//! file ends the program.

mod extensions;
mod files;
mod gloss;
mod invalid;
mod legal;

use std::fs;
use std::path::Path;

use glam::DVec3;
use uw_render::scene::{Falloff, Scene, TextureFilter};

use files::{Buffer, CAMERA, assert_near, painted_triangle, scene_of, triangle};

#[test]
fn nodes_and_placement_carry_vertices_and_normals_into_the_world() {
    let (buffer, json) = triangle();
    // The child is scaled by (2, 2, -1), turned by 90° about glTF's y (z → x, x → -z), moved by (0, 0, 3).
    let nodes = r#""scenes": [{"nodes": [1]}], "scene": 0, "nodes": [
        {"mesh": 0, "scale": [2, 2, -1], "rotation": [0, 0.70710678, 0, 0.70710678]},
        {"children": [0], "translation": [0, 0, 3]}]"#;
    let file = buffer.document(&format!("{json}, {nodes}"), Some(&buffer.data_uri()));
    let scene = scene_of(file.as_bytes(), "", CAMERA).expect("valid");
    let mesh = &scene.meshes[0];
    // In glTF's axes the corners are (0, 0, 3), (0, 0, 1), (0, 2, 3); in the world y → z and z → -y.
    assert_near(mesh.positions[0], [0.0, -3.0, 0.0]);
    assert_near(mesh.positions[1], [0.0, -1.0, 0.0]);
    assert_near(mesh.positions[2], [0.0, -3.0, 2.0]);
    // The normal (0, 0, 1) is mirrored to -z, turned to -x. The winding follows it.
    assert_near(mesh.normals[0], [-1.0, 0.0, 0.0]);
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).dot(mesh.normals[0]) > 0.0);
    // The second triangle repeats a corner.
    assert_eq!(mesh.triangles.len(), 1);
    assert!(
        scene
            .warnings
            .iter()
            .any(|warning| warning.contains("1 triangles without area")),
        "{:?}",
        scene.warnings
    );

    // Placement: scale, then x, y, z rotations, then translation: (0, -1, 0) → (0, -2, 0) → (0, 0, -2)
    // about x by 90° → the same about z → (1, 2, 1).
    let placed = "translation_m = [1, 2, 3]\nrotation_deg = [90, 0, 90]\nscale = 2";
    let scene = scene_of(file.as_bytes(), placed, CAMERA).expect("valid");
    assert_near(scene.meshes[0].positions[1], [1.0, 2.0, 1.0]);
    // (0, -3, 2) → (0, -6, 4) → (0, -4, -6) → (4, 0, -6) → (5, 2, -3).
    assert_near(scene.meshes[0].positions[2], [5.0, 2.0, -3.0]);
    assert_near(scene.meshes[0].normals[0], [0.0, -1.0, 0.0]);
}

#[test]
fn binary_files_and_external_buffers_hold_the_same_mesh() {
    let (buffer, json) = triangle();
    let json = format!(r#"{json}, "nodes": [{{"mesh": 0}}]"#);
    let embedded = buffer.document(&json, Some(&buffer.data_uri()));
    let embedded = scene_of(embedded.as_bytes(), "", CAMERA)
        .expect("data URI")
        .meshes
        .remove(0);
    let binary = scene_of(&buffer.glb(&json), "", CAMERA)
        .expect("glb")
        .meshes
        .remove(0);
    assert_eq!(binary.positions, embedded.positions);

    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("the hull.bin"), &buffer.bytes).expect("writable");
    fs::write(
        folder.path().join("a.gltf"),
        buffer.document(&json, Some("the%20hull.bin")),
    )
    .expect("writable");
    let text = format!("format = \"uw-scene/1\"\n{CAMERA}\n[[object]]\ngltf = \"a.gltf\"\n");
    let external = Scene::parse(&text, folder.path(), "test.toml").expect("external buffer");
    assert_eq!(external.meshes[0].positions, embedded.positions);
    assert_eq!(external.meshes[0].triangles, embedded.triangles);
}

#[test]
fn materials_become_reflectance_texture_and_emission() {
    let (buffer, json) = painted_triangle();
    let scene = scene_of(&buffer.glb(json), "", CAMERA).expect("valid");
    assert_eq!(
        (
            scene.meshes.len(),
            scene.materials.len(),
            scene.textures.len()
        ),
        (2, 1, 1)
    );
    assert_eq!(scene.meshes[0].uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let material = &scene.materials[scene.meshes[1].material];
    assert!(
        material
            .reflectance
            .iter()
            .zip([0.5, 0.6, 0.7])
            .all(|(got, expected)| (got - expected).abs() < 1e-7)
    );
    assert_eq!(material.emission, [0.0, 2.0, 4.0]);
    let texture = &scene.textures[material.texture.expect("textured")];
    assert_eq!(texture.filter, TextureFilter::Nearest);
    // 128 of 255 in sRGB is 0.21586 in linear light.
    let left = texture.sample(0.2, 0.5);
    assert!(
        (left[0] - 0.215_86).abs() < 1e-5 && left[1] == 0.0 && (left[2] - 1.0).abs() < 1e-6,
        "{left:?}"
    );
}

#[test]
fn lights_become_lamps_and_a_camera_is_used_when_the_scene_has_none() {
    let json = r#""extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "name": "bulb", "intensity": 5, "color": [1, 0.5, 0]},
            {"type": "spot", "name": "bulb", "intensity": 2, "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}},
            {"type": "directional"}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "aspectRatio": 2.0, "znear": 0.1}}],
        "nodes": [{"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}},
            {"camera": 0, "translation": [0, 1, 0]}]"#;
    let file = Buffer::default().document(json, Some("data:,"));
    let scene = scene_of(file.as_bytes(), "", "").expect("valid");
    let [bulb, spot] = &scene.lamps[..] else {
        panic!("two lamps, got {}", scene.lamps.len())
    };
    assert_eq!(
        (bulb.name.as_str(), bulb.intensity, bulb.half_angle_deg),
        ("bulb", [5.0, 2.5, 0.0], 180.0)
    );
    assert_near(bulb.position_m, [1.0, -3.0, 2.0]);
    assert_eq!(
        (spot.name.as_str(), &spot.falloff),
        ("bulb_2", &Falloff::Uniform)
    );
    // A glTF light shines along -z, which is +y in the world.
    assert_near(spot.forward, [0.0, 1.0, 0.0]);
    assert!((spot.half_angle_deg - 0.5_f64.to_degrees()).abs() < 1e-5);
    assert!(
        scene
            .warnings
            .iter()
            .any(|warning| warning.contains("directional"))
    );

    let camera = &scene.camera;
    assert_eq!((camera.width, camera.height), (1280, 640));
    assert_near(camera.position_m, [0.0, 0.0, 1.0]);
    assert_near(camera.forward, [0.0, 1.0, 0.0]);
    assert_near(camera.right, [1.0, 0.0, 0.0]);
    assert_near(camera.down, [0.0, 0.0, -1.0]);
    assert!((camera.focal_px.y - 320.0 / 0.5_f64.tan()).abs() < 1e-3);
    let sized = scene_of(file.as_bytes(), "", "[camera]\nwidth = 100\nheight = 80\n")
        .expect("valid")
        .camera;
    assert_eq!((sized.width, sized.height), (100, 80));
    assert!((sized.focal_px.x - 40.0 / 0.5_f64.tan()).abs() < 1e-3);
    let own = scene_of(file.as_bytes(), "", CAMERA).expect("valid").camera;
    assert_eq!((own.width, own.forward), (32, DVec3::X));
}

#[test]
fn sparse_accessors_replace_what_they_list() {
    let (mut buffer, json) = triangle();
    buffer.view([1]).floats(&[7.0, 8.0, 9.0]);
    let sparse = r#""count": 3, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}}, "min""#;
    let json = json.replacen(r#""count": 3, "type": "VEC3", "min""#, sparse, 1)
        + r#", "nodes": [{"mesh": 0}]"#;
    let scene = scene_of(&buffer.glb(&json), "", CAMERA).expect("valid");
    assert_near(scene.meshes[0].positions[1], [7.0, -9.0, 8.0]);
    assert_near(scene.meshes[0].positions[2], [0.0, 0.0, 1.0]);
    buffer.bytes[3 * 12 * 2 + 12] = 3;
    let error = scene_of(&buffer.glb(&json), "", CAMERA).expect_err("index 3 of 3");
    assert!(error.contains("sparse index 3"), "{error}");
}

#[test]
fn no_damage_to_a_file_ends_the_program() {
    let (buffer, json) = painted_triangle();
    let more = r#"{"mesh": 0, "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}"#;
    let json = json
        .replace(r#"{"mesh": 0}, "#, "")
        .replace(r#"{"mesh": 0, "translation": [0, 0, 1]}]"#, more);
    assert!(json.contains(more));
    let whole = buffer.glb(&json);
    let folder = tempfile::tempdir().expect("folder");
    let attempts = std::cell::Cell::new(0);
    let read = |file: &[u8]| {
        // A new name each time: rewriting a file can wait for the disk.
        let name = format!("hull{}.glb", attempts.replace(attempts.get() + 1));
        let path = folder.path().join(&name);
        fs::write(&path, file).expect("writable");
        let text = format!("format = \"uw-scene/1\"\n{CAMERA}\n[[object]]\ngltf = \"{name}\"\n");
        let scene = Scene::parse(&text, folder.path(), "test.toml");
        fs::remove_file(&path).expect("removable");
        scene.map_err(|error| error.to_string())
    };
    assert!(read(&whole).is_ok());
    for length in 0..whole.len() {
        let message = read(&whole[..length])
            .err()
            .unwrap_or_else(|| panic!("{length} bytes were accepted"));
        assert!(message.contains(".glb: "), "{message}");
    }
    let mut refused = 0;
    for place in 0..whole.len() {
        for byte in [b'9', 0xff] {
            let mut damaged = whole.clone();
            damaged[place] = byte;
            refused += usize::from(read(&damaged).is_err());
        }
    }
    assert!(
        refused > whole.len(),
        "most damage is noticed, got {refused} of {}",
        2 * whole.len()
    );
}

#[test]
fn a_scene_file_is_read_from_disk_with_paths_from_its_folder() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad/no_such_scene.toml");
    let message = Scene::read(&path).expect_err("missing").to_string();
    assert!(
        message.contains("no_such_scene.toml: cannot be read"),
        "{message}"
    );
}
