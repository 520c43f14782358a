//! The demonstration, as a newcomer runs it.

use std::process::Command;

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
        "report.md",
        "profile.json",
        "contrast.png",
        "contrast.svg",
        "calibration/manifest.csv",
    ] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
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
