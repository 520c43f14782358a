//! glTF files, as the only object of a scene: what is read has triangles of its own vertices.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_render::scene::Scene;

const SCENE: &str = "format = \"uw-scene/1\"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\n\
                     hfov_deg = 60\nwidth = 4\nheight = 3\n[[object]]\ngltf = \"fuzz.glb\"\n";

fuzz_target!(|bytes: &[u8]| {
    // A device would be read for ever.
    let names = |name: &[u8]| bytes.windows(name.len()).any(|part| part == name);
    if names(b"dev") || names(b"proc") {
        return;
    }
    let path = uw_fuzz::as_file("fuzz.glb", bytes);
    let folder = path.parent().expect("a folder");
    let Ok(scene) = Scene::parse(SCENE, folder, "fuzz.toml") else {
        return;
    };
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
        assert!(mesh.positions.iter().all(|position| position.is_finite()));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices);
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == vertices);
        assert!(mesh.material < scene.materials.len());
    }
});
