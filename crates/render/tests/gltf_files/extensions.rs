//! Extensions: honoured, left aside with one warning, or refused.

use uw_render::scene::Scene;

use crate::files::{CAMERA, painted_triangle, scene_of};

/// The painted triangle with extensions: their list, those of its material, and those of its texture's look-up.
fn painted(listed: &str, material: &str, look_up: &str) -> Result<Scene, String> {
    let (buffer, json) = painted_triangle();
    let json = json
        .replacen(
            r#""extensionsUsed": ["#,
            &format!("{listed} \"extensionsUsed\": ["),
            1,
        )
        .replacen(
            r#""extensions": {"#,
            &format!(r#""extensions": {{{material}"#),
            1,
        )
        .replacen(r#"{"index": 0}"#, &format!(r#"{{"index": 0{look_up}}}"#), 1);
    scene_of(&buffer.glb(&json), "", CAMERA)
}

fn transformed(transform: &str) -> Vec<[f32; 2]> {
    let look_up = format!(r#", "extensions": {{"KHR_texture_transform": {transform}}}"#);
    let scene = painted("", "", &look_up).unwrap_or_else(|error| panic!("{transform}: {error}"));
    scene.meshes[0].uvs.clone()
}

fn near(got: &[[f32; 2]], expected: [[f32; 2]; 3]) -> bool {
    let close =
        |(a, b): (&[f32; 2], &[f32; 2])| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
    got.len() == 3 && got.iter().zip(&expected).all(close)
}

#[test]
fn texture_transforms_scale_turn_and_move_in_this_order() {
    // The mesh's own coordinates are (0, 0), (1, 0), (0, 1).
    let cases = [
        ("{}", [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        (
            r#"{"offset": [0.25, -2]}"#,
            [[0.25, -2.0], [1.25, -2.0], [0.25, -1.0]],
        ),
        (
            r#"{"offset": [0, 1], "scale": [1, -1]}"#,
            [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]],
        ),
        // The extension's own example: the lower left quadrant of the picture, turned by a quarter.
        (
            r#"{"offset": [0, 1], "rotation": 1.57079632679, "scale": [0.5, 0.5]}"#,
            [[0.0, 1.0], [0.0, 0.5], [0.5, 1.0]],
        ),
        (
            r#"{"rotation": -1.57079632679, "scale": [2, 3]}"#,
            [[0.0, 0.0], [0.0, 2.0], [-3.0, 0.0]],
        ),
    ];
    for (transform, expected) in cases {
        let uvs = transformed(transform);
        assert!(near(&uvs, expected), "{transform}: {uvs:?}");
    }
}

#[test]
fn a_transformed_look_up_meets_the_texel_that_it_names() {
    // Two texels, (128, 0, 255) and white: half a tile further the first corner sees the second.
    let look_up =
        r#", "extensions": {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [0.4, 1]}}"#;
    let green_at_corner = |look_up: &str| {
        let scene = painted("", "", look_up).expect("valid");
        let [u, v] = scene.meshes[0].uvs[0].map(f64::from);
        scene.textures[0].sample(u, v)[1]
    };
    assert_eq!((green_at_corner(""), green_at_corner(look_up)), (0.0, 1.0));
}

#[test]
fn a_texture_transform_may_name_other_coordinates() {
    let (buffer, json) = painted_triangle();
    let json = json
        .replacen(r#""TEXCOORD_0": 1"#, r#""TEXCOORD_1": 1"#, 1)
        .replacen(
            r#"{"index": 0}"#,
            r#"{"index": 0, "texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}"#,
            1,
        );
    let scene = scene_of(&buffer.glb(&json), "", CAMERA).expect("valid");
    assert!(near(
        &scene.meshes[0].uvs,
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    ));
}

#[test]
fn what_changes_no_shape_and_no_base_colour_is_left_aside_with_one_warning() {
    let names = [
        ("KHR_materials_unlit", "{}"),
        (
            "KHR_materials_transmission",
            r#"{"transmissionFactor": 0.5}"#,
        ),
        ("KHR_materials_sheen", "{}"),
        (
            "KHR_materials_clearcoat",
            r#"{"clearcoatTexture": {"index": 0}}"#,
        ),
        ("KHR_materials_variants", "{}"),
        ("KHR_materials_volume", "{}"),
        ("KHR_animation_pointer", "{}"),
    ];
    for (name, content) in names {
        for listed in [
            String::new(),
            format!(r#""extensionsRequired": ["{name}"],"#),
        ] {
            let (buffer, json) = painted_triangle();
            let json = json
                .replacen(
                    r#""extensionsUsed": ["#,
                    &format!(r#"{listed} "extensionsUsed": ["{name}", "#),
                    1,
                )
                .replacen(
                    r#""extensions": {"#,
                    &format!(r#""extensions": {{"{name}": {content}, "#),
                    1,
                );
            let scene = scene_of(&buffer.glb(&json), "", CAMERA);
            let scene = scene.unwrap_or_else(|error| panic!("{listed} {name}: {error}"));
            let about = |warning: &&String| warning.contains(name);
            assert_eq!(
                scene.warnings.iter().filter(about).count(),
                1,
                "{:?}",
                scene.warnings
            );
            assert_eq!((scene.meshes.len(), scene.textures.len()), (2, 1));
        }
    }
}

#[test]
fn what_shapes_or_textures_hang_on_is_refused_where_it_is_required() {
    for name in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "EXT_mesh_gpu_instancing",
        "EXT_texture_webp",
        "VENDOR_x",
    ] {
        let error =
            painted(&format!(r#""extensionsRequired": ["{name}"],"#), "", "").expect_err(name);
        assert!(
            error.contains("extensionsRequired[0] must be") && error.contains(name),
            "{error}"
        );
    }
}

#[test]
fn the_diffuse_part_of_a_specular_material_is_its_reflectance() {
    let specular =
        r#""KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.1, 0.2, 0.3, 1]}, "#;
    let scene = painted("", specular, "").expect("valid");
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!(
        (material.reflectance, material.texture),
        ([0.1, 0.2, 0.3], None)
    );
}

#[test]
fn a_node_that_is_not_visible_is_not_shown() {
    let (buffer, json) = painted_triangle();
    let hidden = r#"{"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}, "#;
    let json = json.replacen(r#"{"mesh": 0}, "#, hidden, 1);
    let scene = scene_of(&buffer.glb(&json), "", CAMERA).expect("valid");
    assert_eq!(scene.meshes.len(), 1);
}
