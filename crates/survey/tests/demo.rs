//! The demonstration, as a newcomer runs it.

use std::process::Command;

use uw_calib::Profile;
use uw_guidance::advice::predict;
use uw_guidance::physics::WaterFile;
use uw_guidance::{Candidate, Model, Objective, Observation};

#[test]
fn the_whole_way_gives_pictures_a_profile_and_suggestions_inside_the_calibration() {
    let folder = tempfile::tempdir().expect("folder");
    let output = Command::new(env!("CARGO_BIN_EXE_uw"))
        .args(["demo", "--jerlov", "IB", "-o"])
        .arg(folder.path())
        .output()
        .expect("the program runs");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    let text = std::fs::read_to_string(folder.path().join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let visits = report["visits"].as_array().expect("a list");
    assert_eq!(visits.len(), 3);
    for visit in visits {
        let number = |name: &str| visit[name].as_f64().expect("a number");
        assert!(
            (0.5..=3.0).contains(&number("suggested_distance_m")),
            "{visit}"
        );
        assert!(
            (0.0..=100.0).contains(&number("suggested_light_pct")),
            "{visit}"
        );
        assert!(number("score") >= number("score_here"), "{visit}");
        for k in 0..3 {
            let rendered = visit["rendered_contrast"][k].as_f64().expect("a number");
            assert!(rendered > 0.0 && rendered < 128.0, "{visit}");
        }
        let depth = &visit["depth_m"].to_string().replace(".0", "");
        for when in ["before", "after"] {
            assert!(
                folder
                    .path()
                    .join(format!("depth_{depth}m_{when}.png"))
                    .is_file(),
                "{depth} {when}"
            );
        }
    }
    for file in [
        "depth_1m.png",
        "report.md",
        "profile.json",
        "contrast.png",
        "contrast.svg",
        "calibration/manifest.csv",
    ] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    let told = std::fs::read_to_string(folder.path().join("report.md")).expect("a report");
    for words in [
        "**K_z**",
        "**K_c**",
        "**Score**",
        "A pilot would",
        "**Why.**",
        "`uw stats`",
        "depth_1m.png",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    // Two pictures beside each other, with a line above them.
    let (one, both) = ("depth_1m_before.png", "depth_1m.png");
    let size = |name: &str| image::image_dimensions(folder.path().join(name)).expect("a picture");
    assert!(size(both).0 >= size(one).0 && size(both).1 < size(one).1);
    // The written pictures make a profile, too, through the command that users have.
    let profile = folder.path().join("from_pictures.json");
    let status = Command::new(env!("CARGO_BIN_EXE_uw"))
        .arg("calibrate")
        .arg(folder.path().join("calibration/manifest.csv"))
        .arg("-o")
        .arg(&profile)
        .status()
        .expect("the program runs");
    assert!(status.success() && profile.is_file());
}

#[test]
fn bad_arguments_are_refused_before_the_first_step_and_folders_of_others_left_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let here = |name: &str| folder.path().join(name).display().to_string();
    let text = folder.path().join("others/notes.txt");
    std::fs::create_dir(here("others")).expect("made");
    std::fs::write(&text, "mine").expect("written");
    std::fs::write(here("model.json"), "{}").expect("written");
    let cases: [(&[&str], &str); 8] = [
        (&["--jerlov", "3c"], "--jerlov"),
        (&["--jerlov", "IB-II@2"], "[0, 1]"),
        (&["--backscatter-fraction", "0.6"], "backscatter_fraction"),
        (&["--backscatter-fraction", "nan"], "backscatter_fraction"),
        (&["--target", "ship"], "--target"),
        (&["--model", &here("none.json")], "none.json"),
        (&["--model", &here("model.json")], "model.json"),
        (&["--threads", "0"], "--threads"),
    ];
    let refused = |arguments: &[&str], output: &str, words: &str| {
        let run = Command::new(env!("CARGO_BIN_EXE_uw"))
            .args(["demo", "-o", output])
            .args(arguments)
            .output()
            .expect("the program runs");
        let told = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{arguments:?} {output}: {told}");
        assert!(told.contains(words), "{words}: {told}");
        assert!(!told.contains("1/4"), "{told}");
    };
    for (arguments, words) in cases {
        refused(arguments, &here("new"), words);
        assert!(!folder.path().join("new").exists(), "{arguments:?}");
    }
    refused(&[], &here("others"), "no demonstration's");
    refused(&[], &here("others/notes.txt"), "must be a folder");
    refused(&[], &here("others/notes.txt/below"), "cannot be written to");
    assert_eq!(std::fs::read_to_string(&text).expect("still there"), "mine");
    assert_eq!(
        std::fs::read_dir(here("others"))
            .expect("still there")
            .count(),
        1
    );
}

#[test]
fn every_shipped_profile_goes_with_the_shipped_model() {
    let assets = uw_assets::assets_dir().expect("assets");
    let model = Model::read(uw_assets::DEFAULT_MODEL.as_ref()).expect("a model");
    let mut names = Vec::new();
    for path in uw_assets::SMALL.list(&assets.join("profiles")) {
        if path.extension().is_none_or(|e| e != "json") {
            continue;
        }
        let profile = Profile::read(&path).expect("a profile");
        assert_eq!(profile.depth_range_m(), (0.5, 6.0), "{}", path.display());
        assert_eq!(profile.distance_range_m(), (0.5, 3.0), "{}", path.display());
        assert_eq!(profile.rig(), &model.card().rig, "{}", path.display());
        // What a vehicle sees there with the lamps off, as the profile says.
        let observation = Observation {
            depth_m: 3.0,
            distance_m: 1.5,
            light_pct: 0.0,
            mean: [60.0; 3],
            std: profile.k_c_off(1.5).expect("inside"),
            quality: None,
        };
        let candidates = [(1.0, 0.0), (2.0, 100.0)].map(|(distance_m, light_pct)| Candidate {
            distance_m,
            light_pct,
        });
        let objective = Objective::default();
        let found = predict(&observation, &candidates, &profile, &model, &objective);
        let found = found.expect("a prediction");
        assert!(
            found
                .contrast
                .iter()
                .flatten()
                .all(|c| (-0.5..60.0).contains(c)),
            "{}: {found:?}",
            path.display()
        );
        names.push(path.file_stem().expect("a name").display().to_string());
    }
    names.sort();
    assert_eq!(names, ["1C", "5C", "9C", "IB", "III"]);
}

/// A camera of which no shipped model is: the water is fitted to the calibration's pictures, and physics predicts what is rendered then.
#[test]
fn another_camera_is_advised_by_physics_in_the_water_of_its_own_pictures() {
    let folder = tempfile::tempdir().expect("folder");
    let vehicle = folder.path().join("mine.toml");
    let text = "format = \"uw-vehicle/1\"\nwidth = 480\nheight = 270\nhfov_deg = 52.0\nexposure = 3.0\nnoise_a = 2e-4\nnoise_b = 4e-6\n";
    std::fs::write(&vehicle, text).expect("written");
    let demo = folder.path().join("demo");
    let output = Command::new(env!("CARGO_BIN_EXE_uw"))
        .args([
            "demo",
            "--jerlov",
            "3C",
            "--target",
            "concrete_pier",
            "--vehicle",
        ])
        .arg(&vehicle)
        .arg("-o")
        .arg(&demo)
        .output()
        .expect("the program runs");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(told.contains("another camera or lamps"), "{told}");
    let text = std::fs::read_to_string(demo.join("report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(report["model"], "water.json");
    WaterFile::read(&demo.join("water.json")).expect("a water file");
    let visits = report["visits"].as_array().expect("a list");
    assert_eq!(visits.len(), 3);
    for visit in visits {
        for k in 0..3 {
            let counts = |name: &str| visit[name][k].as_f64().expect("a number");
            let off = counts("predicted_contrast") - counts("rendered_contrast");
            // Contrasts are 3 to 15 counts here; the network for the default camera is off by several.
            assert!(off.abs() < 1.5, "channel {k}: {visit}");
        }
    }
}
