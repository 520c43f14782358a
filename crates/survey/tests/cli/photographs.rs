//! Calibration from photographs: exposures of EXIF, a lens, a mask, folders of frames, and files that are not what they should be.

use glam::DVec3;
use image::{DynamicImage, GrayImage, ImageBuffer, Rgb, RgbImage};
use serde_json::{Value, json};
use uw_calib::{Encoding, Profile, Undistortion};
use uw_render::image::{Counts, Frame};
use uw_render::scene::Scene;
use uw_survey::photograph::{Exposed, jpeg};

use super::support::{Folder, numbers};

const HEADER: &str = "file,kind,depth_m,distance_m,light_pct\n";
/// Size of the pictures, pixels.
const SIZE: [u32; 2] = [160, 96];
/// An ideal camera of that size.
const VEHICLE: &str = "format = \"uw-vehicle/1\"\nwidth = 160\nheight = 96\nhfov_deg = 50.0\nnoise_a = 1e-6\nnoise_b = 1e-7\n";
/// A camera with a fisheye, larger and wider than that.
const CAMERA: &str = "format = \"uw-scene/1\"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nfisheye = [0.02, 0.0, 0.0, 0.0]\nhfov_deg = 70.0\n\
    width = 240\nheight = 144\n";
const MASK: &str = "format = \"uw-mask/1\"\nwidth = 160\nheight = 96\n[[polygon]]\npoints = [[0, 60], [50, 96], [0, 96]]\n";

/// Light of a wall of soft stripes, brightest in the middle, by the tangents of the direction.
fn wall(across: f64, down: f64) -> f64 {
    let fall = (1.4 - 4.0 * (across * across + down * down)).max(0.1);
    fall * (0.5 + 0.3 * (70.0 * across + 15.0 * down).sin())
}

/// The wall as an ideal camera of 50 degrees stores it in light of some brightness.
fn picture(brightness: f64) -> RgbImage {
    let half = SIZE.map(|side| f64::from(side) / 2.0);
    let per_pixel = 25f64.to_radians().tan() / half[0];
    RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        stored(
            brightness
                * over_pixel(x, y, |x, y| {
                    wall((x - half[0]) * per_pixel, (y - half[1]) * per_pixel)
                }),
        )
    })
}

/// Mean of a function of the image point over a pixel.
fn over_pixel(x: u32, y: u32, of: impl Fn(f64, f64) -> f64) -> f64 {
    let part = |i: u32| (f64::from(i) + 0.5) / 3.0;
    let at = |i: u32| of(f64::from(x) + part(i % 3), f64::from(y) + part(i / 3));
    (0..9).map(at).sum::<f64>() / 9.0
}

fn stored(light: f64) -> Rgb<u8> {
    Rgb([Encoding::Srgb.counts(light).round() as u8; 3])
}

fn save(folder: &Folder, name: &str, picture: &RgbImage) {
    picture.save(folder.path(name)).expect("written");
}

/// As a camera writes it that was exposed for 1/`per_second` s.
fn photograph(folder: &Folder, name: &str, picture: &RgbImage, per_second: f64) {
    let frame = Frame {
        width: picture.width(),
        height: picture.height(),
        counts: Counts::Bits8(picture.as_raw().clone()),
    };
    let exposed = Exposed {
        time_s: 1.0 / per_second,
        f_number: Some(2.8),
        iso: Some(100),
    };
    folder.write(name, jpeg(&frame, 100, Some(&exposed)).expect("a JPEG"));
}

fn profile(folder: &Folder, name: &str) -> Profile {
    Profile::read(&folder.path(name)).expect("a profile")
}

/// Brightness of the pictures, and of each what it was exposed over the shortest.
const LIGHTS: [(&str, f64, f64); 6] = [
    ("d1_0", 0.10, 4.0),
    ("d1_60", 0.40, 1.0),
    ("d2_0", 0.08, 4.0),
    ("d2_60", 0.25, 2.0),
    ("d3_0", 0.06, 8.0),
    ("d3_60", 0.15, 4.0),
];

