//! `uw camera-fit` and vehicles by name or file.

use serde_json::Value;
use uw_calib::vehicle::{Vehicle, VehicleFile};
use uw_render::image::{Picture, write_frame};
use uw_render::scene::{Encoding, Exposure, Noise, Sensor};

use super::support::Folder;

/// A ramp with detail, as the sensor stores it.
fn frame(folder: &Folder, name: &str, seed: u64) {
    let mut picture = Picture::black(120, 90);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let (x, y) = ((i % 120) as f32, (i / 120) as f32);
        *pixel = [x / 150.0 + 0.1 * (0.7 * x).sin() * (0.5 * y).cos() + 0.1; 3];
    }
    let sensor = Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Srgb,
        noise: Some(Noise { a: 8e-4, b: 5e-6 }),
        ..Sensor::default()
    };
    write_frame(&folder.path(name), &sensor.expose(&picture, seed)).expect("written");
}

fn vehicle(folder: &Folder, name: &str) -> VehicleFile {
    VehicleFile::read(&folder.path(name)).expect("a vehicle")
}

#[test]
fn a_vehicle_gets_its_noise_and_lamps() {
    let folder = Folder::new();
    frame(&folder, "a.png", 1);
    frame(&folder, "b.png", 2);
    let told = folder.good("camera-fit noise a.png b.png -o v.toml").stdout;
    assert!(
        told.contains("noise     a = ") && told.contains("misfit"),
        "{told}"
    );
    let first = vehicle(&folder, "v.toml");
    let known = &first.measured["noise_a"];
    let error = known.error.expect("an error");
    assert!((first.vehicle.noise_a - 8e-4).abs() < 4.0 * error, "{told}");
    assert!(
        known
            .from
            .contains("2 still frames of 120 x 90 pixels, encoding srgb")
    );
    // The lamps come on top; what was measured before is kept.
    let line = "camera-fit lamp --lumen 1500 --beam-angle-deg 120 --efficacy-lm-per-w 250 -o v.toml --vehicle v.toml";
    let told = folder.good(line).stdout;
    assert!(
        told.contains("assumed: light of 250 lm/W, so 6.000 W of light"),
        "{told}"
    );
    let both = vehicle(&folder, "v.toml");
    assert_eq!(both.vehicle.noise_a, first.vehicle.noise_a);
    assert_eq!(both.measured["noise_a"], *known);
    // 2 W a channel over π sin² 60° sr.
    assert!((both.vehicle.lamp_intensity - 0.848_826).abs() < 1e-6);
    assert_eq!(both.vehicle.lamp_half_angle_deg, 60.0);
    assert_eq!(both.measured["lamp_intensity"].error, None);
    let rest = Vehicle {
        noise_a: both.vehicle.noise_a,
        noise_b: both.vehicle.noise_b,
        lamp_intensity: both.vehicle.lamp_intensity,
        lamp_half_angle_deg: 60.0,
        ..Vehicle::default()
    };
    assert_eq!(both.vehicle, rest);
    let json = folder
        .good("--json camera-fit noise a.png b.png -o v.toml")
        .stdout;
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["channels"].as_array().map(Vec::len), Some(3));
    assert!((json["noise_a_error"].as_f64().expect("a number") / error - 1.0).abs() < 1e-4);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let folder = Folder::new();
    frame(&folder, "a.png", 1);
    folder.write("scene.toml", "format = \"uw-scene/1\"");
    for (line, words) in [
        ("noise a.png", "needs two or more frames"),
        (
            "noise a.png a.png",
            "a.png, a.png: frames 1 and 2 are equal",
        ),
        ("noise a.png none.png", "none.png: cannot be read"),
        (
            "noise a.png a.png --vehicle scene.toml",
            "scene.toml: format must be \"uw-vehicle/1\"",
        ),
        (
            "noise a.png a.png --vehicle yacht",
            "--vehicle: vehicle \"yacht\"",
        ),
        ("response a.png --light 1", "needs two or more pictures"),
        (
            "response a.png a.png --light 1,2,4",
            "a.png, a.png: a response needs two or more pictures and a factor of light for each; got 2 pictures and 3 factors",
        ),
        (
            "response a.png a.png --light 1,-2",
            "the light of picture 2 must be finite and above 0, got -2",
        ),
        (
            "response a.png a.png --light 1,2",
            "a.png, a.png: no one curve fits",
        ),
        (
            "level a.png a.png --level 50,90",
            "a.png, a.png: the levels must be 100",
        ),
        (
            "lamp --lumen 1500 --beam-angle-deg 120 --spectrum candle",
            "--spectrum: unknown light \"candle\"",
        ),
        ("vignetting a.png", "a.png: the board is not even"),
        ("vignetting none.png", "none.png: cannot be read"),
        (
            "beam a.png --distance-m -1 --lamp-right-m 0.3 --hfov-deg 70",
            "a.png: --distance-m must be in [0.05, 100] m, got -1",
        ),
        (
            "beam a.png --distance-m 1 --lamp-right-m 0.3 --hfov-deg 190",
            "--hfov-deg must be in [1, 170] degrees, got 190",
        ),
        (
            "even a.png --vehicle default",
            "--vehicle: default has no vignetting",
        ),
        ("lamp --lumen -3 --beam-angle-deg 90", "--lumen must be in"),
        (
            "lamp --lumen 3 --beam-angle-deg 300",
            "--beam-angle-deg must be in (0, 180], got 300",
        ),
    ] {
        folder.refused(&format!("camera-fit {line} -o v.toml"), &[words]);
    }
    folder.refused(
        "water-tables --jerlov IB --vehicle yacht -o w.json",
        &["--vehicle: vehicle \"yacht\""],
    );
    folder.refused(
        "demo --vehicle yacht -o d",
        &["--vehicle: vehicle \"yacht\""],
    );
    folder.write(
        "v.toml",
        "format = \"uw-vehicle/1\"\nlamp_spectrum = \"halogen\"",
    );
    folder.refused(
        "demo --vehicle v.toml -o d",
        &["vehicle.lamp_spectrum counts by wavelength"],
    );
}

