//! `uw stats`, `uw calibrate` and `uw assets`.

use std::fs;

use image::{Rgb, RgbImage};
use serde_json::Value;
use uw_render::image::{ExrImage, Picture};

use super::support::{Folder, SCENE, shipped};

/// A picture whose columns alternate between two levels: the mean lies between, the contrast is half their distance.
fn stripes(folder: &Folder, name: &str, low: [u8; 3], high: [u8; 3]) {
    let picture = RgbImage::from_fn(40, 24, |x, _| Rgb(if x % 2 == 0 { low } else { high }));
    picture.save(folder.path(name)).expect("writable");
}

#[test]
fn statistics_are_those_tabulated_for_the_picture() {
    let data = shipped("calib/tests/data");
    let tabulated: Value =
        serde_json::from_slice(&fs::read(data.join("image_stats.json")).expect("table"))
            .expect("JSON");
    let folder = Folder::new();
    for name in ["s2_turbid", "s3_lamp"] {
        fs::copy(
            data.join(format!("{name}.png")),
            folder.path(&format!("{name}.png")),
        )
        .expect("copied");
    }
    let run = folder.good("stats --json s2_turbid.png s3_lamp.png");
    let list: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(list.as_array().map(Vec::len), Some(2));
    for (index, name) in ["s2_turbid", "s3_lamp"].into_iter().enumerate() {
        let (got, expected) = (&list[index], &tabulated["images"][name]);
        assert_eq!(got["file"], format!("{name}.png"));
        assert_eq!((&got["width"], &got["height"]), (&1280.into(), &720.into()));
        for k in 0..3 {
            for (field, in_table) in [("contrast", "patch_std_mean_rgb"), ("mean", "mean_rgb")] {
                let (got, expected) = (got[field][k].as_f64(), expected[in_table][k].as_f64());
                let (got, expected) = (got.expect("number"), expected.expect("number"));
                // The table is printed with ten digits.
                assert!(
                    (got - expected).abs() < 1e-7,
                    "{name} {field} {k}: {got} {expected}"
                );
            }
        }
    }
}

#[test]
fn statistics_for_people_are_a_table() {
    let folder = Folder::new();
    stripes(&folder, "a.png", [10, 20, 30], [20, 20, 40]);
    let table = folder.good("stats a.png").stdout;
    let words: Vec<&str> = table
        .lines()
        .nth(1)
        .expect("a row")
        .split_whitespace()
        .collect();
    // Contrast and mean first; then what is noise and what is clipped.
    assert_eq!(
        words[..10],
        [
            "a.png", "40", "x", "24", "5.000", "0.000", "5.000", "15.000", "20.000", "35.000"
        ]
    );
}

/// What is noise is told from differences of pixels, or from what is known of the camera.
#[test]
fn statistics_tell_noise_from_detail() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("a = 1e-3, b = 1e-5", "a = 0, b = 1e-5"),
    );
    // A black picture and an even grey one, through the sensor of the scene.
    for (name, level) in [("black", 0.0), ("grey", 0.2_f32)] {
        let picture = Picture {
            data: vec![[level; 3]; 400 * 240],
            ..Picture::black(400, 240)
        };
        let image = ExrImage::new(picture);
        image
            .write(&folder.path(&format!("{name}.exr")))
            .expect("written");
        folder.good(&format!(
            "sensor {name}.exr scene.toml -o {name}.png --seed 3"
        ));
    }
    for noise in ["", " --noise-a 0 --noise-b 1e-5"] {
        let run = folder.good(&format!("stats --json black.png grey.png{noise}"));
        let list: Value = serde_json::from_str(&run.stdout).expect("JSON");
        for picture in list.as_array().expect("a list") {
            let number = |field: &str| picture[field][1].as_f64().expect("a number");
            assert!(number("contrast") > 0.6, "{picture}");
            assert!(
                number("contrast_corrected") <= number("noise_floor"),
                "{picture}"
            );
            assert!(
                number("noise_floor") < 0.5 * number("contrast"),
                "{picture}"
            );
            assert!(
                (number("noise") / number("contrast") - 1.0).abs() < 0.04,
                "{picture}"
            );
            assert_eq!(number("saturated"), 0.0);
            let told = picture["warnings"][0].as_str().expect("a warning");
            assert!(
                told.starts_with("R, G, B: contrast is at the noise floor"),
                "{told}"
            );
            let source = if noise.is_empty() {
                "picture"
            } else {
                "sensor"
            };
            assert_eq!(picture["noise_source"], source);
        }
        // The sensor's black is 0: half of the noise is clipped.
        assert!(
            list[0]["black"][1]
                .as_f64()
                .is_some_and(|share| share > 0.5)
        );
    }
    let told = folder.good("stats black.png").stderr;
    assert!(
        told.contains("black.png: R, G, B: contrast is at the noise floor"),
        "{told}"
    );
    folder.refused("stats black.png --noise-a 1e-3", &["--noise-b"]);
    folder.refused(
        "stats black.png --noise-a -1e-3 --noise-b 0",
        &["--noise-a and --noise-b must be finite and >= 0, got -0.001 and 0"],
    );
}

