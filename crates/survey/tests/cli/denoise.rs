//! `uw render --denoise`: its label, what it does not go with, and what is said at the end.

use serde_json::Value;

use super::render::{colour, exr, stats};
use super::support::Folder;

fn attribute(folder: &Folder, file: &str, name: &str) -> Option<String> {
    let attributes = exr(folder, file).attributes;
    let found = attributes.into_iter().find(|(own, _)| own == name);
    found.map(|(_, value)| value)
}

/// The share of the picture that is not smooth: mean squared difference of neighbours over the mean square.
fn roughness(picture: &[[f32; 3]], width: usize) -> f64 {
    let (mut differences, mut squares) = (0.0, 0.0);
    for row in picture.chunks(width) {
        for pair in row.windows(2) {
            for k in 0..3 {
                differences += f64::from(pair[1][k] - pair[0][k]).powi(2);
                squares += f64::from(pair[0][k]).powi(2);
            }
        }
    }
    differences / squares
}

#[test]
fn a_denoised_picture_is_labelled_and_one_that_is_not_has_no_label() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o clean.exr --spp 4 --denoise --stats clean.json");
    folder.good("render scene.toml -o noisy.exr --spp 4 --stats noisy.json");
    let label = attribute(&folder, "clean.exr", "uw.denoised").expect("a label");
    assert!(label.contains("biased"), "{label}");
    let facts = stats(&folder, "clean.json");
    for (name, fact) in [
        ("uw.denoised_relative_error", "relative_error"),
        ("uw.denoised_relative_bias", "relative_bias"),
    ] {
        let text = attribute(&folder, "clean.exr", name).expect(name);
        let value: f64 = text.parse().expect("a number");
        assert_eq!(facts["denoised"][fact].as_f64(), Some(value), "{name}");
        assert!((0.0..0.5).contains(&value), "{name} {value}");
    }
    assert_eq!(facts["relative_error"], facts["denoised"]["relative_error"]);
    let before = facts["denoised"]["relative_error_before"].as_f64();
    assert!(facts["relative_error"].as_f64() < before, "{facts}");
    for name in ["uw.denoised", "uw.denoised_relative_error"] {
        assert_eq!(attribute(&folder, "noisy.exr", name), None);
    }
    assert_eq!(stats(&folder, "noisy.json")["denoised"], Value::Null);
    let rough = |file: &str| roughness(&exr(&folder, file).picture.data, 32);
    let (clean, noisy) = (rough("clean.exr"), rough("noisy.exr"));
    assert!(clean < 0.2 * noisy, "{clean} {noisy}");
}

#[test]
fn the_layers_that_are_asked_for_are_denoised_too() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o clean.exr --spp 4 --denoise --layers all");
    folder.good("render scene.toml -o noisy.exr --spp 4 --layers all");
    let (clean, noisy) = (exr(&folder, "clean.exr"), exr(&folder, "noisy.exr"));
    for layer in ["ambient", "lamp.left", "lamp.right", "backscatter"] {
        let of = |image| roughness(&colour(image, layer), 32);
        let (clean, noisy) = (of(&clean), of(&noisy));
        assert!(clean < 0.5 * noisy, "{layer}: {clean} {noisy}");
    }
    // What is known without noise is what it was.
    assert_eq!(colour(&clean, "reflectance"), colour(&noisy, "reflectance"));
}

#[test]
fn the_last_line_tells_the_estimated_error() {
    let folder = Folder::with_scene();
    let line = "render scene.toml -o out.exr --spp 4 --denoise";
    let run = folder.good(line);
    let lines: Vec<&str> = run.stderr.lines().collect();
    let expected = "out.exr: 32 × 18 pixels, 4 samples per pixel, denoised (biased), estimated relative error ";
    assert_eq!(lines.len(), 1, "{}", run.stderr);
    let rest = lines[0].strip_prefix(expected).expect(lines[0]);
    let percent: f64 = rest
        .split(" %")
        .next()
        .expect("a number")
        .parse()
        .expect(rest);
    let object: Value =
        serde_json::from_str(&folder.good(&format!("--json {line}")).stdout).expect("JSON");
    let error = object["denoised"]["relative_error"].as_f64();
    assert!(
        (percent / (100.0 * error.expect("an error")) - 1.0).abs() < 0.05,
        "{percent} {error:?}"
    );
    // More samples are not foretold: the error does not fall with their square root.
    assert_eq!(object["ahead"], Value::Null);
}

#[test]
fn what_does_not_go_with_denoising_is_refused_and_nothing_is_written() {
    let folder = Folder::with_scene();
    for (options, said) in [
        ("--spp 5", "must be even and at least 2, got 5"),
        ("--spp 1", "must be even and at least 2, got 1"),
        ("--spp 4 --target-error 5%", "--target-error"),
    ] {
        let run = folder.uw(&format!("render scene.toml -o out.exr --denoise {options}"));
        assert_eq!(run.code, Some(2), "{options}: {}", run.stderr);
        assert!(run.stderr.contains("--denoise"), "{}", run.stderr);
        assert!(run.stderr.contains(said), "{options}: {}", run.stderr);
    }
    assert_eq!(folder.files(), ["scene.toml"]);
}

#[test]
fn a_time_limit_is_halved_and_one_that_is_too_short_is_an_error() {
    let folder = Folder::with_scene();
    folder.good("render scene.toml -o out.exr --denoise --time-limit-s 1 --stats out.json");
    let facts = stats(&folder, "out.json");
    assert_eq!(facts["samples_per_pixel"].as_u64().map(|n| n % 2), Some(0));
    assert!(facts["denoised"]["relative_error"].as_f64() > Some(0.0));
    let huge = "render scene.toml -o huge.exr --denoise --time-limit-s 0.2 --width 8000";
    let run = folder.uw(huge);
    assert_ne!(run.code, Some(0));
    assert!(
        run.stderr.contains("give more time or a smaller picture"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.files(), ["out.exr", "out.json", "scene.toml"]);
}
