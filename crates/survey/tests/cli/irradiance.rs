//! `uw irradiance`: its table, its refusals, its interruption.

use super::support::{Folder, numbers};

const QUANTITIES: [&str; 5] = ["E_d", "E_u", "E_od", "E_ou", "L_u"];

#[test]
fn a_table_has_a_row_per_depth_channel_and_quantity() {
    let folder = Folder::with_scene();
    let line = "irradiance scene.toml --depths-m 0,0.5,1.25 --samples 256 --seed 3 -o";
    folder.good(&format!("{line} out.csv --threads 1"));
    let text = folder.text("out.csv");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("depth_m,channel,quantity,value,standard_error")
    );
    for depth in ["0", "0.5", "1.25"] {
        for channel in ["r", "g", "b"] {
            for quantity in QUANTITIES {
                let row = lines.next().expect("a row");
                assert!(
                    row.starts_with(&format!("{depth},{channel},{quantity},")),
                    "{row}"
                );
            }
        }
    }
    assert_eq!(lines.next(), None);
    for row in numbers(&text) {
        assert!(
            row[3] > 0.0 && row[4] >= 0.0 && row[3].is_finite() && row[4] < row[3],
            "{row:?}"
        );
    }
    folder.good(&format!("{line} again.csv --threads 3 --quiet"));
    assert_eq!(text, folder.text("again.csv"));
}

#[test]
fn unusable_input_is_refused_and_leaves_nothing() {
    let folder = Folder::with_scene();
    let boundless = folder
        .text("scene.toml")
        .replace("[surface]\nheight_m = 2.0\n", "");
    folder.write("boundless.toml", boundless);
    folder.refused(
        "irradiance boundless.toml --depths-m 1 -o out.csv",
        &["boundless.toml", "no water surface"],
    );
    for depths in ["-1", "1,nan", "inf", "1,", "deep"] {
        folder.refused(
            &format!("irradiance scene.toml --depths-m {depths} -o out.csv"),
            &["--depths-m", "finite number >= 0 m"],
        );
    }
    folder.refused("irradiance scene.toml -o out.csv", &["--depths-m"]);
    folder.refused(
        "irradiance scene.toml --depths-m 1 --samples 1 -o out.csv",
        &["--samples"],
    );
    folder.refused(
        "irradiance scene.toml --depths-m 1 -o nowhere/out.csv",
        &["nowhere"],
    );
}