#[test]
fn a_manifest_becomes_a_profile() {
    let folder = Folder::new();
    stripes(&folder, "up_1.png", [100; 3], [100; 3]);
    stripes(&folder, "up_3.png", [20, 40, 50], [20, 40, 50]);
    stripes(&folder, "on.png", [40; 3], [60, 64, 68]);
    stripes(&folder, "off.png", [40; 3], [44, 46, 48]);
    folder.write(
        "manifest.csv",
        "file,kind,depth_m,distance_m,light_pct\n\
         up_3.png,depth,3,,0\nup_1.png,depth,1,,0\non.png,contrast,,1.5,80\noff.png,contrast,,1.5,0\n",
    );
    folder.good("calibrate manifest.csv -o profile.json");
    let profile: Value = serde_json::from_slice(&folder.read("profile.json")).expect("JSON");
    assert_eq!(profile["format"], "uw-profile/1");
    assert_eq!(
        profile["depth"][0],
        serde_json::json!({"depth_m": 1.0, "k_z": [1.0, 1.0, 1.0]})
    );
    assert_eq!(
        profile["depth"][1],
        serde_json::json!({"depth_m": 3.0, "k_z": [0.2, 0.4, 0.5]})
    );
    assert_eq!(
        profile["contrast_on"][0],
        serde_json::json!({"distance_m": 1.5, "k_c": [10.0, 12.0, 14.0]})
    );
    assert_eq!(
        profile["contrast_off"][0],
        serde_json::json!({"distance_m": 1.5, "k_c": [2.0, 3.0, 4.0]})
    );
    // Without noise there is nothing to take off.
    let corrected = &profile["noise_corrected"];
    assert_eq!(corrected["source"], "picture");
    assert_eq!(
        corrected["on"][0]["k_c"],
        serde_json::json!([10.0, 12.0, 14.0])
    );
    assert_eq!(profile["source"]["images"], 4);
    assert!(
        profile["source"]["made_by"]
            .as_str()
            .is_some_and(|name| name.starts_with("uw calibrate "))
    );
}

#[test]
fn scenery_is_made_in_the_folder_asked_for() {
    let folder = Folder::new();
    let run = folder.good("assets -o made --main-texture-px 16 --texture-px 16");
    assert!(run.stdout.lines().count() >= 4);
    for line in run.stdout.lines() {
        assert!(
            line.starts_with("made") && folder.path(line).is_file(),
            "{line}"
        );
    }
    assert!(folder.path("made/scenes/ship_hull.glb").is_file());
}

/// A JPEG, and a picture with less noise than its camera makes, are told; neither fails.
#[test]
fn pictures_that_were_compressed_or_denoised_are_warned_of() {
    let folder = Folder::new();
    let even = RgbImage::from_fn(160, 96, |x, y| Rgb([(90 + x / 4 + y / 8) as u8; 3]));
    even.save(folder.path("a.png")).expect("writable");
    even.save(folder.path("b.jpg")).expect("writable");
    let plain = folder.good("stats a.png b.jpg");
    assert_eq!(plain.stderr.matches("a JPEG of quality 75").count(), 1);
    assert!(!plain.stderr.contains("denoised"), "{}", plain.stderr);
    let known = folder.good("stats a.png --noise-a 1e-3 --noise-b 1e-5");
    assert!(
        known.stderr.contains("R, G, B: the noise is"),
        "{}",
        known.stderr
    );
    let list = folder.good("stats --json b.jpg").stdout;
    let list: Value = serde_json::from_str(&list).expect("JSON");
    assert_eq!(list[0]["jpeg_quality"], 75);
    let told = list[0]["warnings"].to_string();
    assert!(told.contains("a JPEG of quality 75"), "{told}");
}
