//! Pictures of a camera with a lens, and with parts of the vehicle before it.

use image::ImageEncoder as _;
use image::codecs::png::PngEncoder;
use serde_json::{Value, json};
use uw_calib::{Encoding, Resampling, Undistortion};
use uw_guidance::physics::file::FitNumbers;

use crate::client::{Client, without};
use crate::known_water::{SIZE_PX, picture_through, water_file, waves, write_picture};
use crate::program::{ANY_PORT, Program, text};
use crate::support::Numbers;

/// Size of the camera's pictures, pixels.
const STORED_PX: [u32; 2] = [448, 272];
/// Field of view of the water file's ideal camera, degrees.
const HFOV_DEG: f64 = 53.13;
const PLACE: (f64, f64) = (1.0, 20.0);
/// Next to none, so that resampling takes nothing off.
const QUIET: [f64; 2] = [1e-8, 1e-9];
const CONFIG: &str = "[images]\ndirectory = \".\"\nundistortion = \"lens.json\"\n";
/// Where a part of the vehicle covers the camera's picture.
const MASK: &str = "format = \"uw-mask/1\"\nwidth = 448\nheight = 272\n[[polygon]]\npoints = [[0, 200], [90, 200], [90, 272], [0, 272]]\n";

/// Cosine and sine of the camera's roll, and its scale.
const ROLLED: [f64; 3] = [0.995, 0.0999, 1.3];

/// Where a point of the ideal picture lies in the stored one: the camera is rolled and sees more.
fn stored(x: f64, y: f64) -> [f64; 2] {
    let [c, s, scale] = ROLLED;
    let [x, y] = [x - 160.0, y - 96.0].map(|at| scale * at);
    [224.0 + c * x - s * y, 136.0 + s * x + c * y]
}

/// The way back.
fn ideal(x: f64, y: f64) -> [f64; 2] {
    let [c, s, scale] = ROLLED;
    let [x, y] = [x - 224.0, y - 136.0].map(|at| at / (scale * (c * c + s * s)));
    [160.0 + c * x + s * y, 96.0 - s * x + c * y]
}

fn lens(hfov_deg: f64) -> String {
    let map = Resampling::new(STORED_PX, SIZE_PX, |x, y| Some(stored(x, y)));
    let made = Undistortion::new(hfov_deg, map, Vec::new());
    made.to_json("tests").unwrap()
}

/// A folder with the ideal camera's picture, the stored one and that with a part of the vehicle on it.
fn folder() -> Program {
    let program = Program::folder()
        .write(
            "water.json",
            &water_file(&[0.5, 1.0, 2.0, 4.0], QUIET).to_json(),
        )
        .write("lens.json", &lens(HFOV_DEG))
        .write("mask.toml", MASK);
    write_picture(&program.path("ideal.png"), PLACE, &waves, QUIET);
    let mut picture = picture_through(&ideal, STORED_PX, PLACE, &waves, QUIET);
    picture.save(program.path("stored.png")).unwrap();
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        if x < 90 && y >= 200 {
            *pixel = image::Rgb([250; 3]);
        }
    }
    picture.save(program.path("covered.png")).unwrap();
    program
}

fn start(config: &str) -> Program {
    let arguments = [&ANY_PORT[..], &["--water", "water.json"]].concat();
    folder().config(config).start(&arguments)
}

fn suggest(client: &mut Client, name: &str) -> Value {
    let mut request = without(&["mean", "std"]);
    request["op"] = json!("suggest_image");
    request["distance_m"] = json!(PLACE.0);
    request["light_pct"] = json!(PLACE.1);
    request["image"] = json!({"path": name});
    client.ask(&request)
}

fn near(one: &Value, other: &Value, most: f64) {
    for field in ["std", "mean", "predicted_here", "predicted_contrast"] {
        for k in 0..3 {
            let [one, other] = [one, other].map(|reply| {
                reply[field][k]
                    .as_f64()
                    .unwrap_or_else(|| panic!("{field}: {reply}"))
            });
            assert!((one / other - 1.0).abs() < most, "{field}: {one} {other}");
        }
    }
}

#[test]
fn pictures_of_a_lens_are_advised_from_as_those_of_the_ideal_camera() {
    let plain = suggest(
        &mut start("[images]\ndirectory = \".\"\n").client(),
        "ideal.png",
    );
    assert_eq!(plain["predictor"], "physics", "{plain}");
    let mut program = start(CONFIG);
    let mut client = program.client();
    let info = client.ask(&json!({"op": "info"}));
    let told = json!({"stored_px": STORED_PX, "ideal_px": SIZE_PX, "hfov_deg": HFOV_DEG});
    let images = &info["settings"]["images"];
    assert_eq!(
        (&images["undistortion"], &images["mask"]),
        (&told, &Value::Null)
    );
    let reply = suggest(&mut client, "stored.png");
    assert_eq!(
        (&reply["width"], &reply["height"]),
        (&json!(320), &json!(192))
    );
    near(&reply, &plain, 0.03);
    for field in ["valid", "action"] {
        assert_eq!(reply[field], plain[field], "{reply} {plain}");
    }
    // A picture that is the ideal camera's already is none of this one's.
    let other = suggest(&mut client, "ideal.png");
    assert_eq!(other["error"]["code"], "bad_image");
    let told = other["error"]["message"].as_str().unwrap();
    assert!(
        told.contains("must have the 448 x 272 pixels of the camera's file, got 320 x 192"),
        "{told}"
    );
}