/// Pictures at one exposure (`.png`), and at their own, as photographs (`.jpg`) and without EXIF (`_own.png`).
fn exposures(folder: &Folder) {
    save(folder, "up.png", &picture(0.5));
    for (name, light, over) in LIGHTS {
        save(folder, &format!("{name}.png"), &picture(light));
        save(folder, &format!("{name}_own.png"), &picture(light * over));
        photograph(
            folder,
            &format!("{name}.jpg"),
            &picture(light * over),
            480.0 / over,
        );
    }
    let text = |ending: &str| {
        let mut text = HEADER.to_owned() + "up.png,depth,1,,\n";
        for (name, ..) in LIGHTS {
            let (distance, light) = (&name[1..2], &name[3..]);
            text += &format!("{name}{ending},contrast,2,{distance},{light}\n");
        }
        text
    };
    folder.write("one.csv", text(".png"));
    folder.write("photographs.csv", text(".jpg"));
    let mut column = text("_own.png")
        .replacen("light_pct", "light_pct,exposure", 1)
        .replacen("1,,\n", "1,,,\n", 1);
    for (name, _, over) in LIGHTS {
        let row = format!("{name}_own.png,contrast,2,{},{}", &name[1..2], &name[3..]);
        column = column.replace(&row, &format!("{row},{over}"));
    }
    folder.write("column.csv", column);
}

fn assert_same(one: &Profile, other: &Profile, error: f64) {
    for distance in [1.0, 2.0, 3.0] {
        for (a, b) in [
            (one.k_c_on(distance), other.k_c_on(distance)),
            (one.k_c_off(distance), other.k_c_off(distance)),
        ] {
            let (a, b) = (a.expect("inside")[1], b.expect("inside")[1]);
            assert!((a / b - 1.0).abs() < error, "{distance} {a} {b}");
        }
    }
}

#[test]
fn photographs_of_many_exposures_are_those_of_one() {
    let folder = Folder::new();
    exposures(&folder);
    folder.good("calibrate one.csv -o one.json");
    let one = profile(&folder, "one.json");
    assert!(one.source().approximate().is_none());
    let told = folder
        .good("calibrate photographs.csv -o photographs.json")
        .stderr;
    assert!(
        told.contains("5 of 6 pictures of the target were exposed 2 to 8 times"),
        "{told}"
    );
    assert!(told.contains("that of d1_60.jpg (line 4)"), "{told}");
    let made = profile(&folder, "photographs.json");
    assert_same(&made, &one, 0.02);
    assert!(
        made.source()
            .approximate()
            .is_some_and(|what| what.contains("exposed"))
    );
    // The column says the same of files that do not.
    folder.good("calibrate column.csv -o column.json");
    assert_same(&profile(&folder, "column.json"), &one, 0.02);
    // To the exposure of the darkest picture, 1/60 s: eight times as bright.
    let asked = 100.0 / (2.8 * 2.8) / 60.0;
    let run = folder.good(&format!(
        "calibrate photographs.csv -o asked.json --exposure {asked}"
    ));
    assert!(run.stderr.contains("full scale"), "{}", run.stderr);
    let right = uw_calib::ImageStats::from_file(&folder.path("d3_0_own.png")).expect("a picture");
    let k_c = profile(&folder, "asked.json").k_c_off(3.0).expect("inside")[1];
    assert!(
        (k_c / right.contrast[1] - 1.0).abs() < 0.02,
        "{k_c} {right:?}"
    );
    folder.refused(
        "calibrate photographs.csv -o p.json --exposure 0",
        &["--exposure", "above 0"],
    );
    let list = folder.good("stats --json d3_0.jpg");
    let list: Value = serde_json::from_str(&list.stdout).expect("JSON");
    assert_eq!(list[0]["iso"], 100.0);
    let time_s = list[0]["exposure_time_s"].as_f64().expect("a number");
    assert!((time_s * 60.0 - 1.0).abs() < 1e-3, "{time_s}");
}