/// Frames that JPEG went over are measured, with a warning.
#[test]
fn jpeg_is_told() {
    let folder = Folder::new();
    for (name, seed) in [("a", 1), ("b", 2)] {
        frame(&folder, &format!("{name}.png"), seed);
        let picture = image::open(folder.path(&format!("{name}.png"))).expect("a picture");
        let file = std::fs::File::create(folder.path(&format!("{name}.jpg"))).expect("a file");
        let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(file, 98);
        picture.write_with_encoder(encoder).expect("written");
    }
    let run = folder.good("camera-fit noise a.jpg b.jpg -o v.toml");
    assert!(run.stderr.contains("JPEG removes noise"), "{}", run.stderr);
    assert!(
        vehicle(&folder, "v.toml").measured["noise_a"]
            .from
            .contains("JPEG frames")
    );
}

/// A series of exposures of a ramp that leaves no count out, in `encoding`, named by its factors of light.
fn series(folder: &Folder, encoding: Encoding, light: &[f64]) {
    let mut picture = Picture::black(240, 160);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let (x, y) = ((i % 240) as f32 / 240.0, (i / 240) as f32 / 160.0);
        *pixel = [10_f32.powf(-2.65 + 2.6 * x + 0.3 * y); 3];
    }
    for (seed, exposure) in light.iter().enumerate() {
        let sensor = Sensor {
            exposure: Exposure::Fixed(*exposure),
            encoding,
            noise: Some(Noise { a: 2e-4, b: 1e-6 }),
            ..Sensor::default()
        };
        let frame = sensor.expose(&picture, seed as u64);
        write_frame(&folder.path(&format!("{exposure}.png")), &frame).expect("written");
    }
}

/// The encoding that a series shows is that of the vehicle, and of the noise that is measured after it.
#[test]
fn a_vehicle_gets_its_encoding() {
    let folder = Folder::new();
    series(&folder, Encoding::Linear, &[0.2, 0.5, 1.0]);
    let line = "camera-fit response 0.2.png 0.5.png 1.png --light 2,5,10 -o v.toml";
    let told = folder.good(line).stdout;
    assert!(told.starts_with("encoding  linear\n"), "{told}");
    let file = vehicle(&folder, "v.toml");
    assert_eq!(file.vehicle.encoding, uw_calib::Encoding::Linear);
    assert!(
        file.measured["encoding"]
            .from
            .contains("3 pictures, light off by")
    );
    folder.refused(
        "camera-fit response 0.2.png 0.5.png 1.png --light 2,2,10 -o w.toml",
        &["0.2.png, 0.5.png, 1.png: no one curve fits the pictures"],
    );
    series(&folder, Encoding::Srgb, &[0.2, 0.5, 1.0]);
    let told = folder.good(&format!("--json {line}")).stdout;
    let told: Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!(told["encoding"], "srgb");
    assert!(told["off"][0]["rms"].as_f64().is_some_and(|rms| rms < 0.02));
}

