use super::*;
use crate::noise::NoiseSource;
use serde_json::{Value, json};
use std::fs;

fn profile() -> Profile {
    Profile::from_json(&document()).unwrap()
}

fn document() -> Value {
    json!({
        "format": "uw-profile/1", "unit": "8-bit counts",
        "depth": [
            {"depth_m": 0.5, "k_z": [1, 1, 1]},
            {"depth_m": 2.5, "k_z": [0.1, 0.612_345_678_901_234_6, 0.55]}],
        "contrast_on": [
            {"distance_m": 0.5, "k_c": [17.2, 18.1, 14.0]},
            {"distance_m": 3.0, "k_c": [1.0, 4.0, 2.0]}],
        "contrast_off": [
            {"distance_m": 0.4, "k_c": [8.6, 9.1, 7.2]},
            {"distance_m": 2.0, "k_c": [2.6, 5.1, 3.2]},
            {"distance_m": 2.5, "k_c": [2.0, 5.0, 3.0]}],
        "source": {"made_by": "uw calibrate 0.1.0", "images": 24}
    })
}

#[test]
fn round_trip_keeps_every_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("profile.json");
    profile().write(&path).unwrap();
    assert_eq!(Profile::read(&path).unwrap(), profile());
    assert_eq!(
        fs::read_dir(dir.path()).unwrap().count(),
        1,
        "no part file is left behind"
    );
}

#[test]
fn the_depth_of_the_contrasts_is_kept_where_it_is_known() {
    assert_eq!(profile().contrast_depth_m(), None);
    assert_eq!(profile().beyond_contrast_depth_m(9.0), None);
    assert!(!profile().to_json().contains("contrast_depth_m"));
    let known = profile().with_contrast_depth([2.0, 2.4]).unwrap();
    let again = Profile::from_json(&serde_json::from_str(&known.to_json()).unwrap()).unwrap();
    assert_eq!(again, known);
    assert_eq!(again.contrast_depth_m(), Some([2.0, 2.4]));
    let beyond = [1.5, 2.0, 2.2, 2.9].map(|z| known.beyond_contrast_depth_m(z).unwrap());
    for (got, expected) in beyond.into_iter().zip([0.5, 0.0, 0.0, 0.5]) {
        assert!((got - expected).abs() < 1e-12, "{beyond:?}");
    }
    for (wrong, told) in [
        (json!([3.0, 2.0]), "contrast_depth_m"),
        (json!([-1.0, 2.0]), "contrast_depth_m"),
        (json!([1.0]), "contrast_depth_m"),
        (json!(3.0), "contrast_depth_m"),
    ] {
        let mut document = document();
        document["contrast_depth_m"] = wrong;
        let error = Profile::from_json(&document).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn contrasts_without_noise_are_kept_beside_the_published_ones() {
    assert_eq!(profile().corrected(), None);
    assert!(!profile().to_json().contains("noise_corrected"));
    let sample = |distance_m, at: f64| CorrectedSample {
        distance_m,
        k_c: [at, at + 1.0 / 3.0, -0.1],
        floor: [0.25, 0.3, 0.4],
    };
    let known = profile()
        .with_corrected(Corrected {
            source: NoiseSource::Sensor,
            on: vec![sample(0.5, 16.0), sample(3.0, 0.2)],
            off: vec![sample(0.4, 8.0)],
        })
        .unwrap();
    let again = Profile::from_json(&serde_json::from_str(&known.to_json()).unwrap()).unwrap();
    assert_eq!(again, known);
    assert_eq!(again.contrast_on(), profile().contrast_on());
    let good = json!({"source": "picture", "on": [{"distance_m": 1.0, "k_c": [1, 2, 3], "floor": [0, 0, 0]}], "off": []});
    for (pointer, wrong, told) in [
        ("/source", json!("guess"), "noise_corrected.source"),
        ("/on/0/floor/1", json!(-1), "noise_corrected.on[0].floor"),
        (
            "/on/0/distance_m",
            json!(0),
            "noise_corrected.on[0].distance_m",
        ),
        ("/on/0/k_c", json!([1, 2]), "noise_corrected.on[0].k_c"),
        ("/off", json!(1), "noise_corrected.off"),
    ] {
        let mut document = document();
        document["noise_corrected"] = good.clone();
        assert!(Profile::from_json(&document).is_ok());
        *document["noise_corrected"].pointer_mut(pointer).unwrap() = wrong;
        let error = Profile::from_json(&document).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn a_failed_write_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("taken");
    fs::create_dir(&target).unwrap();
    assert!(matches!(
        profile().write(&target),
        Err(ProfileError::Write { .. })
    ));
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn values_between_samples_are_linear_and_those_at_samples_exact() {
    let p = profile();
    assert_eq!(p.k_z(0.5).unwrap(), [1.0; 3]);
    assert!((p.k_z(1.0).unwrap()[0] - 0.775).abs() < 1e-12);
    assert!((p.k_c_off(1.2).unwrap()[1] - 7.1).abs() < 1e-12);
    assert_eq!(p.k_c_off(2.5).unwrap(), [2.0, 5.0, 3.0]);
    assert_eq!(p.distance_range_m(), (0.5, 2.5));
}

#[test]
fn outside_the_samples_there_is_no_value() {
    let error = profile().k_z(40.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "depth_m must be between 0.5 and 2.5 m (calibrated), got 40"
    );
    for distance_m in [0.49, 3.01, f64::NAN] {
        assert!(profile().k_c_on(distance_m).is_err());
    }
}

#[test]
fn wrong_files_are_refused_with_the_field() {
    let cases: [(&str, Value, &str); 9] = [
        (
            "/format",
            json!("uw-profile/2"),
            "format must be \"uw-profile/1\"",
        ),
        ("/unit", json!("percent"), "unit must be \"8-bit counts\""),
        (
            "/depth/1/depth_m",
            json!(0.5),
            "depth[1].depth_m must be greater than",
        ),
        (
            "/depth/1/depth_m",
            json!("2.5"),
            "depth[1].depth_m must be a finite number",
        ),
        (
            "/contrast_on/0/k_c",
            json!([1, 2]),
            "contrast_on[0].k_c must be an array of 3",
        ),
        (
            "/contrast_on/0/k_c/2",
            json!(-1),
            "contrast_on[0].k_c[2] must be finite and >= 0",
        ),
        (
            "/contrast_off",
            json!([]),
            "contrast_off must be at least one sample",
        ),
        (
            "/source/images",
            json!(1.5),
            "source.images must be a whole number",
        ),
        (
            "/contrast_off/0",
            json!({"distance": 1, "k_c": [1, 1, 1]}),
            "did you mean distance_m?",
        ),
    ];
    for (pointer, value, expected) in cases {
        let mut wrong = document();
        *wrong.pointer_mut(pointer).unwrap() = value;
        let message = Profile::from_json(&wrong).unwrap_err().to_string();
        assert!(message.contains(expected), "{pointer}: {message}");
    }
}

#[test]
fn a_model_file_is_called_one() {
    let model = json!({"format": "uw-mlp", "version": 1, "layers": []});
    let error = Profile::from_json(&model).expect_err("a model").to_string();
    assert!(
        error
            .contains("\"uw-profile/1\" (a calibration profile), got \"uw-mlp\" (a trained model)"),
        "{error}"
    );
}
