//! Photometric files: what they say, and what is wrong with them.

use super::*;
use crate::scene::Falloff;

/// A Lambertian lamp, in four planes of which one pair is brighter than the other.
fn ies_text(around: &str, planes: usize, pairs: [f64; 2]) -> String {
    let angles: Vec<String> = (0..=18).map(|i| format!("{}", 5 * i)).collect();
    let mut text = format!(
        "IESNA:LM-63-2002\r\n[TEST] none\r\n[MANUFAC] nobody, 2 m\r\nTILT=NONE\r\n1 1000 2 19 {planes} 1 2 0 0 0\r\n0.5 1 30\r\n{}\r\n{around}\r\n",
        angles.join(" ")
    );
    for plane in 0..planes {
        let values: Vec<String> = (0..=18)
            .map(|i| {
                let cosine = f64::from(5 * i).to_radians().cos();
                format!("{:.6}", pairs[plane % 2] * cosine)
            })
            .collect();
        // Lines may break anywhere.
        text += &format!("{}\r\n{}\r\n", values[..7].join(" "), values[7..].join(","));
    }
    text
}

fn read(text: &str, name: &str) -> Result<Photometry, String> {
    Photometry::parse(text, Path::new(name))
}

#[test]
fn a_lambertian_lamp_has_pi_times_its_candelas() {
    let found = read(&ies_text("0", 1, [100.0; 2]), "a.IES").expect("read");
    assert_eq!(found.beam.len(), 19);
    // Multiplier 2, ballast factor 0.5.
    assert!((found.beam[0].1 - 100.0).abs() < 1e-9 && found.uneven == 0.0);
    assert!((found.beam[12].1 - 50.0).abs() < 1e-3);
    // Straight lines between 5° lie within 0.1 % of the cosine.
    let lumen = found.lumen(90.0);
    assert!(
        (lumen / (100.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3,
        "{lumen}"
    );
    let half = found.lumen(30.0);
    assert!(
        (half / (25.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3,
        "{half}"
    );
}

#[test]
fn planes_count_by_what_they_stand_for() {
    for (around, planes, axis) in [
        ("0 90", 2, 100.0),
        ("0 90 180", 3, 100.0),
        ("0 90 180 270", 4, 100.0),
        ("0 90 180 270 360", 5, 100.0),
        // The plane at 60 degrees stands for 45 of 90.
        ("0 60 90", 3, 100.0),
    ] {
        let found = read(&ies_text(around, planes, [80.0, 120.0]), "a.ies").expect("read");
        assert!(
            (found.beam[0].1 - axis).abs() < 1e-9,
            "{around}: {:?}",
            found.beam[0]
        );
        assert!(
            (found.uneven - 0.2).abs() < 1e-9,
            "{around}: {}",
            found.uneven
        );
    }
}

/// EULUMDAT with 24 planes as its symmetry stores them, `value` by plane and angle.
fn ldt(symmetry: usize, value: impl Fn(f64, f64) -> f64) -> String {
    let mut lines = vec![String::from("maker, with a comma"); 26 + 6 + 10];
    for (line, text) in [
        (3, symmetry.to_string()),
        (4, "24".into()),
        (5, "15".into()),
        (6, "19".into()),
        (24, "1".into()),
        (26, "1".into()),
        (29, "2000".into()),
    ] {
        lines[line - 1] = text;
    }
    lines.extend((0..24).map(|p| (15 * p).to_string()));
    lines.extend((0..19).map(|i| (5 * i).to_string()));
    let (first, count) = [(0, 24), (0, 1), (0, 13), (90, 13), (0, 7)][symmetry];
    for p in 0..count {
        for i in 0..19 {
            let at = [first + 15 * p, 5 * i].map(|d| f64::from(d).to_radians());
            lines.push(format!("{:.6}", value(at[0], at[1])).replace('.', ","));
        }
    }
    lines.join("\r\n")
}

#[test]
fn eulumdat_is_read_by_its_symmetry() {
    for symmetry in 0..5 {
        // The same under every symmetry, with a mean of the cosine.
        let value = |c: f64, g: f64| 50.0 * g.cos() * (1.0 + 0.3 * (2.0 * c).cos());
        let found = read(&ldt(symmetry, value), "b.ldt").expect("read");
        let mean = if symmetry == 1 { 130.0 } else { 100.0 };
        assert!(
            (found.beam[0].1 - mean).abs() < 1e-3,
            "{symmetry}: {:?}",
            found.beam[0]
        );
        assert!((found.beam[12].1 - 0.5 * mean).abs() < 1e-3, "{symmetry}");
    }
}

#[test]
fn what_is_not_as_the_formats_have_it_is_told() {
    let good = ies_text("0", 1, [100.0; 2]);
    for (text, name, words) in [
        (
            good.clone(),
            "a.csv",
            "must be a photometric file, .ies or .ldt",
        ),
        ("hello".into(), "a.ies", "has no line TILT="),
        (
            good.replace("TILT=NONE", "TILT=own.txt"),
            "a.ies",
            "TILT must be NONE or INCLUDE",
        ),
        (
            good.replace(" 1 1 2 0 0 0", " 1 2 2 0 0 0"),
            "a.ies",
            "photometric type must be 1",
        ),
        (
            good.replace("1 1000 2 19", "1 1000 2 1.5"),
            "a.ies",
            "number of vertical angles must be a whole number",
        ),
        (
            good.replace("1 1000 2 19", "1 1000 2 40"),
            "a.ies",
            "ends before its vertical angle",
        ),
        (
            good.replace("1 1000 2 19", "1 many 2 19"),
            "a.ies",
            "line 5: lumens per lamp must be a number, got \"many\"",
        ),
        (
            good.replace("0 5 10", "5 5 10"),
            "a.ies",
            "angles from the axis must rise, got 5 after 5",
        ),
        (
            good.replace("0 5 10", "1 5 10"),
            "a.ies",
            "must begin at 0 degrees",
        ),
        (
            ies_text("0", 1, [0.0; 2]),
            "a.ies",
            "on the axis must be above 0",
        ),
        (
            ies_text("0", 1, [-1.0; 2]),
            "a.ies",
            "must be finite numbers >= 0 cd",
        ),
        (
            ldt(1, |_, _| 1.0).replacen("24", "no", 1),
            "b.ldt",
            "line 4: number of C-planes must be a number, got \"no\"",
        ),
        ("a\nb".into(), "b.ldt", "ends before its symmetry (line 3)"),
    ] {
        let told = read(&text, name).expect_err(words);
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn the_solid_angle_of_a_falloff_is_its_integral() {
    let close = |got: f64, want: f64| assert!((got / want - 1.0).abs() < 1e-6, "{got} {want}");
    close(Falloff::Uniform.solid_angle_sr(180.0), 2.0 * TAU);
    close(Falloff::Uniform.solid_angle_sr(60.0), 0.5 * TAU);
    close(Falloff::Cosine.solid_angle_sr(90.0), 0.5 * TAU);
    close(Falloff::Cosine.solid_angle_sr(180.0), 0.5 * TAU);
    close(Falloff::Cosine.solid_angle_sr(30.0), 0.125 * TAU);
    let narrow = 1e-9_f64;
    close(
        Falloff::Uniform.solid_angle_sr(narrow),
        0.5 * TAU * narrow.to_radians().powi(2),
    );
}
