//! Manifests: their rows, and what is refused.

use super::*;

fn read(text: &str) -> Result<Manifest, ManifestError> {
    read_with(text, None)
}

fn read_with(text: &str, levels: Option<&LevelCurve>) -> Result<Manifest, ManifestError> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.png"), b"").unwrap();
    let path = dir.path().join("m.csv");
    fs::write(&path, text).unwrap();
    Manifest::read(&path, levels)
}

#[test]
fn rows_are_read_with_their_lines_and_empty_unneeded_cells() {
    let manifest = read(
        "kind,file,light_pct,depth_m,distance_m\ndepth, a.png ,,0.5,\ncontrast,a.png,100,,1.5\n",
    )
    .unwrap();
    assert_eq!(manifest.rows[0].kind, RowKind::Depth { depth_m: 0.5 });
    assert_eq!(
        manifest.rows[1].kind,
        RowKind::Contrast {
            distance_m: 1.5,
            light_pct: 100.0,
            depth_m: None
        }
    );
    assert_eq!((manifest.rows[0].line, manifest.rows[1].line), (2, 3));
}

#[test]
fn errors_name_the_line_the_field_and_the_value() {
    let header = "file,kind,depth_m,distance_m,light_pct\n";
    let cases = [
        (
            "a.png,depth,nan,,",
            ":2: depth_m must be a finite number >= 0 (metres), got \"nan\"",
        ),
        ("a.png,depth,,,", ":2: depth_m must be"),
        (
            "a.png,sideways,1,,",
            ":2: kind must be depth or contrast, got \"sideways\"",
        ),
        (
            "a.png,contrast,,0,50",
            ":2: distance_m must be a finite number > 0",
        ),
        (
            "a.png,contrast,,1,101",
            ":2: light_pct must be a number from 0 to 100",
        ),
        (
            "gone.png,depth,1,,",
            ":2: file must be an existing image or a folder of frames, got \"gone.png\"",
        ),
        ("a.png,depth,1", "not a usable CSV table"),
        ("", "no image is listed"),
    ];
    for (row, expected) in cases {
        let message = read(&format!("{header}{row}\n")).unwrap_err().to_string();
        assert!(message.contains(expected), "{row}: {message}");
    }
}

#[test]
fn header_errors_name_the_column() {
    let message = read("file,kind,dept_m,distance_m,light_pct\n")
        .unwrap_err()
        .to_string();
    assert!(message.contains("did you mean depth_m?"), "{message}");
    let message = read("file,kind,depth_m,light_pct\n")
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("column distance_m is missing"),
        "{message}"
    );
}

#[test]
fn exposures_are_read_where_they_are_given() {
    let header = "file,kind,depth_m,distance_m,light_pct,exposure\n";
    let rows = "a.png,contrast,,1,50,0.25\na.png,contrast,,2,50,\n";
    let manifest = read(&format!("{header}{rows}")).unwrap();
    let given = manifest.rows.iter().map(|row| row.exposure);
    assert_eq!(given.collect::<Vec<_>>(), [Some(0.25), None]);
    for wrong in ["0", "-1", "inf", "long"] {
        let text = format!("{header}a.png,contrast,,1,50,{wrong}\n");
        let message = read(&text).unwrap_err().to_string();
        let words = ":2: exposure must be a finite number > 0";
        assert!(message.contains(words), "{message}");
    }
    let message = read("file,kind,depth_m,distance_m,light_pct,exposur\n").unwrap_err();
    assert!(message.to_string().contains("did you mean exposure?"));
}

#[test]
fn levels_become_light_by_the_vehicle_s_curve() {
    let curve = LevelCurve::new(vec![[0.0, 0.0], [50.0, 20.0], [100.0, 100.0]]).unwrap();
    let text = "file,kind,depth_m,distance_m,level_pct\na.png,contrast,,1,75\n";
    let manifest = read_with(text, Some(&curve)).unwrap();
    let RowKind::Contrast { light_pct, .. } = manifest.rows[0].kind else {
        panic!("{manifest:?}");
    };
    assert_eq!(light_pct, 60.0);
    // Light is light, curve or not.
    let given = read_with(&text.replace("level_pct", "light_pct"), Some(&curve)).unwrap();
    let told = format!("{:?}", given.rows[0].kind);
    assert!(told.contains("light_pct: 75.0"), "{told}");
    for (text, curve, words) in [
        (
            text.to_owned(),
            None,
            "level_pct needs the vehicle's level_curve",
        ),
        (
            text.replace("depth_m", "light_pct"),
            Some(&curve),
            "level_pct and light_pct say the same",
        ),
        (
            text.replace(",75", ",175"),
            Some(&curve),
            ":2: level_pct must be a number from 0 to 100",
        ),
    ] {
        let message = read_with(&text, curve).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