/// EXIF of a picture that was exposed for 1/`per_second` s at f/1 and an ISO; without that it says nothing but the time.
fn exif(per_second: u32, iso: Option<u32>) -> Vec<u8> {
    let number = |value: u32| value.to_le_bytes().to_vec();
    let entry = |tag: u16, kind: u16, value: u32| {
        let head = [tag.to_le_bytes(), kind.to_le_bytes()].concat();
        [head, number(1), number(value)].concat()
    };
    // Fractions lie behind the two lists of entries: the exposure's begins at 26.
    let entries = if iso.is_some() { 3 } else { 1 };
    let behind = 26 + 2 + 12 * entries + 4;
    let mut bytes = [
        b"II*\0".to_vec(),
        number(8),
        vec![1, 0],
        entry(0x8769, 4, 26),
        number(0),
    ]
    .concat();
    bytes.extend((entries as u16).to_le_bytes());
    bytes.extend(entry(0x829a, 5, behind));
    if let Some(iso) = iso {
        bytes.extend(entry(0x829d, 5, behind + 8));
        bytes.extend(entry(0x8827, 3, iso));
    }
    bytes.extend(
        [
            number(0),
            number(1),
            number(per_second),
            number(1),
            number(1),
        ]
        .concat(),
    );
    bytes
}

/// A folder whose water file is of pictures with this noise, at a time · ISO of 1/100 s.
fn exposed_folder(noise: [f64; 2], iso: f64) -> Program {
    let program = folder().config("[images]\ndirectory = \".\"\n");
    let mut file = water_file(&[0.5, 1.0, 2.0, 4.0], noise);
    let names = ["a_r", "a_g", "a_b", "b_r", "b_g", "b_b"];
    let row = |i: usize| (0..6).map(|j| f64::from(u8::from(i == j))).collect();
    file.fit = Some(FitNumbers {
        a_relative_error: [0.01; 3],
        b_relative_error: [0.01; 3],
        backscatter_relative_error: 0.01,
        jerlov: None,
        jerlov_error: None,
        lamp_gain: [1.0; 3],
        lamp_gain_relative_error: [0.01; 3],
        daylight_gain: None,
        daylight_gain_relative_error: None,
        reflectance: [0.3; 3],
        names: names.map(str::to_owned).to_vec(),
        correlation: (0..6).map(row).collect(),
        not_identified: Vec::new(),
        misfit: 1.0,
        exposure_s: Some(0.01),
        iso: Some(iso),
    });
    std::fs::write(program.path("water.json"), file.to_json()).unwrap();
    program
}

/// The ideal camera's picture with `share` of its light, stored with noise that is `gain` times as sensitive a camera's.
fn write_exposed(
    program: &Program,
    name: &str,
    (share, gain): (f64, f64),
    [a, b]: [f64; 2],
    exif: Vec<u8>,
) {
    let mut picture = image::open(program.path("ideal.png")).unwrap().to_rgb8();
    let mut numbers = Numbers::new(7);
    for count in picture.iter_mut() {
        let light = share * Encoding::Srgb.light(f64::from(*count));
        let deviation = (a * gain * light + b * gain * gain).sqrt();
        let seen = light + deviation * numbers.normal();
        *count = Encoding::Srgb.counts(seen).round() as u8;
    }
    let out = std::fs::File::create(program.path(name)).unwrap();
    let mut encoder = PngEncoder::new(out);
    encoder.set_exif_metadata(exif).unwrap();
    let of_bytes = image::ExtendedColorType::Rgb8;
    encoder
        .write_image(&picture, SIZE_PX[0], SIZE_PX[1], of_bytes)
        .unwrap();
}

