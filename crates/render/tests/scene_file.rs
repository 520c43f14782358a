//! A complete scene file says what it should, and what is left out has its default.

use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};
use uw_media::phase::{Phase, PhaseFunction};
use uw_media::{Bands, WaterType, channel_iops};
use uw_render::scene::{
    Blur, Encoding, Exposure, Falloff, Lens, Noise, Opening, Scene, SceneError, Setting, Snow,
    TextureFilter,
};

const COMPLETE: &str = r#"
format = "uw-scene/1"
[water]
jerlov = "3C"
bands = "mean"
phase = { model = "fournier-forand", n = 1.10, backscatter_fraction = 0.005 }
refractive_index = 1.33
[surface]
height_m = 2.5
refractive = false
[sun]
zenith_deg = 30.0
azimuth_deg = 90.0
irradiance = [1.0, 0.9, 0.8]
[sky]
radiance = [0.1, 0.2, 0.3]
[camera]
position_m = [0.5, 0.0, -1]
forward = [2.0, 0.0, 0.0]
up = [0.3, 0.0, 1.0]
fx = 300.0
fy = 310.0
cx = 150.0
cy = 95.0
distortion = [-0.1, 0.01, 0.001, 0.002, 0.0]
width = 320
height = 180
[[lamp]]
name = "left"
position_m = [0.0, -0.3, 0.0]
forward = [1.0, 0.0, 0.0]
intensity = [10.0, 11.0, 12.0]
level_pct = 40.0
half_angle_deg = 35.0
falloff = { file = "beam.csv" }
radius_m = 0.02
[[lamp]]
name = "right"
position_m = [0.0, 0.3, 0.0]
intensity = [1, 2, 3]
[[object]]
plane = { center_m = [1.5, 0.0, 0.0], normal = [-1.0, 0.0, 0.0], up = [0.0, 0.0, 1.0], size_m = [8.0, 6.0] }
reflectance = { texture = "grey.png", encoding = "linear", filter = "nearest", tile_m = [2.0, 3.0] }
[[object]]
plane = { center_m = [0, 0, -3], normal = [0, 0, 1], up = [0, 1, 0], size_m = [4, 5] }
reflectance = { texture = "grey.png", encoding = "linear", filter = "nearest" }
[[object]]
plane = { center_m = [0, 0, 4], normal = [0, 0, -1], up = [0, 1, 0], size_m = [4, 4] }
reflectance = [0.1, 0.2, 0.3]
emission = [1, 2, 3]
[sensor]
exposure = { auto_mean = 0.4 }
encoding = "linear"
bits = 16
noise = { a = 1e-3, b = 1e-5 }
[render]
samples_per_pixel = 16
max_bounces = 3
"#;

fn parse(text: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("beam.csv"), "deg,relative\n0,4\n30,2\n").expect("writable");
    let texels = image::GrayImage::from_raw(2, 1, vec![51, 255]).expect("2 x 1");
    texels
        .save(folder.path().join("grey.png"))
        .expect("writable");
    Scene::parse(text, folder.path(), "test.toml")
}

#[test]
fn light_and_water_are_as_written() {
    let scene = parse(COMPLETE).expect("valid");
    let water = scene.water.expect("water");
    let expected = channel_iops(WaterType::C3, &Bands::Mean).expect("tabulated");
    assert_eq!((water.iops, water.refractive_index), (expected, 1.33));
    assert!((water.phase.backscatter_fraction() - 0.005).abs() < 1e-9);
    let surface = scene.surface.expect("surface");
    assert_eq!((surface.height_m, surface.refractive), (2.5, false));
    // Zenith 30°, towards +y: sin 30° along y, cos 30° down.
    let sun = scene.sun.expect("sun");
    assert!((sun.travel_direction - DVec3::new(0.0, 0.5, -0.75_f64.sqrt())).length() < 1e-15);
    assert_eq!(
        (sun.irradiance, scene.sky_radiance),
        ([1.0, 0.9, 0.8], [0.1, 0.2, 0.3])
    );
    let [left, right] = &scene.lamps[..] else {
        panic!("two lamps")
    };
    assert_eq!(
        (left.level_pct, left.half_angle_deg, left.radius_m),
        (40.0, 35.0, 0.02)
    );
    assert_eq!(
        left.falloff,
        Falloff::Profile(vec![(0.0, 1.0), (30.0, 0.5)])
    );
    assert_eq!(
        (right.level_pct, right.half_angle_deg, right.radius_m),
        (100.0, 180.0, 0.0)
    );
    assert_eq!(
        (right.intensity, &right.falloff),
        ([1.0, 2.0, 3.0], &Falloff::Uniform)
    );
}

