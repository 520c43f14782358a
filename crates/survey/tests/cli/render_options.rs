//! What `uw render` says of a finished picture, and what the command line changes in a scene.

use serde_json::Value;

use super::render::{colour, exr, stats};
use super::support::{Folder, SCENE};

#[test]
fn a_finished_picture_is_told_in_one_line() {
    let folder = Folder::with_scene();
    let run = folder.good("render scene.toml -o out.png --spp 8");
    let lines: Vec<&str> = run.stderr.lines().collect();
    assert_eq!(
        (lines.len(), run.stdout.as_str()),
        (1, ""),
        "{}",
        run.stderr
    );
    let expected = "out.png: 32 × 18 pixels, 8 samples per pixel, relative error ";
    assert!(lines[0].starts_with(expected), "{}", lines[0]);
    assert!(lines[0].contains(" s"), "{}", lines[0]);
    let silent = folder.good("render scene.toml -o out.png --spp 8 --quiet");
    assert_eq!((silent.stderr.as_str(), silent.stdout.as_str()), ("", ""));
}

#[test]
fn what_a_smaller_error_would_take_is_foretold() {
    let folder = Folder::with_scene();
    let told = |line: &str| -> Value {
        let run = folder.good(&format!("--json render scene.toml -o out.exr {line}"));
        assert_eq!(run.stderr, "");
        serde_json::from_str(&run.stdout).expect("one JSON object")
    };
    let rough = told("--spp 8");
    let error = rough["relative_error"].as_f64().expect("an error");
    assert!(error > 0.05, "the scene has become easy: {rough}");
    let factor = (error / 0.05).powi(2);
    assert_eq!(
        rough["ahead"]["samples_per_pixel"].as_f64(),
        Some((8.0 * factor).ceil())
    );
    assert_eq!(rough["ahead"]["relative_error"], 0.05);
    assert!(rough["ahead"]["seconds"].as_f64() > Some(0.0));
    assert_eq!(rough["file"], "out.exr");
    assert_eq!(
        (&rough["width_px"], &rough["height_px"]),
        (&32.into(), &18.into())
    );
    // A single batch knows no error, and a good picture needs no more.
    assert_eq!(told("--spp 1")["ahead"], Value::Null);
    let good = told("--target-error 4% --time-limit-s 100");
    assert!(good["relative_error"].as_f64() <= Some(0.04), "{good}");
    assert_eq!(good["ahead"], Value::Null);
}

#[test]
fn numbers_can_be_written_as_people_do() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --spp 1e1 --stats out.json");
    assert_eq!(stats(&folder, "out.json")["samples_per_pixel"], 10);
    folder.good("render scene.toml -o out.exr --target-error 10% --stats out.json");
    let error = stats(&folder, "out.json")["relative_error"].as_f64();
    assert!(error <= Some(0.1) && error > Some(0.0), "{error:?}");
    let run = folder.good("render scene.toml -o out.exr --target-error 5");
    assert!(
        run.stderr
            .contains("warning: --target-error 5 is an error of 500 %"),
        "{}",
        run.stderr
    );
}

/// The transmittance to the target is without noise and depends on where each pixel looks.
#[test]
fn pictures_of_another_size_show_the_same_view() {
    let folder = Folder::with_scene();
    let mean = |line: &str, size: (u32, u32)| {
        folder.good(&format!(
            "render scene.toml -o out.exr --spp 1 --layers transmittance {line}"
        ));
        let image = exr(&folder, "out.exr");
        assert_eq!((image.picture.width, image.picture.height), size, "{line}");
        let values = colour(&image, "transmittance");
        values.iter().map(|v| f64::from(v[0])).sum::<f64>() / values.len() as f64
    };
    let own = mean("", (32, 18));
    for (line, size) in [
        ("--width 128", (128, 72)),
        ("--height 72", (128, 72)),
        ("--set camera.width=128 --set camera.height=72", (128, 72)),
    ] {
        let other = mean(line, size);
        assert!((other / own - 1.0).abs() < 2e-3, "{line}: {other} {own}");
    }
    // More of the target above and below, at the same horizontal field of view: a longer way on average.
    assert!(mean("--width 32 --height 32", (32, 32)) < 0.999 * own);
}

#[test]
fn a_setting_is_as_good_as_a_line_of_the_file() {
    let folder = Folder::with_scene();
    let edited = SCENE
        .replace("jerlov = \"IB\"", "jerlov = \"3C\"")
        .replace("level_pct = 25.0", "level_pct = 75.0");
    folder.write("edited.toml", edited);
    let settings = "--set water.jerlov=3C --set lamp.right.level_pct=75";
    folder.good(&format!(
        "render scene.toml -o set.exr {settings} --stats set.json"
    ));
    folder.good("render edited.toml -o edited.exr --stats edited.json");
    let [set, edited] = ["set.exr", "edited.exr"].map(|name| exr(&folder, name));
    assert_eq!(set.picture, edited.picture);
    let attribute = |image: &uw_render::image::ExrImage| {
        let found = image
            .attributes
            .iter()
            .find(|(name, _)| name == "uw.changes");
        found.map(|(_, value)| value.clone())
    };
    assert_eq!(attribute(&set), Some(settings.to_owned()));
    assert_eq!(attribute(&edited), None);
    let changes = ["--set water.jerlov=3C", "--set lamp.right.level_pct=75"];
    assert_eq!(
        stats(&folder, "set.json")["changes"],
        serde_json::json!(changes)
    );
    assert_eq!(
        stats(&folder, "edited.json")["changes"],
        serde_json::json!([])
    );
}
