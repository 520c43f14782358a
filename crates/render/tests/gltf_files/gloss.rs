//! How materials shine, and the maps of their normals and their light.

use uw_render::scene::{Gloss, NormalMap, Scene};

use crate::files::{CAMERA, painted_triangle, scene_of};

/// The painted triangle whose material has further fields, and others in its metallic-roughness model.
fn polished(material: &str, model: &str) -> Result<Scene, String> {
    let (buffer, json) = painted_triangle();
    let json = json.replacen(
        r#""pbrMetallicRoughness": {"#,
        &format!(r#"{material} "pbrMetallicRoughness": {{{model} "#),
        1,
    );
    scene_of(&buffer.glb(&json), "", CAMERA)
}

fn gloss(material: &str, model: &str) -> Option<Gloss> {
    let scene = polished(material, model).unwrap_or_else(|error| panic!("{error}"));
    scene.materials[0].gloss
}

#[test]
fn metallic_and_roughness_are_honoured() {
    let plain = Gloss {
        roughness: 1.0,
        metallic: 1.0,
        index: 1.5,
        texture: None,
    };
    // The format's defaults are those of a rough metal.
    assert_eq!(gloss("", ""), Some(plain));
    assert_eq!(
        gloss("", r#""metallicFactor": 0.25, "roughnessFactor": 0.5,"#),
        Some(Gloss {
            roughness: 0.5,
            metallic: 0.25,
            ..plain
        })
    );
    // What exporters write for matt surfaces.
    assert_eq!(gloss("", r#""metallicFactor": 0,"#), None);
    let textured = r#""metallicFactor": 0, "metallicRoughnessTexture": {"index": 0},"#;
    let scene = polished("", textured).expect("valid");
    let texture = scene.materials[0].gloss.and_then(|gloss| gloss.texture);
    // Linear, beside the one of colours from the same image.
    let texel = scene.textures[texture.expect("textured")].sample(0.2, 0.5);
    assert!((texel[0] - 128.0 / 255.0).abs() < 1e-6, "{texel:?}");
    assert_ne!(texture, scene.materials[0].texture);
}

#[test]
fn the_refractive_index_is_that_of_the_file() {
    let (buffer, json) = painted_triangle();
    let with = |extension: &str| {
        let json = json
            .replacen(
                r#""extensionsUsed": ["#,
                r#""extensionsUsed": ["KHR_materials_ior", "KHR_materials_unlit", "#,
                1,
            )
            .replacen(
                r#""extensions": {"#,
                &format!(r#""extensions": {{{extension}, "#),
                1,
            );
        scene_of(&buffer.glb(&json), "", CAMERA).expect("valid")
    };
    let scene = with(r#""KHR_materials_ior": {"ior": 2.4}"#);
    assert_eq!(scene.materials[0].gloss.map(|gloss| gloss.index), Some(2.4));
    let scene = with(r#""KHR_materials_ior": {"ior": 0}"#);
    assert_eq!(scene.materials[0].gloss.map(|gloss| gloss.index), Some(1.5));
    assert!(scene.warnings.iter().any(|w| w.contains("refraction of 0")));
    assert_eq!(
        with(r#""KHR_materials_unlit": {}"#).materials[0].gloss,
        None
    );
}

#[test]
fn maps_of_normals_and_light_are_read() {
    let scene = polished(
        r#""normalTexture": {"index": 0, "scale": 0.5}, "emissiveTexture": {"index": 0},"#,
        "",
    )
    .expect("valid");
    let material = &scene.materials[0];
    let linear = scene.textures.len() - 1;
    assert_eq!(
        material.normal_map,
        Some(NormalMap {
            texture: linear,
            scale: 0.5
        })
    );
    assert_eq!(
        (material.emission_texture, material.texture),
        (Some(0), Some(0))
    );
    assert_eq!(material.emission, [0.0, 2.0, 4.0]);
    assert_eq!(scene.warnings, Vec::<String>::new());
}

/// A mesh has one set of coordinates: maps that are looked up elsewhere are told about and left aside, or count with their mean.
#[test]
fn maps_with_coordinates_of_their_own_are_told_about() {
    let moved = r#"{"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}"#;
    let scene = polished(
        &format!(r#""normalTexture": {moved}, "emissiveTexture": {moved},"#),
        &format!(r#""metallicRoughnessTexture": {moved},"#),
    )
    .expect("valid");
    let material = &scene.materials[0];
    assert_eq!(
        (material.normal_map, material.emission_texture),
        (None, None)
    );
    // The left texel is 128, 0, 255, the right one white.
    let gloss = material.gloss.expect("glossy");
    assert!((gloss.roughness - 0.5).abs() < 1e-6 && (gloss.metallic - 1.0).abs() < 1e-6);
    assert!(
        (material.emission[1] - 1.0).abs() < 1e-6,
        "{:?}",
        material.emission
    );
    for what in ["normal map", "metallic-roughness", "emissive"] {
        let about = |warning: &&String| warning.contains(what);
        assert_eq!(
            scene.warnings.iter().filter(about).count(),
            1,
            "{what}: {:?}",
            scene.warnings
        );
    }
}

#[test]
fn numbers_of_gloss_out_of_range_are_refused() {
    for (model, expected) in [
        (
            r#""roughnessFactor": 1.5,"#,
            "roughnessFactor must be a number in [0, 1], got 1.5",
        ),
        (
            r#""metallicFactor": -1,"#,
            "metallicFactor must be a number in [0, 1], got -1",
        ),
    ] {
        let error = polished("", model).expect_err(model);
        assert!(error.contains(expected), "{error}");
    }
}