/// Depths and red absorption of the water of a scene whose water and camera are as given.
fn layers(water: &str, camera_z_m: f64) -> (Vec<(f64, [f64; 3])>, Scene) {
    let text = format!(
        "format = \"uw-scene/1\"\n[surface]\n[water]\n{water}\n[camera]\nposition_m = [0, 0, {camera_z_m}]\n\
         forward = [1, 0, 0]\nhfov_deg = 60\nwidth = 8\nheight = 8\n"
    );
    let scene = parse(&text).expect("valid");
    let variation = &scene.water.as_ref().expect("water").variation;
    let found = variation.layers.iter();
    let found = found.map(|layer| (layer.depth_m, layer.iops.a)).collect();
    (found, scene)
}

/// 3C for 20 m, III for 20 m and II: the same within a layer, jumps between.
#[test]
fn a_jerlov_profile_is_written_out_layer_by_layer() {
    let three = "{ depth_m = 0, jerlov = \"3C\" }, { depth_m = 20, jerlov = \"3C\" }, { depth_m = 20, jerlov = \"III\" }, \
                 { depth_m = 40, jerlov = \"III\" }, { depth_m = 40, jerlov = \"II\" }";
    for bands in ["", "bands = \"mean\"\n", "bands = \"spectral-measured\"\n"] {
        let (short, scene) = layers(&format!("{bands}jerlov_profile = \"3C\""), -1.0);
        let (long, _) = layers(&format!("{bands}profile = [ {three} ]"), -1.0);
        assert_eq!(short, long, "{bands}");
        assert_eq!(short.len(), 5);
        assert_ne!(short[1].1, short[2].1, "a jump at 20 m");
        assert_eq!(scene.spectral.is_some(), bands != "bands = \"mean\"\n");
        assert!(scene.warnings.is_empty());
    }
}

#[test]
fn a_camera_below_the_known_layers_is_told() {
    let (found, scene) = layers("jerlov_profile = \"9C\"", -15.0);
    assert_eq!(found.len(), 1);
    assert_eq!(
        scene.warnings,
        [
            "water.jerlov_profile 9C is known down to 10 m; the camera is 15 m deep, in water of the type 9C that goes on from \
             the last known layer"
        ]
    );
    assert!(
        layers("jerlov_profile = \"9C\"", -9.0)
            .1
            .warnings
            .is_empty()
    );
}

#[test]
fn camera_objects_and_sensor_are_as_written() {
    let scene = parse(COMPLETE).expect("valid");
    let camera = &scene.camera;
    assert_eq!(
        (camera.position_m, camera.forward),
        (DVec3::new(0.5, 0.0, -1.0), DVec3::X)
    );
    assert!(
        (camera.right + DVec3::Y).length() < 1e-15 && (camera.down + DVec3::Z).length() < 1e-15
    );
    assert_eq!(
        (camera.focal_px, camera.centre_px),
        (DVec2::new(300.0, 310.0), DVec2::new(150.0, 95.0))
    );
    assert_eq!(
        (camera.width, camera.height, camera.lens, camera.port),
        (
            320,
            180,
            Lens::brown_conrady([-0.1, 0.01, 0.001, 0.002, 0.0]),
            None
        )
    );
    let [wall, floor, ceiling] = &scene.quads[..] else {
        panic!("three planes")
    };
    assert_eq!(
        (wall.tile_m, floor.tile_m),
        (DVec2::new(2.0, 3.0), DVec2::new(4.0, 5.0))
    );
    let [wall, floor, ceiling] = [wall, floor, ceiling].map(|quad| &scene.materials[quad.material]);
    assert_eq!(
        (
            scene.textures.len(),
            wall.texture,
            floor.texture,
            ceiling.texture
        ),
        (1, Some(0), Some(0), None)
    );
    assert_eq!(
        (ceiling.reflectance, ceiling.emission),
        ([0.1, 0.2, 0.3], [1.0, 2.0, 3.0])
    );
    let texture = &scene.textures[0];
    assert_eq!(
        (texture.width, texture.height, texture.filter),
        (2, 1, TextureFilter::Nearest)
    );
    assert!((texture.sample(0.1, 0.1)[1] - 0.2).abs() < 1e-7);
    let sensor = scene.sensor.expect("sensor");
    assert_eq!(
        (sensor.exposure, sensor.encoding, sensor.bits),
        (Exposure::AutoMean(0.4), Encoding::Linear, 16)
    );
    assert_eq!(sensor.noise, Some(Noise { a: 1e-3, b: 1e-5 }));
    assert_eq!(
        (scene.render.samples_per_pixel, scene.render.max_bounces),
        (16, 3)
    );
    assert!(scene.warnings.is_empty());
}