/// A camera with a tone curve of its own gets that curve, and its noise is measured through it.
#[test]
fn a_vehicle_gets_the_curve_of_its_camera() {
    let folder = Folder::new();
    let points: Vec<[f64; 2]> = (1..=51)
        .map(|k| 5.0 * f64::from(k))
        .map(|counts| [counts, (counts / 255.0).powf(1.6)])
        .collect();
    let hidden = Encoding::Curve(uw_media::ResponseCurve::new(&points).expect("a curve"));
    series(&folder, hidden, &[0.2, 0.5, 1.0]);
    let told = folder
        .good("camera-fit response 0.2.png 0.5.png 1.png --light 2,5,10 -o v.toml")
        .stdout;
    assert!(told.starts_with("encoding  curve\n"), "{told}");
    let file = vehicle(&folder, "v.toml");
    let found = file.vehicle.encoding;
    assert!(matches!(found, Encoding::Curve(_)), "{found:?}");
    assert!(
        (file.measured["encoding"].from).contains("3 pictures, seen from"),
        "{:?}",
        file.measured
    );
    // Light up to a factor, which the end of the counts that were seen leaves open.
    let ratio = |counts: f64| found.light(counts) / hidden.light(counts);
    for counts in [25.0, 50.0, 100.0, 200.0] {
        let off = ratio(counts) / ratio(150.0) - 1.0;
        assert!(off.abs() < 0.03, "{counts}: {off}");
    }
    std::fs::copy(folder.path("1.png"), folder.path("first.png")).expect("copied");
    series(&folder, hidden, &[0.2, 1.0]);
    folder.good("camera-fit noise first.png 1.png --vehicle v.toml -o v.toml");
    let file = vehicle(&folder, "v.toml");
    assert_eq!(file.vehicle.encoding, found);
    let off = file.vehicle.noise_a / 2e-4 - 1.0;
    assert!(off.abs() < 0.06, "noise_a is off by {off}");
}

/// A lens that is measured is taken out of a picture, and a picture of another shape is refused.
#[test]
fn a_vehicle_gets_its_vignetting() {
    let folder = Folder::new();
    let mut picture = Picture::black(128, 72);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let (x, y) = ((i % 128) as f32 - 63.5, (i / 128) as f32 - 35.5);
        *pixel = [0.5 * (1.0 - 0.4 * (x * x + y * y) / (64.0 * 64.0 + 36.0 * 36.0)); 3];
    }
    let sensor = Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Srgb,
        noise: Some(Noise { a: 2e-4, b: 1e-6 }),
        ..Sensor::default()
    };
    write_frame(&folder.path("board.png"), &sensor.expose(&picture, 1)).expect("written");
    folder.good("camera-fit vignetting board.png -o v.toml");
    let file = vehicle(&folder, "v.toml");
    let lens = file.vehicle.vignetting.expect("a lens");
    let error = file.measured["vignetting"].error.expect("an error");
    assert!(
        (lens.share(1.0) - 0.6).abs() < 4.5 * error,
        "{lens:?} {error}"
    );
    folder.good("camera-fit even board.png --vehicle v.toml -o even.png");
    // With the vehicle's file pictures are measured as if they were even; rounded once more, they are so within half a count.
    let mean = |of: &str| -> [f64; 3] {
        let told = folder.good(&format!("stats --json {of}"));
        let told: serde_json::Value = serde_json::from_str(&told.stdout).expect("JSON");
        serde_json::from_value(told[0]["mean"].clone()).expect("three numbers")
    };
    let (stored, seen, even) = (
        mean("board.png"),
        mean("board.png --vehicle v.toml"),
        mean("even.png"),
    );
    for k in 0..3 {
        assert!((seen[k] - even[k]).abs() < 0.1, "{seen:?} {even:?}");
        assert!(seen[k] - stored[k] > 2.0, "{seen:?} {stored:?}");
    }
    folder.good("camera-fit vignetting even.png -o w.toml");
    let left = vehicle(&folder, "w.toml")
        .vehicle
        .vignetting
        .expect("a lens");
    assert!((left.share(1.0) - 1.0).abs() < 0.01, "{left:?}");
    frame(&folder, "a.png", 1);
    folder.refused(
        "camera-fit even a.png --vehicle v.toml -o b.png",
        &["a.png: 120 x 90 pixels have another shape than the vehicle's 1280 x 720"],
    );
}

