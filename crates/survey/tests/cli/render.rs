//! `uw render` and `uw sensor`.

use serde_json::Value;
use uw_render::gpu::adapters;
use uw_render::image::{ExrImage, LayerData, read_frame};

use super::support::{Folder, SCENE};

pub fn exr(folder: &Folder, name: &str) -> ExrImage {
    ExrImage::read(&folder.path(name)).expect("readable")
}

pub fn colour(image: &ExrImage, name: &str) -> Vec<[f32; 3]> {
    match image.layer(name) {
        Some(LayerData::Colour(values)) => values.clone(),
        other => panic!("{name}: {other:?}"),
    }
}

pub fn stats(folder: &Folder, name: &str) -> Value {
    serde_json::from_slice(&folder.read(name)).expect("JSON")
}

#[test]
fn layers_add_up_to_the_picture() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --layers all --seed 3");
    let image = exr(&folder, "out.exr");
    assert_eq!((image.picture.width, image.picture.height), (32, 18));
    let (ambient, left, right) = (
        colour(&image, "ambient"),
        colour(&image, "lamp.left"),
        colour(&image, "lamp.right"),
    );
    for (i, total) in image.picture.data.iter().enumerate() {
        for k in 0..3 {
            // Lamp layers are at 100 %, the picture has the right lamp at 25 %.
            let sum = ambient[i][k] + left[i][k] + 0.25 * right[i][k];
            assert!(
                (total[k] - sum).abs() < 1e-5 * sum,
                "{i} {k}: {} {sum}",
                total[k]
            );
        }
    }
    let Some(LayerData::Scalar(depth)) = image.layer("depth") else {
        panic!("no depth");
    };
    assert!(depth.iter().all(|depth_m| (depth_m - 1.5).abs() < 1e-6));
    let Some(LayerData::Vector(normals)) = image.layer("normal") else {
        panic!("no normals");
    };
    assert!(normals.iter().all(|normal| *normal == [-1.0, 0.0, 0.0]));
    // The colour of the scene file as the camera's three boxes see it by wavelength.
    let near = |value: &[f32; 3]| (0..3).all(|k| (value[k] - [0.5, 0.4, 0.3][k]).abs() < 0.02);
    let reflectance = colour(&image, "reflectance");
    assert!(reflectance.iter().all(|v| near(v) && *v == reflectance[0]));
    let lit = |name: &str| colour(&image, name).as_flattened().iter().sum::<f32>() > 0.0;
    for name in [
        "ambient",
        "lamp.left",
        "lamp.right",
        "direct",
        "backscatter",
        "variance",
    ] {
        assert!(lit(name), "{name}");
    }
    let transmittance = colour(&image, "transmittance");
    assert!(
        transmittance
            .as_flattened()
            .iter()
            .all(|share| *share > 0.0 && *share < 1.0)
    );
    assert_eq!(image.layers.len(), 11);
    let attribute = |name: &str| {
        let found = image.attributes.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    };
    assert_eq!(attribute("uw.seed"), Some("3"));
    assert_eq!(attribute("uw.samples_per_pixel"), Some("4"));
    assert_eq!(attribute("uw.version"), Some(env!("CARGO_PKG_VERSION")));
}

#[test]
fn only_the_layers_asked_for_are_written() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --layers lamp.right,depth");
    let image = exr(&folder, "out.exr");
    let names: Vec<&str> = image
        .layers
        .iter()
        .map(|layer| layer.name.as_str())
        .collect();
    assert_eq!(names, ["depth", "lamp.right"]);
}

#[test]
fn a_lamp_that_is_off_still_has_its_layer() {
    let folder = Folder::new();
    folder.write(
        "off.toml",
        SCENE.replace("level_pct = 25.0", "level_pct = 0.0"),
    );
    folder.good("render off.toml -o out.exr --layers lamps");
    assert!(
        colour(&exr(&folder, "out.exr"), "lamp.right")
            .iter()
            .flatten()
            .all(|value| *value > 0.0)
    );
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_the_threads() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o one.png --seed 5 --threads 1 --quiet");
    folder.good("render scene.toml -o two.png --seed 5 --threads 3");
    folder.good("render scene.toml -o other.png --seed 6");
    assert_eq!(folder.read("one.png"), folder.read("two.png"));
    assert_ne!(folder.read("one.png"), folder.read("other.png"));
    assert_eq!(
        folder.files(),
        ["one.png", "other.png", "scene.toml", "two.png"]
    );
}