#[test]
fn what_is_left_out_has_its_default() {
    let camera = "[camera]\nposition_m = [0, 0, 0]\nforward = [0, 1, 0]\nhfov_deg = 90\nwidth = 40\nheight = 20\n";
    let text = format!(
        "format = \"uw-scene/1\"\n{camera}[water]\na = [1, 2, 3]\nb = [4, 5, 6]\n[surface]\n[sensor]\n"
    );
    let scene = parse(&text).expect("valid");
    let water = scene.water.expect("water");
    assert_eq!(
        (water.iops.a, water.iops.b, water.refractive_index),
        ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], 1.34)
    );
    assert!((water.phase.backscatter_fraction() - 0.0183).abs() < 1e-9);
    let surface = scene.surface.expect("surface");
    assert_eq!((surface.height_m, surface.refractive), (0.0, true));
    assert!(scene.sun.is_none() && scene.lamps.is_empty() && scene.sky_radiance == [0.0; 3]);
    assert_eq!(scene.camera.right, DVec3::X);
    assert!((scene.camera.focal_px - DVec2::splat(20.0)).length() < 1e-12);
    assert_eq!(
        (scene.render.samples_per_pixel, scene.render.max_bounces),
        (64, 0)
    );
    let sensor = scene.sensor.expect("sensor");
    assert_eq!(
        (sensor.exposure, sensor.encoding, sensor.bits),
        (Exposure::Fixed(1.0), Encoding::Srgb, 8)
    );
    let curved = format!(
        "format = \"uw-scene/1\"\n[sensor]\nencoding = {{ curve = [[20, 1], [120, 9], [240, 40]] }}\n{camera}"
    );
    let encoding = parse(&curved)
        .expect("valid")
        .sensor
        .expect("sensor")
        .encoding;
    let ratio = encoding.light(240.0) / encoding.light(20.0);
    assert!((ratio - 40.0).abs() < 2.0, "{ratio}");
    let bare = parse(&format!("format = \"uw-scene/1\"\n{camera}")).expect("valid");
    assert!(bare.water.is_none() && bare.surface.is_none() && bare.sensor.is_none());
}

#[test]
fn every_phase_function_model_is_read() {
    let models = [
        (
            "{ model = \"fournier-forand\", n = 1.1, mu = 3.5835 }",
            "fournier-forand",
            0.930,
        ),
        (
            "{ model = \"henyey-greenstein\", g = 0.9 }",
            "henyey-greenstein",
            0.9,
        ),
        (
            "{ model = \"rayleigh\", depolarisation = 0.09 }",
            "rayleigh",
            0.0,
        ),
        ("{ model = \"petzold\" }", "petzold", 0.924),
        (
            "{ model = \"draine\", g = 0.5, alpha = 0.0 }",
            "draine",
            0.5,
        ),
        ("{ model = \"isotropic\" }", "isotropic", 0.0),
        (
            "{ model = \"table\", file = \"beam.csv\" }",
            "table",
            f64::NAN,
        ),
        (
            "{ model = \"mix\", parts = [{ weight = 3, phase = { model = \"mix\", parts = [{ weight = 1, phase = \
             { model = \"henyey-greenstein\", g = 0.8 } }] } }, { weight = 1, phase = { model = \"isotropic\" } }] }",
            "mix",
            0.6,
        ),
    ];
    for (phase, name, mean_cosine) in models {
        let text = COMPLETE.replace(
            "{ model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.005 }",
            phase,
        );
        let read: Phase = parse(&text).expect(name).water.expect("water").phase;
        assert_eq!(read.name(), name);
        // The table, a beam profile lent for the purpose, has no published mean cosine.
        assert!(
            mean_cosine.is_nan() || (read.mean_cosine() - mean_cosine).abs() < 2e-3,
            "{name}: {}",
            read.mean_cosine()
        );
    }
}

