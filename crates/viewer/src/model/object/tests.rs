//! Planes before cameras, placements, and what they reflect.

use super::*;

fn object(text: &str) -> Value {
    Value::Table(toml::from_str(text).expect("valid"))
}

/// A camera that looks down obliquely.
fn camera() -> Camera {
    let (open, mut settings) = crate::model::OpenScene::fallback().expect("valid");
    assert_eq!(open.objects.len(), 1);
    settings.camera.look_at(DVec3::new(1.0, 0.4, -3.6));
    settings.camera.build()
}

const WALL: &str = "plane = { center_m = [1.5, 0, -4], normal = [-2, 0, 0.2], size_m = [8, 6] }\n\
                        reflectance = { texture = \"a.png\", encoding = \"linear\" }\nroughness = 0.3";

#[test]
fn a_plane_is_the_one_that_the_scene_has() {
    let mut wall = object(WALL);
    let plane = Plane::of(&wall).expect("a plane");
    plane.put(&mut wall);
    let again = Plane::of(&wall).expect("a plane");
    assert!((again.axes.x_axis - plane.axes.x_axis).length() < 1e-8);
    assert!((again.axes.z_axis - plane.axes.z_axis).length() < 1e-8);
    assert_eq!(
        (again.centre_m, again.size_m),
        (plane.centre_m, plane.size_m)
    );
    let head = "format = \"uw-scene/1\"\ncamera = { position_m = [0, 0, -3], forward = [1, 0, 0], hfov_deg = 60, width = 4, height = 3 }\n[[object]]\n";
    let text = format!(
        "{head}{}",
        WALL.replace(
            "{ texture = \"a.png\", encoding = \"linear\" }",
            "[1, 1, 1]"
        )
    );
    let scene = uw_render::scene::Scene::parse(&text, Path::new(""), "test").expect("valid");
    let quad = &scene.quads[0];
    assert!((quad.half_u - 4.0 * plane.axes.x_axis).length() < 1e-12);
    assert!((quad.half_v - 3.0 * plane.axes.y_axis).length() < 1e-12);
}

#[test]
fn a_plane_turns_about_what_the_camera_looks_at() {
    let camera = camera();
    let mut plane = Plane::of(&object(WALL)).expect("a plane");
    let distance_m = plane.distance_m(&camera).expect("ahead");
    let before = plane;
    let stands = [
        (0.0, 0.0, 0.0),
        (40.0, 0.0, 0.0),
        (-65.0, 30.0, 20.0),
        (10.0, -50.0, 170.0),
    ];
    for (turn_deg, tilt_deg, roll_deg) in stands {
        let stand = Stand {
            turn_deg,
            tilt_deg,
            roll_deg,
        };
        plane.set_stand(&camera, stand);
        let now = plane.stand(&camera);
        for (a, b) in [
            (now.turn_deg, turn_deg),
            (now.tilt_deg, tilt_deg),
            (now.roll_deg, roll_deg),
        ] {
            assert!((a - b).abs() < 1e-6, "{now:?} {stand:?}");
        }
        let here = plane.distance_m(&camera).expect("ahead");
        assert!((here - distance_m).abs() < 1e-9, "{here} {distance_m}");
        // Right-handed, so that nothing is mirrored.
        assert!((plane.axes.determinant() - 1.0).abs() < 1e-12);
    }
    // Back as it was: no angle hangs on the way.
    plane.set_stand(&camera, before.stand(&camera));
    assert!((plane.centre_m - before.centre_m).length() < 1e-6);
    plane.set_stand(
        &camera,
        Stand {
            turn_deg: 0.0,
            tilt_deg: 0.0,
            roll_deg: 0.0,
        },
    );
    assert!((plane.axes.z_axis + camera.forward).length() < 1e-12);
    assert!((plane.axes.y_axis + camera.down).length() < 1e-12);
    plane.set_stand(
        &camera,
        Stand {
            turn_deg: 30.0,
            tilt_deg: 0.0,
            roll_deg: 0.0,
        },
    );
    assert!((plane.axes.z_axis.dot(camera.right) - 0.5).abs() < 1e-12);
    plane.set_distance(&camera, 0.7);
    assert!((plane.distance_m(&camera).expect("ahead") - 0.7).abs() < 1e-9);
}

#[test]
fn what_is_beside_the_axis_has_no_distance() {
    let camera = camera();
    let mut plane = Plane::of(&object(WALL)).expect("a plane");
    plane.centre_m += 20.0 * plane.axes.x_axis;
    assert_eq!(plane.distance_m(&camera), None);
    let (middle_m, own) = (plane.centre_m, plane.stand(&camera));
    plane.set_stand(
        &camera,
        Stand {
            turn_deg: own.turn_deg + 20.0,
            ..own
        },
    );
    assert!((plane.centre_m - middle_m).length() < 1e-12);
}

#[test]
fn textures_keep_what_else_is_said_of_them() {
    let mut wall = object(WALL);
    let texture = Reflectance::Texture {
        path: "b.png".to_owned(),
        tile_m: Some([0.5, 2.0]),
    };
    texture.put(&mut wall);
    assert_eq!(Reflectance::of(&wall), texture);
    assert_eq!(name(&wall), "plane, b.png");
    assert_eq!(wall["reflectance"]["encoding"].as_str(), Some("linear"));
    assert_eq!(wall["roughness"].as_float(), Some(0.3));
    Reflectance::Even([0.1, 0.2, 0.3]).put(&mut wall);
    assert_eq!(Reflectance::of(&wall), Reflectance::Even([0.1, 0.2, 0.3]));
    let chart = object("reflectance = { spectrum = \"c.csv\" }");
    let mut same = chart.clone();
    Reflectance::of(&chart).put(&mut same);
    assert_eq!(same, chart);
}

#[test]
fn placements_say_what_is_not_usual() {
    let mut ship = object("gltf = \"deep/ship.glb\"\nscale = 2\ntranslation_m = [1, 2, 3.5]");
    let mut placed = Placement::of(&ship).expect("a glTF object");
    assert_eq!(
        (name(&ship).as_str(), placed.scale),
        ("ship.glb", DVec3::splat(2.0))
    );
    placed.scale = DVec3::ONE;
    placed.rotation_deg.z = 90.0;
    placed.put(&mut ship);
    assert_eq!(Placement::of(&ship), Some(placed));
    let table = ship.as_table().expect("a table");
    let fields: Vec<_> = table.keys().map(String::as_str).collect();
    assert_eq!(fields, ["gltf", "rotation_deg", "translation_m"]);
}

#[test]
fn a_board_faces_the_camera() {
    let camera = camera();
    let board = board(&camera, 1.3);
    let plane = Plane::of(&board).expect("a plane");
    assert!((plane.distance_m(&camera).expect("ahead") - 1.3).abs() < 1e-8);
    let stand = plane.stand(&camera);
    let angles = [stand.turn_deg, stand.tilt_deg, stand.roll_deg];
    assert!(angles.iter().all(|angle| angle.abs() < 1e-5), "{angles:?}");
}