/// The wall as the fisheye stores it in light of some brightness.
fn distorted(folder: &Folder, brightness: f64) -> RgbImage {
    folder.write("camera.toml", CAMERA);
    let camera = Scene::read(&folder.path("camera.toml"))
        .expect("a scene")
        .camera;
    RgbImage::from_fn(camera.width, camera.height, |x, y| {
        stored(
            brightness
                * over_pixel(x, y, |x, y| {
                    let towards: DVec3 = camera.direction(x, y);
                    let ahead = towards.dot(camera.forward);
                    wall(
                        towards.dot(camera.right) / ahead,
                        towards.dot(camera.down) / ahead,
                    )
                }),
        )
    })
}

#[test]
fn a_lens_is_taken_out_of_pictures() {
    let folder = Folder::new();
    folder.write("mine.toml", VEHICLE);
    save(&folder, "ideal.png", &picture(0.5));
    save(&folder, "fisheye.png", &distorted(&folder, 0.5));
    let contrast = |line: &str| {
        let run = folder.good(&format!("stats --json {line}"));
        let list: Value = serde_json::from_str(&run.stdout).expect("JSON");
        assert_eq!(list[0]["width"], 160, "{line}");
        ["contrast", "contrast_corrected", "mean"]
            .map(|field| list[0][field][1].as_f64().expect("a number"))
    };
    let ideal = contrast("ideal.png --vehicle mine.toml");
    let made = contrast("fisheye.png --vehicle mine.toml --camera camera.toml");
    for (made, ideal) in made.iter().zip(ideal) {
        assert!((made / ideal - 1.0).abs() < 0.01, "{made} {ideal}");
    }
    // A calibration's pictures alike.
    let rows = |file: &str| {
        format!(
            "{HEADER}{file},depth,1,,\n{file},contrast,1,1,0\n{file},contrast,1,2,0\n{file},contrast,1,1,50\n{file},contrast,1,2,50\n"
        )
    };
    folder.write("ideal.csv", rows("ideal.png"));
    folder.write("fisheye.csv", rows("fisheye.png"));
    folder.good("calibrate ideal.csv --vehicle mine.toml -o ideal.json");
    folder.good("calibrate fisheye.csv --vehicle mine.toml --camera camera.toml -o fisheye.json");
    let k_c = |name: &str| profile(&folder, name).k_c_on(1.5).expect("inside")[0];
    assert!((k_c("fisheye.json") / k_c("ideal.json") - 1.0).abs() < 0.02);
    // Without a vehicle nobody knows which camera is ideal; sizes must be right; what is not seen is told.
    folder.refused(
        "stats fisheye.png --camera camera.toml",
        &["--camera needs --vehicle"],
    );
    folder.refused(
        "calibrate ideal.csv --vehicle mine.toml --camera camera.toml -o p.json",
        &[
            "ideal.csv:2",
            "ideal.png",
            "240 x 144 pixels of the camera's file, got 160 x 96",
        ],
    );
    folder.write("wide.toml", VEHICLE.replace("50.0", "80.0"));
    let told = folder
        .good("stats fisheye.png --vehicle wide.toml --camera camera.toml")
        .stderr;
    assert!(
        told.contains("does not see") && told.contains("hfov_deg 80"),
        "{told}"
    );
    folder.write("wider.toml", VEHICLE.replace("50.0", "150.0"));
    folder.refused(
        "stats fisheye.png --vehicle wider.toml --camera camera.toml",
        &["--camera", "smaller field of view"],
    );
    folder.write(
        "none.toml",
        "format = \"uw-scene/1\"\n[camera]\nwidth = 3\n",
    );
    folder.refused(
        "stats fisheye.png --vehicle mine.toml --camera none.toml",
        &["--camera", "none.toml"],
    );
}