#[test]
fn the_sensor_alone_gives_the_picture_that_a_render_gives() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.png --seed 5");
    folder.good("render scene.toml -o out.exr --seed 5");
    folder.good("sensor out.exr scene.toml -o again.png --seed 5");
    folder.good("sensor out.exr scene.toml -o noise.png --seed 6");
    assert_eq!(folder.read("again.png"), folder.read("out.png"));
    assert_ne!(folder.read("noise.png"), folder.read("out.png"));
    folder.good("render scene.toml -o out.tif --seed 5");
    let pixels = |name| read_frame(&folder.path(name)).expect("readable");
    assert_eq!(pixels("out.tif"), pixels("out.png"));
}

#[test]
fn statistics_tell_what_was_done() {
    let folder = Folder::with_scene();
    folder.good(
        "render scene.toml -o out.exr --backend cpu --spp 8 --seed 7 --threads 2 --stats out.json",
    );
    let stats = stats(&folder, "out.json");
    assert_eq!(stats["seed"], 7);
    assert_eq!(stats["backend"], "cpu");
    assert_eq!(stats["adapter"], Value::Null);
    assert_eq!(stats["threads"], 2);
    assert_eq!(stats["samples_per_pixel"], 8);
    // One walk for the lamps and one for the sky, per sample.
    assert!(
        stats["paths"]
            .as_u64()
            .is_some_and(|paths| paths >= 8 * 32 * 18),
        "{stats}"
    );
    assert!(stats["path_vertices"].as_u64() > stats["paths"].as_u64());
    for name in ["setup_s", "render_s", "cpu_s", "relative_error"] {
        assert!(
            stats[name].as_f64().is_some_and(|value| value > 0.0),
            "{name}: {stats}"
        );
    }
    assert_eq!(stats["needs"]["scattering"], true);
    assert_eq!(stats["needs"]["sun"], false);
    assert!(
        stats["skipped"]
            .as_array()
            .is_some_and(|skipped| skipped.contains(&"sun".into()))
    );
}

/// The same paths as in double precision.
#[test]
fn vector_units_render_on_request() {
    let folder = Folder::with_scene();
    let stats = ["cpu", "cpu-simd"].map(|backend| {
        folder.good(&format!(
            "render scene.toml -o out.exr --backend {backend} --spp 8 --stats stats.json"
        ));
        stats(&folder, "stats.json")
    });
    assert_eq!(stats[1]["backend"], "cpu-simd");
    assert_eq!(stats[1]["cut_paths"], 0);
    assert_eq!(stats[0]["paths"], stats[1]["paths"]);
}

/// A hardware GPU where there is one, else the processor's vector units.
#[test]
fn without_a_wish_the_fastest_of_the_processor_renders() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --spp 8 --stats stats.json");
    let stats = stats(&folder, "stats.json");
    let expected = if adapters().iter().any(|adapter| adapter.is_hardware()) {
        "gpu"
    } else {
        "cpu-simd"
    };
    assert_eq!(stats["backend"], expected);
}

/// It was a way of the path tracer that the kernels have replaced.
#[test]
fn the_option_to_share_walks_is_accepted_and_said_to_do_nothing() {
    let folder = Folder::with_scene();
    let pixels = ["--share-walks 8", ""].map(|option| {
        let run = folder.good(&format!(
            "render scene.toml -o out.exr {option} --stats out.json"
        ));
        let is_told = run.stderr.contains("--share-walks has no effect");
        assert_eq!(is_told, !option.is_empty(), "{}", run.stderr);
        assert_eq!(stats(&folder, "out.json")["share_walks"], 1);
        exr(&folder, "out.exr").picture.data
    });
    assert_eq!(pixels[0], pixels[1]);
}

#[test]
fn a_time_limit_and_a_target_error_end_a_render_without_a_number_of_samples() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --time-limit-s 0.5 --stats time.json");
    let by_time = stats(&folder, "time.json");
    assert!(by_time["samples_per_pixel"].as_u64() > Some(4), "{by_time}");
    let spent_s = ["setup_s", "render_s"].map(|name| by_time[name].as_f64().unwrap_or(0.0));
    assert!(spent_s.iter().sum::<f64>() >= 0.5, "{by_time}");
    folder.good("render scene.toml -o out.exr --target-error 0.1 --stats error.json");
    let by_error = stats(&folder, "error.json");
    assert!(
        by_error["relative_error"].as_f64() <= Some(0.1),
        "{by_error}"
    );
    assert!(
        by_error["samples_per_pixel"].as_u64() > Some(4),
        "{by_error}"
    );
}

#[test]
fn bounces_can_be_limited() {
    let folder = Folder::with_scene();
    let mean = |line: &str| {
        folder.good(&format!("render scene.toml -o out.exr --spp 16 {line}"));
        exr(&folder, "out.exr").picture.mean()
    };
    let (once, unlimited) = (mean("--max-bounces 1"), mean("--max-bounces 0"));
    for k in 0..3 {
        assert!(
            once[k] > 0.0 && once[k] < 0.99 * unlimited[k],
            "{once:?} {unlimited:?}"
        );
    }
}