/// The lamp of a scene in air, which the renderer shines at a board, is found; the data sheet's then takes its place.
#[test]
fn a_vehicle_gets_the_beam_of_a_rendered_lamp() {
    let folder = Folder::new();
    folder.write(
        "board.toml",
        "format = \"uw-scene/1\"\n\
         [camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nup = [0, 0, 1]\nhfov_deg = 80\nwidth = 192\nheight = 108\n\
         [[lamp]]\nposition_m = [0, -0.25, 0]\nforward = [1, 0, 0]\nintensity = [0.7, 0.7, 0.7]\nfalloff = \"cosine\"\n\
         half_angle_deg = 30\n\
         [[object]]\nreflectance = [0.8, 0.8, 0.8]\n\
         plane = { center_m = [1.2, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [20, 20] }\n\
         [sensor]\nexposure = 5.0\nnoise = { a = 2e-4, b = 1e-6 }\n",
    );
    folder.good("render board.toml -o board.png --spp 16 --backend cpu --seed 2");
    let fit = "camera-fit beam board.png --distance-m 1.2 --lamp-right-m 0.25 --hfov-deg 80 --reflectance 0.8";
    // The vehicle's exposure is 8.61, that of the picture 5.
    let run = folder.good(&format!("{fit} --relative-exposure 0.580720 -o v.toml"));
    assert_eq!(run.stderr, "");
    let found = vehicle(&folder, "v.toml").vehicle;
    assert!(
        (found.lamp_intensity / 0.7 - 1.0).abs() < 0.01,
        "{}",
        run.stdout
    );
    // The cone's edge lies within the last row but one and the last.
    assert!(
        (found.lamp_half_angle_deg - 31.0).abs() < 2.0,
        "{}",
        run.stdout
    );
    let profile = found.lamp_profile.expect("a profile");
    for [angle, relative] in profile.iter().filter(|row| row[0] < 28.0) {
        let cosine = angle.to_radians().cos();
        assert!(
            (relative - cosine).abs() < 0.015,
            "{angle}: {relative} {cosine}"
        );
    }
    folder.refused(
        &format!("{fit} --relative-exposure 0.58 --vehicle yacht -o w.toml"),
        &["--vehicle: vehicle \"yacht\""],
    );
    folder.good("camera-fit lamp --lumen 1500 --beam-angle-deg 120 -o w.toml --vehicle v.toml");
    let sheet = vehicle(&folder, "w.toml");
    assert_eq!(sheet.vehicle.lamp_profile, None);
    assert!(!sheet.measured.contains_key("lamp_profile"));
}

/// A board at a share of light and full scale beyond.
fn board(folder: &Folder, name: &str, share: f32, seed: u64) {
    let mut picture = Picture::black(120, 90);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        *pixel = [share * (0.8 - 0.002 * (i % 120) as f32); 3];
    }
    let sensor = Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Srgb,
        noise: Some(Noise { a: 2e-4, b: 1e-6 }),
        ..Sensor::default()
    };
    write_frame(&folder.path(name), &sensor.expose(&picture, seed)).expect("written");
}

#[test]
fn a_vehicle_gets_its_lamps_level_curve_and_calibrations_count_in_light() {
    let folder = Folder::new();
    board(&folder, "half.png", 0.2, 1);
    board(&folder, "full.png", 1.0, 2);
    let line = "camera-fit level half.png full.png --level 50,100 -o v.toml";
    let told = folder.good(line).stdout;
    assert!(told.contains("50.00   20.0"), "{told}");
    let file = vehicle(&folder, "v.toml");
    let curve = file.vehicle.level_curve.expect("a curve");
    assert!((curve.light_pct(50.0) - 20.0).abs() < 0.1, "{told}");
    assert!((curve.level_pct(60.0) - 75.0).abs() < 0.1, "{told}");
    assert!(file.measured["level_curve"].error.expect("an error") < 1e-3);
    // What a manifest says was set is light by the curve, and nothing without it.
    let header = "file,kind,depth_m,distance_m,level_pct\n";
    folder.write(
        "m.csv",
        format!("{header}half.png,contrast,1,1,0\nfull.png,contrast,1,1,50\n"),
    );
    let words = "m.csv:1: column level_pct needs the vehicle's level_curve";
    folder.refused("calibrate m.csv -o p.json", &[words]);
    let format = "format = \"uw-vehicle/1\"";
    folder.write(
        "c.toml",
        format!("{format}\nlevel_curve = [[0, 0], [50, 20], [100, 100]]\n"),
    );
    let line = "calibrate m.csv --vehicle c.toml -o p.json";
    folder.refused(line, &["lamps at 20 %"]);
    // The default lamp is a white diode's.
    let told = folder
        .good("--json camera-fit lamp --lumen 1500 --beam-angle-deg 120 -o l.toml")
        .stdout;
    let json: Value = serde_json::from_str(&told).expect("JSON");
    let efficacy = json["efficacy_lm_per_w"].as_f64().expect("a number");
    assert!((310.0..340.0).contains(&efficacy), "{told}");
    let warm = folder
        .good("camera-fit lamp --lumen 1500 --beam-angle-deg 120 --spectrum halogen -o l.toml")
        .stdout;
    assert!(warm.contains("assumed: light of halogen (2"), "{warm}");
}