/// A picture that was exposed longer than those of the water file, and one that does not say.
#[test]
fn physics_predicts_from_pictures_of_another_exposure() {
    let folder = Folder::new();
    folder.write("mine.toml", VEHICLE);
    folder.write("places.csv", "distance_m,light_pct\n1.0,0\n1.2,60\n");
    folder.good("water-tables --jerlov IB --vehicle mine.toml --distances-m 0.8 1.5 --views 3 --depths-m 3 --kilo-paths 8 -o plain.json");
    let mut water: Value = serde_json::from_str(&folder.text("plain.json")).expect("JSON");
    let identity: Vec<Vec<u8>> = (0..6)
        .map(|i| (0..6).map(|j| u8::from(i == j)).collect())
        .collect();
    let (one, error) = ([1.0; 3], [0.01; 3]);
    water["fit"] = json!({
        "a_relative_error": error, "b_relative_error": error, "backscatter_relative_error": 0.01, "lamp_gain": one,
        "lamp_gain_relative_error": error, "daylight_gain": null, "reflectance": one,
        "names": ["a_r", "a_g", "a_b", "b_r", "b_g", "b_b"], "correlation": identity, "not_identified": [], "misfit": 1,
        // 1/480 s · 100 / 2.8².
        "exposure_s": 100.0 / 480.0 / 2.8f64.powi(2),
    });
    folder.write("water.json", water.to_string());
    save(&folder, "same.png", &picture(0.1));
    photograph(&folder, "same.jpg", &picture(0.1), 480.0);
    photograph(&folder, "longer.jpg", &picture(0.4), 120.0);
    let predict = |image: &str| {
        let run = folder.good(&format!(
            "predict --water water.json --distance-m 1.0 --light-pct 20 --candidates places.csv -o out.csv --image {image}"
        ));
        (numbers(&folder.text("out.csv")), run.stderr)
    };
    let (same, told) = predict("same.jpg");
    assert!(!told.contains("expos"), "{told}");
    let (longer, told) = predict("longer.jpg");
    assert!(
        told.contains("longer.jpg: was exposed 4 times as long as the water file's"),
        "{told}"
    );
    for (longer, same) in longer.iter().zip(&same) {
        for k in 2..5 {
            assert!(
                (longer[k] / same[k] - 1.0).abs() < 0.03,
                "{longer:?} {same:?}"
            );
        }
    }
    let (_, told) = predict("same.png");
    assert!(
        told.contains("same.png: does not state time, ISO and f-number"),
        "{told}"
    );
    std::fs::create_dir(folder.path("frames")).expect("made");
    save(&folder, "frames/1.png", &picture(0.1));
    folder.refused(
        "predict --water water.json --distance-m 1.0 --light-pct 20 --candidates places.csv -o out.csv --image frames",
        &["frames: must be one picture, got a folder"],
    );
    let wrong = folder
        .text("water.json")
        .replace("\"exposure_s\":", "\"exposure_s\":-");
    folder.write("wrong.json", wrong);
    folder.refused(
        "predict --water wrong.json --image same.png --distance-m 1.0 --light-pct 20 --candidates places.csv -o out.csv",
        &["wrong.json", "fit.exposure_s must be finite and > 0, got -0.02"],
    );
}

