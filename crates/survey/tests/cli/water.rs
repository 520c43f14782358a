//! `uw phase` and `uw water`.

use std::fs;

use super::support::{Folder, Run, numbers, shipped};

/// Columns n, B, theta_deg, p_per_sr, cdf of the reference table (60-digit arithmetic).
fn reference(n: f64, b: f64) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(shipped("media/tests/data/ff/ff_table.csv")).expect("table");
    let rows = numbers(&text)
        .into_iter()
        .filter(|row| row[0] == n && row[1] == b);
    rows.map(|row| [row[4], row[6], row[7]]).collect()
}

fn column_file(folder: &Folder, name: &str, values: impl Iterator<Item = f64>) {
    let lines: Vec<String> = values.map(|value| format!("{value:e}")).collect();
    folder.write(name, lines.join("\n"));
}

#[test]
fn values_of_fournier_forand_agree_with_the_reference() {
    let folder = Folder::new();
    for (n, b) in [(1.10, 0.0183), (1.05, 0.001)] {
        let expected = reference(n, b);
        assert!(expected.len() > 80);
        column_file(&folder, "angles.txt", expected.iter().map(|row| row[0]));
        let run = folder.good(&format!(
            "phase --model fournier-forand --n {n} --backscatter-fraction {b} --angles-deg angles.txt"
        ));
        assert!(run.stdout.starts_with("angle_deg,phase_per_sr,cdf\n"));
        for (got, expected) in run.rows().iter().zip(&expected) {
            for k in 0..3 {
                // Required: 1e-7. Twelve digits and double precision leave far less.
                assert!(
                    (got[k] / expected[k] - 1.0).abs() < 1e-9,
                    "{got:?} {expected:?}"
                );
            }
        }
        assert_eq!(run.rows().len(), expected.len());
    }
}

#[test]
fn the_slope_can_stand_for_the_backscatter_fraction() {
    let folder = Folder::new();
    folder.write(
        "angles.csv",
        "angle_deg,comment\n0,start\n0.1,\n1,\n90,\n180,end\n",
    );
    let ask = |parameter: &str| {
        folder
            .good(&format!(
                "phase --model fournier-forand --n 1.10 {parameter} --angles-deg angles.csv"
            ))
            .rows()
    };
    let (by_mu, by_fraction) = (ask("--mu 3.5835"), ask("--backscatter-fraction 0.0183"));
    assert_eq!(by_mu[0], [0.0, f64::INFINITY, 0.0]);
    let sharp = folder
        .good("phase --model henyey-greenstein --g 0.99 --angles-deg angles.csv")
        .rows();
    assert!(sharp[0][1].is_finite() && sharp[0][1] > sharp[1][1]);
    for (one, other) in by_mu.iter().zip(&by_fraction).skip(1) {
        // The published pair (n 1.10, mu 3.5835, B 0.0183) has four digits.
        assert!((one[1] / other[1] - 1.0).abs() < 2e-3, "{one:?} {other:?}");
    }
    assert_eq!(by_mu[4][2], 1.0);
}

#[test]
fn every_model_has_its_value() {
    let folder = Folder::new();
    folder
        .write("angle.txt", "60\n")
        .write("flat.csv", "0,2\n180,2\n");
    let quarter = 0.25 / std::f64::consts::PI;
    // cos 60° = 1/2; Henyey-Greenstein (1 - g²)/(1 + g² - 2g cosθ)^1.5, Rayleigh 3/4 (1 + cos²θ), each over 4π.
    let hg = |g: f64| (1.0 - g * g) / (1.0 + g * g - g).powf(1.5);
    for (model, expected) in [
        ("isotropic", 1.0),
        ("table --file flat.csv", 1.0),
        ("henyey-greenstein --g -0.5", hg(-0.5)),
        ("henyey-greenstein --g 0.9", hg(0.9)),
        ("rayleigh", 0.9375),
        ("rayleigh --depolarisation 1", 1.0),
        ("draine --g 0.9 --alpha 0", hg(0.9)),
        ("draine --g 0 --alpha 1", 0.9375),
    ] {
        let run = folder.good(&format!("phase --model {model} --angles-deg angle.txt"));
        let got = run.rows()[0][1];
        assert!(
            (got / (expected * quarter) - 1.0).abs() < 1e-10,
            "{model}: {got}"
        );
    }
    // The tabulated value, 1.316e-2, and this project's normalisation of the forward peak.
    let petzold = folder
        .good("phase --model petzold --angles-deg angle.txt")
        .rows()[0][1];
    assert!((petzold / 1.316e-2 - 1.0).abs() < 0.01, "{petzold}");
}

#[test]
fn inverse_and_samples_belong_to_the_same_distribution() {
    let folder = Folder::new();
    let text =
        fs::read_to_string(shipped("media/tests/data/ff/ff_inverse_cdf.csv")).expect("table");
    let rows: Vec<Vec<f64>> = numbers(&text)
        .into_iter()
        .filter(|row| row[..2] == [1.10, 0.0183])
        .collect();
    column_file(&folder, "u.txt", rows.iter().map(|row| row[3]));
    let model = "phase --model fournier-forand --n 1.10 --backscatter-fraction 0.0183";
    let inverse = folder.good(&format!("{model} --inverse-cdf u.txt")).rows();
    assert!(!rows.is_empty() && inverse.len() == rows.len());
    for (got, expected) in inverse.iter().zip(&rows) {
        assert!(
            (got[1] / expected[5] - 1.0).abs() < 1e-6,
            "{got:?} {expected:?}"
        );
    }
    let samples = folder
        .good(&format!("{model} --sample 20000 --seed 4"))
        .rows();
    let cosines: Vec<f64> = samples
        .iter()
        .map(|row| row[0].to_radians().cos())
        .collect();
    let mean = cosines.iter().sum::<f64>() / cosines.len() as f64;
    let squares = cosines
        .iter()
        .map(|cosine| (cosine - mean).powi(2))
        .sum::<f64>();
    let standard_error = squares.sqrt() / cosines.len() as f64;
    // Mean cosine 0.930 of this function (three digits); the seed is fixed.
    assert!(
        (mean - 0.930).abs() < 4.0 * standard_error + 5e-4,
        "{mean} {standard_error}"
    );
}