#[test]
fn a_picture_of_another_exposure_is_brought_to_that_of_the_water_file() {
    let program = exposed_folder(QUIET, 1.0);
    let write = |name: &str, share: f64, exif: Vec<u8>| {
        write_exposed(&program, name, (share, 1.0), [0.0; 2], exif);
    };
    write("same.png", 1.0, exif(100, Some(1)));
    write("shorter.png", 0.5, exif(200, Some(1)));
    // Without ISO and f-number it may be any exposure.
    write("unknown.png", 1.0, exif(7, None));
    let mut program = program.start(&[&ANY_PORT[..], &["--water", "water.json"]].concat());
    let mut client = program.client();
    let same = suggest(&mut client, "same.png");
    near(&same, &suggest(&mut client, "ideal.png"), 1e-9);
    near(&suggest(&mut client, "shorter.png"), &same, 0.03);
    let unknown = suggest(&mut client, "unknown.png");
    near(&unknown, &same, 1e-9);
    let reasons = |reply: &Value| {
        let warnings = reply["warnings"].as_array().cloned().unwrap_or_default();
        let reason = |warning: &Value| warning["reason"].as_str().unwrap_or_default().to_owned();
        warnings.iter().map(reason).collect::<Vec<_>>()
    };
    assert!(
        reasons(&unknown).contains(&"unknown_exposure".to_owned()),
        "{unknown}"
    );
    assert!(
        !reasons(&same).contains(&"unknown_exposure".to_owned()),
        "{same}"
    );
}

/// A shorter exposure has more noise than the water file's camera, and so has a more sensitive one in as much less light: none of it is detail.
#[test]
fn the_noise_of_another_exposure_is_not_taken_for_detail() {
    let noise = [3e-4, 2e-6];
    let program = exposed_folder(noise, 4.0);
    for (name, share, gain, exif) in [
        ("same.png", 1.0, 1.0, exif(400, Some(4))),
        ("shorter.png", 0.25, 1.0, exif(1600, Some(4))),
        ("sensitive.png", 1.0, 4.0, exif(1600, Some(16))),
        ("insensitive.png", 1.0, 0.25, exif(100, Some(1))),
    ] {
        write_exposed(&program, name, (share, gain), noise, exif);
    }
    let mut program = program.start(&[&ANY_PORT[..], &["--water", "water.json"]].concat());
    let mut client = program.client();
    let same = suggest(&mut client, "same.png");
    for (name, stds) in [
        ("shorter.png", 1.2..9.0),
        ("sensitive.png", 1.2..9.0),
        ("insensitive.png", 0.1..0.98),
    ] {
        let reply = suggest(&mut client, name);
        for k in 0..3 {
            let of = |reply: &Value, field: &str| {
                let number = reply[field][k].as_f64();
                number.unwrap_or_else(|| panic!("{name}: {field}: {reply}"))
            };
            let std = of(&reply, "std") / of(&same, "std");
            assert!(stds.contains(&std), "{name}: {reply}");
            // Held against what the sensor makes at its own sensitivity.
            let noise = of(&reply, "noise_share");
            assert!((noise - 1.0).abs() < 0.15, "{name}: {reply}");
            for field in ["predicted_here", "predicted_contrast"] {
                let share = of(&reply, field) / of(&same, field);
                assert!((share - 1.0).abs() < 0.05, "{name}: {field} {reply} {same}");
            }
        }
    }
}

#[test]
fn what_a_mask_covers_does_not_count() {
    let config = format!("{CONFIG}mask = \"mask.toml\"\n");
    let mut program = start(&config);
    let mut client = program.client();
    let info = client.ask(&json!({"op": "info"}));
    let share = &info["settings"]["images"]["mask"]["left_out"];
    let covered = 90.0 * 72.0 / (f64::from(STORED_PX[0]) * f64::from(STORED_PX[1]));
    assert!((share.as_f64().unwrap() - covered).abs() < 1e-4, "{info}");
    let whole = suggest(&mut client, "stored.png");
    near(&suggest(&mut client, "covered.png"), &whole, 1e-9);
    let bare = suggest(&mut start(CONFIG).client(), "covered.png");
    let [bare, whole] = [&bare, &whole].map(|reply| reply["mean"][1].as_f64().unwrap());
    assert!(bare > 1.03 * whole, "{bare} {whole}");
}

#[test]
fn a_lens_of_another_camera_is_refused_and_a_file_that_is_none_ends_the_start() {
    let mut program = folder().write("lens.json", &lens(70.0)).config(CONFIG);
    let physics = ["--water", "water.json"];
    let checked = program.output(&[&physics[..], &["--check-config"]].concat());
    let words = "vehicle and water file must be of the same camera and lamps: camera.hfov_deg is 70 of the vehicle and 53.13";
    assert!(
        text(&checked.stderr).contains(words),
        "{}",
        text(&checked.stderr)
    );
    program = program.start(&[&ANY_PORT[..], &physics].concat());
    let reply = suggest(&mut program.client(), "stored.png");
    assert_eq!(
        (&reply["valid"], &reply["reason"]),
        (&json!(false), &json!("other_camera"))
    );
    for (name, words) in [
        (
            "mask.toml",
            "images.undistortion: mask.toml: not a usable file of uw-undistortion/1",
        ),
        (
            "none.json",
            "images.undistortion: none.json: cannot be read",
        ),
    ] {
        let program = folder().config(&CONFIG.replace("lens.json", name));
        let output = program.output(&["--check-config"]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(
            text(&output.stderr).contains(words),
            "{}",
            text(&output.stderr)
        );
    }
}