/// From pictures of the water file's own camera and of one with a fisheye, with parts of the vehicle before it.
#[test]
fn physics_predicts_from_pictures_of_a_lens_as_from_those_of_the_ideal_camera() {
    let folder = Folder::new();
    folder.write("mine.toml", VEHICLE);
    folder.write("places.csv", "distance_m,light_pct\n1.0,0\n1.2,60\n");
    folder.good("water-tables --jerlov IB --vehicle mine.toml --distances-m 0.8 1.5 --views 3 --depths-m 3 --kilo-paths 8 -o water.json");
    save(&folder, "ideal.png", &picture(0.12));
    save(&folder, "fisheye.png", &distorted(&folder, 0.12));
    let predict = |options: &str| {
        folder.good(&format!(
            "predict --water water.json --distance-m 1.0 --light-pct 20 --candidates places.csv -o out.csv --image {options}"
        ));
        numbers(&folder.text("out.csv"))
    };
    let ideal = predict("ideal.png");
    let mut covered = distorted(&folder, 0.12);
    for (x, y, pixel) in covered.enumerate_pixels_mut() {
        if x < 60 && y > 110 {
            *pixel = Rgb([255; 3]);
        }
    }
    save(&folder, "covered.png", &covered);
    folder.write(
        "frame.toml",
        "format = \"uw-mask/1\"\nwidth = 240\nheight = 144\n[[polygon]]\npoints = [[0, 109], [61, 109], [61, 144], [0, 144]]\n",
    );
    for (options, most) in [
        ("fisheye.png --camera camera.toml", 0.01),
        ("covered.png --camera camera.toml --mask frame.toml", 0.05),
    ] {
        for (made, ideal) in predict(options).iter().zip(&ideal) {
            for k in 2..5 {
                assert!(
                    (made[k] / ideal[k] - 1.0).abs() < most,
                    "{options}: {made:?} {ideal:?}"
                );
            }
        }
    }
    folder.refused(
        "predict --water water.json --image fisheye.png --distance-m 1.0 --light-pct 20 --candidates places.csv -o out.csv",
        &["fisheye.png: the picture must have 160 x 96 pixels", "got 240 x 144"],
    );
    // The same for the daemon.
    folder.good("undistortion camera.toml --vehicle mine.toml -o lens.json");
    let lens = Undistortion::read(&folder.path("lens.json")).expect("a file");
    assert_eq!((lens.hfov_deg(), lens.ideal_px()), (50.0, SIZE));
    let middle = lens.far().at(80.0, 48.0).expect("seen");
    assert!((middle[0] - 120.0).abs() < 1e-3 && (middle[1] - 72.0).abs() < 1e-3);
    folder.write("wider.toml", VEHICLE.replace("50.0", "150.0"));
    folder.refused(
        "undistortion camera.toml --vehicle wider.toml -o lens.json",
        &["camera: camera.toml", "smaller field of view"],
    );
}

#[test]
fn what_a_mask_covers_does_not_count() {
    let folder = Folder::new();
    folder.write("mask.toml", MASK);
    let mut covered = picture(0.5);
    for (x, y, pixel) in covered.enumerate_pixels_mut() {
        if y >= 61 && 36 * x < 50 * (y - 61) {
            *pixel = Rgb([if (x + y) % 2 == 0 { 0 } else { 255 }; 3]);
        }
    }
    save(&folder, "covered.png", &covered);
    save(&folder, "free.png", &picture(0.5));
    // The same as a picture: black is left out.
    let dark = GrayImage::from_fn(SIZE[0], SIZE[1], |x, y| {
        image::Luma([if 36 * x < 50 * y.saturating_sub(60) {
            0
        } else {
            255
        }])
    });
    dark.save(folder.path("mask.png")).expect("written");
    let contrast = |line: &str| {
        let list = folder.good(&format!("stats --json {line}"));
        let list: Value = serde_json::from_str(&list.stdout).expect("JSON");
        (
            list[0]["contrast"][0].as_f64().expect("a number"),
            list[0]["saturated"][0].as_f64(),
        )
    };
    let (free, _) = contrast("free.png --mask mask.toml");
    for mask in ["mask.toml", "mask.png"] {
        let (got, saturated) = contrast(&format!("covered.png --mask {mask}"));
        assert!(
            (got / free - 1.0).abs() < 0.01 && saturated == Some(0.0),
            "{got} {free} {saturated:?}"
        );
    }
    assert!(contrast("covered.png").0 > 1.2 * free);
    let wrong = |text: String, words: &[&str]| {
        folder.write("wrong.toml", text);
        folder.refused("stats free.png --mask wrong.toml", words);
    };
    wrong(
        MASK.replace("[50, 96]", "[500, 96]"),
        &[
            "wrong.toml",
            "polygon 1: point 2",
            "0 .. 160 across",
            "[500, 96]",
        ],
    );
    wrong(
        MASK.replace("width = 160", "width = 320"),
        &[
            "free.png",
            "mask's 320 x 96 pixels (wrong.toml), got 160 x 96",
        ],
    );
    folder.refused("stats free.png --mask gone.png", &["gone.png", "uw-mask/1"]);
    let all = MASK.replace(
        "[[0, 60], [50, 96], [0, 96]]",
        "[[0, 0], [160, 0], [160, 95], [0, 95]]",
    );
    wrong(
        all,
        &["free.png", "no patch of the 10 x 6 grid is half left"],
    );
}

