//! Water files, written and read.

use super::*;
use crate::physics::tests::even_water;

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("water.json");
    fs::write(&path, even_water().to_json()).unwrap();
    let file = WaterFile::read(&path).unwrap();
    let light = |file: &WaterFile| file.tables.views[3].lamps.straight[1][7];
    assert!((light(&file) / light(&even_water()) - 1.0).abs() < 1e-5);
    // Six digits are six digits again.
    fs::write(&path, file.to_json()).unwrap();
    assert_eq!(WaterFile::read(&path).unwrap(), file);
}

#[test]
fn wrong_files_are_refused_by_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("water.json");
    let refused = |change: &dyn Fn(&mut Value)| {
        let mut value = serde_json::to_value(even_water()).unwrap();
        change(&mut value);
        fs::write(&path, value.to_string()).unwrap();
        WaterFile::read(&path).unwrap_err().to_string()
    };
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 8] = [
        (|v| v["format"] = "uw-mlp".into(), "got \"uw-mlp\""),
        (|v| v["sensor"]["noise_a"] = (-1.0).into(), "sensor.noise_a"),
        (
            |v| v["tables"]["depths_m"] = serde_json::json!([2.0, 1.0]),
            "tables.depths_m",
        ),
        (
            |v| v["tables"]["half_view"][0] = 0.into(),
            "tables.half_view",
        ),
        (
            |v| v["tables"]["views"][0]["lamps"]["veil"][1] = serde_json::json!([1.0]),
            "views[0].lamps.veil",
        ),
        (
            |v| v["tables"]["views"][1]["daylight"] = serde_json::json!([]),
            "views[1].daylight",
        ),
        (
            |v| v["tables"]["views"][1]["lamps"]["transfer"][2][0] = 1.5.into(),
            "views[1].lamps.transfer",
        ),
        (|v| v["colour"] = 1.into(), "unknown field `colour`"),
    ];
    for (change, told) in cases {
        let message = refused(&change);
        assert!(message.contains(told), "{told}: {message}");
    }
}
