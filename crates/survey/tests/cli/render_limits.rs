//! Time limits that are too short for a picture, and pictures that are none.

use uw_render::gpu::{GpuError, adapters, skipped::skip_test};
use uw_render::image::read_frame;

use super::render::{colour, exr, stats};
use super::support::{Folder, SCENE};

/// A scene whose first round over all pixels takes a minute or more.
fn large(folder: &Folder) {
    let text = SCENE
        .replace("width = 32", "width = 1600")
        .replace("height = 18", "height = 900")
        .replace("\"IB\"", "\"9C\"");
    folder.write("large.toml", text);
}

fn backends() -> Vec<&'static str> {
    let mut backends = vec!["cpu", "cpu-simd"];
    if adapters().is_empty() {
        skip_test(&GpuError::no_adapter());
    } else {
        backends.push("gpu");
    }
    backends
}

#[test]
fn where_the_time_does_not_last_the_whole_picture_is_there_and_coarse() {
    let folder = Folder::new();
    large(&folder);
    folder.good("render large.toml -o plain.exr --width 80 --spp 64 --backend cpu");
    let plain = exr(&folder, "plain.exr").picture.mean();
    for backend in backends() {
        let run = folder.good(&format!(
            "render large.toml -o out.exr --time-limit-s 0.5 --backend {backend} --layers all --stats out.json"
        ));
        assert!(
            run.stderr.contains("warning: 0.5 s did not last")
                && run.stderr.contains("1440000 pixels show a coarse"),
            "{backend}: {}",
            run.stderr
        );
        let stats = stats(&folder, "out.json");
        assert_eq!(stats["filled_pixels"], 1_440_000, "{backend}: {stats}");
        assert_eq!(stats["samples_per_pixel"], 0, "{backend}: {stats}");
        assert_eq!(stats["backend"], backend);
        assert!(
            stats["coarse_step_px"].as_u64() >= Some(2),
            "{backend}: {stats}"
        );
        assert!(
            stats["coarse_samples"].as_u64() >= Some(4),
            "{backend}: {stats}"
        );
        let image = exr(&folder, "out.exr");
        assert_eq!((image.picture.width, image.picture.height), (1600, 900));
        // A coarse picture is not a biased one: its mean is that of the view.
        let mean = image.picture.mean();
        for k in 0..3 {
            assert!(
                (mean[k] / plain[k] - 1.0).abs() < 0.1,
                "{backend}: {mean:?} {plain:?}"
            );
        }
        let variance = colour(&image, "variance");
        assert!(
            variance.iter().flatten().all(|v| *v == f32::INFINITY),
            "{backend}"
        );
        let lit = colour(&image, "lamp.right");
        assert!(
            lit.iter().flatten().all(|v| v.is_finite() && *v >= 0.0),
            "{backend}"
        );
    }
    folder.good("render large.toml -o out.png --time-limit-s 0.5");
    assert_eq!(
        read_frame(&folder.path("out.png"))
            .expect("a picture")
            .width,
        1600
    );
}

/// A limit that is not reached changes nothing, not one bit.
#[test]
fn with_enough_time_a_limit_changes_nothing() {
    let folder = Folder::with_scene();
    for backend in backends() {
        let line =
            format!("render scene.toml --width 256 --spp 8 --backend {backend} --layers variance");
        folder.good(&format!("{line} -o plain.exr"));
        folder.good(&format!(
            "{line} -o limited.exr --time-limit-s 1000 --stats out.json"
        ));
        let [plain, limited] = ["plain.exr", "limited.exr"].map(|name| exr(&folder, name));
        assert_eq!(plain.picture, limited.picture, "{backend}");
        assert_eq!(plain.layers, limited.layers, "{backend}");
        let stats = stats(&folder, "out.json");
        assert_eq!(stats["filled_pixels"], 0, "{backend}: {stats}");
        assert_eq!(
            stats["coarse_step_px"],
            serde_json::Value::Null,
            "{backend}: {stats}"
        );
    }
}

/// A disk so small and bright that single precision, in which pictures are written, cannot hold its radiance.
#[test]
fn a_picture_with_a_value_that_is_no_number_is_an_error() {
    let folder = Folder::new();
    let (_, camera) = SCENE.split_once("[camera]").expect("a camera");
    let (camera, _) = camera.split_once("[[lamp]]").expect("lamps");
    folder.write(
        "bright.toml",
        format!(
            "format = \"uw-scene/1\"\n[camera]{camera}[[lamp]]\nname = \"spark\"\nposition_m = [1e-16, 0.0, 0.0]\n\
             forward = [-1.0, 0.0, 0.0]\nintensity = [1e12, 1e12, 1e12]\nhalf_angle_deg = 90.0\nradius_m = 1e-14\n"
        ),
    );
    for backend in ["auto", "cpu"] {
        for output in ["out.exr", "out.png"] {
            let line = format!(
                "render bright.toml -o {output} --spp 4 --backend {backend} --stats out.json"
            );
            let run = folder.uw(&line);
            assert_eq!(run.code, Some(1), "{line}: {}", run.stderr);
            assert!(
                run.stderr.contains("pixels are no finite numbers")
                    && run.stderr.contains("column 0, row 0")
                    && run.stderr.contains("layer lamp.spark"),
                "{line}: {}",
                run.stderr
            );
            assert_eq!(folder.files(), ["bright.toml"], "{line}");
        }
    }
    // Kernels leave such light out, which is no better.
    let run = folder.uw("render bright.toml -o out.exr --spp 4 --backend cpu-simd");
    assert_eq!(run.code, Some(1), "{}", run.stderr);
    assert!(
        run.stderr
            .contains("contributions of light are no finite numbers")
            && run.stderr.contains("--backend cpu"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.files(), ["bright.toml"]);
}