#[test]
fn a_folder_stands_for_the_mean_of_its_frames() {
    let folder = Folder::new();
    for name in ["frames", "moved", "empty"] {
        std::fs::create_dir(folder.path(name)).expect("a folder");
    }
    folder.write("empty/notes.txt", "none");
    let mut state = 1_u32;
    for i in 0..8 {
        let mut noisy = picture(0.5);
        for count in noisy.iter_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *count = count.saturating_add_signed((state >> 24) as i8 / 16);
        }
        save(&folder, &format!("frames/{i}.png"), &noisy);
        let shifted =
            image::imageops::crop_imm(&noisy, if i == 5 { 4 } else { 0 }, 0, SIZE[0] - 4, SIZE[1])
                .to_image();
        save(&folder, &format!("moved/{i}.png"), &shifted);
    }
    save(&folder, "clean.png", &picture(0.5));
    let rows = |file: &str| {
        format!(
            "{HEADER}clean.png,depth,1,,\n{file},contrast,1,1,0\n{file},contrast,1,2,0\n{file},contrast,1,1,50\n{file},contrast,1,2,50\n"
        )
    };
    folder.write("m.csv", rows("frames"));
    folder.good("calibrate m.csv -o frames.json");
    let k_c = profile(&folder, "frames.json").k_c_on(1.0).expect("inside")[0];
    let right = uw_calib::ImageStats::from_file(&folder.path("clean.png"))
        .expect("a picture")
        .contrast[0];
    assert!((k_c / right - 1.0).abs() < 0.02, "{k_c} {right}");
    folder.write("m.csv", rows("moved"));
    let told = folder.good("calibrate m.csv -o moved.json").stderr;
    assert!(
        told.contains("m.csv:3: 1 of 8 frames moved") && told.contains("5.png"),
        "{told}"
    );
    folder.write("m.csv", rows("empty"));
    folder.refused(
        "calibrate m.csv -o p.json",
        &["m.csv:3", "empty", "holds no picture"],
    );
}

#[test]
fn other_kinds_of_files_are_measured_or_named() {
    let folder = Folder::new();
    let plain = picture(0.5);
    save(&folder, "plain.png", &plain);
    let deep = ImageBuffer::from_fn(SIZE[0], SIZE[1], |x, y| {
        Rgb(plain.get_pixel(x, y).0.map(|c| u16::from(c) * 257))
    });
    DynamicImage::ImageRgb16(deep)
        .save(folder.path("deep.tif"))
        .expect("written");
    let grey = DynamicImage::ImageRgb8(plain.clone()).to_luma8();
    grey.save(folder.path("grey.png")).expect("written");
    let list = folder.good("stats --json plain.png deep.tif grey.png");
    let list: Value = serde_json::from_str(&list.stdout).expect("JSON");
    let of = |i: usize| list[i]["contrast"][2].as_f64().expect("a number");
    assert!(
        (of(0) - of(1)).abs() < 1e-9 && (of(0) - of(2)).abs() < 1e-9,
        "{list}"
    );
    let colourless = grey.save_with_format(folder.path("grey.jpg"), image::ImageFormat::Jpeg);
    colourless.expect("written");
    let list = folder.good("stats --json grey.jpg");
    let list: Value = serde_json::from_str(&list.stdout).expect("JSON");
    let jpeg = list[0]["contrast"][2].as_f64().expect("a number");
    assert!((jpeg / of(0) - 1.0).abs() < 0.05, "{jpeg}");
    // EXIF that ends before it begins says nothing, and harms nothing.
    photograph(&folder, "plain.jpg", &plain, 60.0);
    let bytes = folder.read("plain.jpg");
    let cut = [
        &bytes[..2],
        &[0xff, 0xe1, 0, 12],
        b"Exif\0\0MM*\0",
        &bytes[2..],
    ]
    .concat();
    folder.write("cut.jpg", cut);
    folder.good("stats cut.jpg");
}