/// Snow, and what of the camera blurs its flakes: every field, its default, and `--set` in the place of both.
#[test]
fn snow_is_read_with_what_blurs_it() {
    let scene = |water: &str, camera: &str| {
        parse(&format!(
            "format = \"uw-scene/1\"\n[water]\na = [1, 1, 1]\nb = [1, 1, 1]\n{water}\n[camera]\nposition_m = [0, 0, 0]\n\
             forward = [1, 0, 0]\nhfov_deg = 60\nwidth = 32\nheight = 18\n{camera}\n"
        ))
        .expect("valid")
    };
    let none = scene("", "aperture_mm = 0");
    assert_eq!(
        (none.snow, none.camera.opening, none.warnings.len()),
        (None, None, 0)
    );
    let defaults = scene("[water.snow]", "").snow.expect("snow");
    assert_eq!((defaults.share, defaults.slope), (0.1, 3.3));
    assert_eq!((defaults.per_m3, defaults.diameter_m), (2e4, [3e-4, 5e-3]));
    assert_eq!((defaults.seed, defaults.time_s), (1, 0.0));
    assert_eq!(
        (defaults.drift_m_s, defaults.blur),
        (DVec3::ZERO, Blur::default())
    );
    let full = scene(
        "snow = { share = 0.4, slope = 3.0, diameter_mm = [1, 2], per_litre = 0.5, drift_m_s = [0, 0.1, -0.2], time_s = 3, seed = 7 }",
        "aperture_mm = 5\nfocus_m = 1.5\nexposure_s = 0.02\nvelocity_m_s = [0.3, 0, 0]",
    );
    let expected = Snow {
        share: 0.4,
        slope: 3.0,
        diameter_m: [1e-3, 2e-3],
        per_m3: 500.0,
        drift_m_s: DVec3::new(0.0, 0.1, -0.2),
        time_s: 3.0,
        seed: 7,
        blur: Blur {
            exposure_s: 0.02,
            velocity_m_s: DVec3::new(0.3, 0.0, 0.0),
        },
    };
    assert_eq!(full.snow, Some(expected));
    let opening = Opening {
        diameter_m: 5e-3,
        focus_m: 1.5,
    };
    assert_eq!(full.camera.opening, Some(opening));
    assert!(full.warnings[0].contains("blur the flakes of water.snow alone"));
    let without = scene("", "exposure_s = 0.02");
    assert!(without.warnings[0].contains("no effect without [water.snow]"));
}

#[test]
fn settings_reach_snow() {
    let text = "format = \"uw-scene/1\"\nwater = { a = [1, 1, 1], b = [1, 1, 1] }\n\
                camera = { position_m = [0, 0, 0], forward = [1, 0, 0], hfov_deg = 60, width = 32, height = 18 }";
    let settings: Vec<Setting> = [
        "water.snow.share=0.3",
        "water.snow.diameter_mm=[1, 4]",
        "camera.exposure_s=0.1",
    ]
    .iter()
    .map(|text| text.parse().expect("a setting"))
    .collect();
    let scene = Scene::parse_with(text, Path::new("."), "test.toml", &settings).expect("valid");
    let snow = scene.snow.expect("snow");
    assert_eq!(
        (snow.share, snow.diameter_m, snow.blur.exposure_s),
        (0.3, [1e-3, 4e-3], 0.1)
    );
    let wrong = ["water.snow.share=3".parse().expect("a setting")];
    let error = Scene::parse_with(text, Path::new("."), "test.toml", &wrong).expect_err("refused");
    assert!(
        error.to_string().contains("share must be in [0, 1], got 3"),
        "{error}"
    );
}