#[test]
fn samples_follow_the_seed_and_results_can_go_to_a_file() {
    let folder = Folder::new();
    let draw = |line: &str| folder.good(&format!("phase --model petzold --sample 50 {line}"));
    let one = draw("--seed 1").stdout;
    assert_eq!(one.lines().count(), 51);
    assert_eq!(one, draw("--seed 1").stdout);
    assert_ne!(one, draw("--seed 2").stdout);
    assert_eq!(draw("--seed 1 -o angles.csv").stdout, "");
    assert_eq!(folder.text("angles.csv"), one);
}

#[test]
fn angles_can_come_through_a_pipe_and_the_reader_may_leave_early() {
    use std::io::Write;
    use std::process::Stdio;
    let folder = Folder::new();
    let mut command = folder.command("phase --model isotropic --angles-deg -");
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    child
        .stdin
        .take()
        .expect("pipe")
        .write_all(b"90\n")
        .expect("open pipe");
    let run = Run::of(child.wait_with_output().expect("the binary ends"));
    assert_eq!(run.rows(), [[90.0, 0.0795774715459, 0.5]]);

    let mut command = folder.command("phase --model isotropic --sample 1000000");
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    drop(child.stdout.take());
    let run = Run::of(child.wait_with_output().expect("the binary ends"));
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
}

#[test]
fn water_types_have_their_coefficients() {
    let folder = Folder::new();
    let run = folder.good("water --jerlov 3C");
    assert!(
        run.stdout
            .starts_with("channel,a_per_m,b_per_m,c_per_m\nr,0.388,"),
        "{}",
        run.stdout
    );
    for row in run.rows() {
        assert!((row[1] + row[2] - row[3]).abs() < 1e-8);
    }
    let json: serde_json::Value =
        serde_json::from_str(&folder.good("water --jerlov 3C --bands mean --json").stdout)
            .expect("JSON");
    assert_eq!(
        (&json["jerlov"], &json["bands"]),
        (&"3C".into(), &"mean".into())
    );
    assert!((json["a_per_m"][0].as_f64().unwrap_or(0.0) - 0.388).abs() < 1e-9);
    let red = |bands: &str| {
        folder
            .good(&format!("water --jerlov I --bands {bands}"))
            .rows()[0][1]
    };
    // The plain mean makes red of type I die much sooner than a camera sees it.
    assert!((red("mean") - 0.375).abs() < 0.01 && red("camera:imx219") < 0.3);
}

#[test]
fn red_absorption_rises_along_the_coastal_types() {
    let folder = Folder::new();
    let types = folder.good("water --list").stdout;
    let types: Vec<&str> = types.lines().collect();
    assert_eq!(
        types,
        ["I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C"]
    );
    let json: Vec<String> =
        serde_json::from_str(&folder.good("water --list --json").stdout).expect("JSON");
    assert_eq!(json, types);
    let red = |name: &&str| folder.good(&format!("water --jerlov {name}")).rows()[0][1];
    assert!(
        types[5..]
            .iter()
            .map(red)
            .is_sorted_by(|one, next| one < next)
    );
}

/// The table of `docs`: what three bands make wrong where lamp and camera are 4 m from the target.
#[test]
fn a_spectrum_tells_what_three_bands_make_wrong() {
    let folder = Folder::new();
    let run = folder.good(
        "water --jerlov I --bands spectral --response canon5d2 --light led-5000k --range-m 8 --plot I.png --json",
    );
    let found: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(found["wavelength_nm"].as_array().map(Vec::len), Some(31));
    let ratio = |k: usize| {
        let of = |name: &str| found["range"][name][k].as_f64().expect("a number");
        of("light_left") / of("light_left_wideband")
    };
    // Red, green, blue of type I by another program, on another grid and with half of the scattered light lost.
    for (k, expected) in [(0, 1.32), (1, 1.06), (2, 1.01)] {
        assert!(
            (ratio(k) / expected - 1.0).abs() < 0.03,
            "{k}: {}",
            ratio(k)
        );
    }
    assert!(folder.path("I.png").exists());
    let table = folder.good("water --jerlov I --bands spectral");
    assert!(
        table
            .stdout
            .starts_with("wavelength_nm,a_per_m,b_per_m,c_per_m\n400,")
    );
}

#[test]
fn spectra_that_cannot_be_used_are_refused() {
    let folder = Folder::new();
    folder.write(
        "um.csv",
        "wavelength_nm,a_per_m,b_per_m\n0.4,0.1,0.1\n0.5,0.1,0.1\n",
    );
    for (command, expected) in [
        (
            "water --spectrum um.csv",
            "um.csv: line 2: the wavelength must be in nm",
        ),
        ("water --spectrum none.csv", "none.csv"),
        (
            "water --jerlov I --range-m 3",
            "--range-m goes with --bands spectral",
        ),
        (
            "water --jerlov I --bands spectral --range-m=-1",
            "--range-m",
        ),
        (
            "water --jerlov I --bands spectral --response canon",
            "canon5d2",
        ),
        (
            "water --jerlov 7C --bands spectral-measured",
            "IB II III 1C 3C 5C",
        ),
    ] {
        folder.refused(command, &[expected]);
    }
}