/// A maker's photometric file gives a vehicle its beam, and a scene its lamp.
#[test]
fn a_photometric_file_is_a_lamp() {
    let folder = Folder::new();
    // 90, 45 and 0 cd: straight lines from the axis to 60 degrees.
    folder.write(
        "lamp.ies",
        "IESNA:LM-63-2002\n[MANUFAC] nobody\nTILT=NONE\n1 -1 1 4 1 1 2 0 0 0\n1 1 20\n0 30 60 90\n0\n90 45 0 0\n",
    );
    let told = folder
        .good("--json camera-fit lamp --file lamp.ies -o v.toml")
        .stdout;
    let json: Value = serde_json::from_str(&told).expect("JSON");
    let found = vehicle(&folder, "v.toml");
    let rows = vec![[0.0, 1.0], [30.0, 0.5], [60.0, 0.0]];
    assert_eq!(found.vehicle.lamp_profile, Some(rows));
    assert_eq!(found.vehicle.lamp_half_angle_deg, 60.0);
    assert!(found.measured["lamp_profile"].from.contains("lamp.ies, "));
    // A third of the file's candelas in each channel, as watts.
    let efficacy = json["efficacy_lm_per_w"].as_f64().expect("a number");
    let axis = 90.0 / efficacy / 3.0;
    let off = found.vehicle.lamp_intensity / axis - 1.0;
    assert!(off.abs() < 1e-3, "{off}");
    folder.refused(
        "camera-fit lamp --file v.toml -o w.toml",
        &["v.toml: must be a photometric file, .ies or .ldt"],
    );
    let scene = |power: &str| {
        format!(
            "format = \"uw-scene/1\"\n\
             [camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nhfov_deg = 20\nwidth = 16\nheight = 16\n\
             [[lamp]]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nfalloff = {{ file = \"lamp.ies\" }}\n{power}\n\
             [[object]]\nreflectance = [1, 1, 1]\n\
             plane = {{ center_m = [1, 0, 0], normal = [-1, 0, 0], up = [0, 0, 1], size_m = [9, 9] }}\n\
             [sensor]\nexposure = 1.0\nencoding = \"linear\"\nbits = 16\n"
        )
    };
    let mut brightness = Vec::new();
    for (name, power) in [
        ("file.toml", "".to_owned()),
        (
            "given.toml",
            format!("intensity = [{axis}, {axis}, {axis}]"),
        ),
    ] {
        folder.write(name, scene(&power));
        let picture = name.replace("toml", "png");
        folder.good(&format!("render {name} -o {picture} --spp 4 --seed 3"));
        let told = folder
            .good(&format!("--json stats --encoding linear {picture}"))
            .stdout;
        let told: Value = serde_json::from_str(&told).expect("JSON");
        brightness.push(told[0]["mean"][1].as_f64().expect("a mean"));
    }
    assert!(
        (brightness[0] / brightness[1] - 1.0).abs() < 2e-3,
        "{brightness:?}"
    );
    folder.write("both.toml", scene("intensity = [1, 1, 1]\npower_lm = 90"));
    folder.refused(
        "render both.toml -o x.png",
        &["lamp 1 power_lm must be left out"],
    );
    folder.write(
        "none.toml",
        scene("").replace("{ file = \"lamp.ies\" }", "\"cosine\""),
    );
    folder.refused(
        "render none.toml -o x.png",
        &["lamp 1 lacks the required field `intensity`"],
    );
}