/// What ROS writes of a camera; its principal point counts from the middle of the first pixel.
const CALIBRATION: &str = "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [500.0, 0, 319.5, 0, 510.0, 249.5, 0, 0, 1]\n\
                           distortion_model: plumb_bob\ndistortion_coefficients:\n  data: [-0.2, 0.03, 0.001, -0.002, 0]\n";

#[test]
fn a_calibration_is_a_camera_by_itself_and_in_a_scene() {
    let folder = tempfile::tempdir().expect("folder");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).expect("written");
        Scene::read(&path)
    };
    let alone = file("left.yaml", CALIBRATION).expect("a camera").camera;
    let camera = "format = \"uw-scene/1\"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\n";
    let port = "port = { kind = \"flat\", distance_m = 0.03, thickness_m = 0.01 }\n";
    let calibrated = format!("{camera}calibration = \"left.yaml\"\n");
    let within = file(
        "scene.toml",
        &format!("{calibrated}{port}[water]\njerlov = \"IB\"\n"),
    );
    let within = within.expect("a scene").camera;
    let by_hand = "width = 640\nheight = 480\nfx = 500\nfy = 510\ncx = 320\ncy = 250\n\
                   distortion = [-0.2, 0.03, 0.001, -0.002, 0.0]\n";
    let by_hand = file("hand.toml", &format!("{camera}{by_hand}")).expect("a scene");
    assert_eq!(format!("{alone:?}"), format!("{:?}", by_hand.camera));
    let expected = DVec2::new(320.0, 250.0);
    assert_eq!((within.centre_px, within.focal_px.y), (expected, 510.0));
    assert_eq!((within.lens, within.port.is_some()), (alone.lens, true));

    let told = |name: &str, text: &str| file(name, text).expect_err("an error").to_string();
    let twice = told("twice.toml", &format!("{calibrated}fx = 3\n"));
    assert!(
        twice.contains("camera.fx must be left out where camera.calibration is given"),
        "{twice}"
    );
    // Pictures made smaller; those that are cut have another camera.
    for size in ["width = 320", "height = 240", "width = 320\nheight = 240"] {
        let half = file("half.toml", &format!("{calibrated}{size}\n"))
            .expect("a scene")
            .camera;
        assert_eq!([half.width, half.height], [320, 240], "{size}");
        assert_eq!(half.focal_px, DVec2::new(250.0, 255.0));
        assert_eq!(
            (half.centre_px, half.lens),
            (DVec2::new(160.0, 125.0), alone.lens)
        );
    }
    for size in ["width = 320\nheight = 180", "width = 16384"] {
        let cut = told("cut.toml", &format!("{calibrated}{size}\n"));
        let words = "cut.toml:6: camera.width must be with camera.height of the proportions of the 640 x 480 pixels that were calibrated";
        assert!(cut.contains(words), "{size}: {cut}");
    }
    let missing = told("missing.toml", &calibrated.replace("left", "right"));
    assert!(missing.contains("right.yaml"), "{missing}");
    let wrong = told("wrong.yml", &CALIBRATION.replace("640", "many"));
    assert!(
        wrong.contains("wrong.yml: line 1: image_width must be a whole number"),
        "{wrong}"
    );
    let named = told("named.toml", &calibrated.replace("left.yaml", "wrong.yml"));
    assert!(
        named.contains("named.toml:5: camera.calibration: "),
        "{named}"
    );
    assert!(named.contains("wrong.yml: line 1: image_width"), "{named}");
    let folded = told("folded.yaml", &CALIBRATION.replace("[-0.2,", "[-9.0,"));
    assert!(folded.contains("one-to-one over the image"), "{folded}");
    // A setting counts as in a scene.
    let set = "camera.position_m=[1,2,3]"
        .parse::<Setting>()
        .expect("a setting");
    let moved = Scene::read_with(&folder.path().join("left.yaml"), &[set]).expect("a camera");
    assert_eq!(moved.camera.position_m, DVec3::new(1.0, 2.0, 3.0));
}
