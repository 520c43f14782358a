//! `uw predict`.

use std::fs;

use super::support::{Folder, numbers, shipped};

/// A folder with a model as `model.json` and its reference inputs and predictions as text.
fn with_model() -> (Folder, String) {
    let folder = Folder::new();
    let data = shipped("guidance/tests/data");
    fs::copy(data.join("mlp_a.json"), folder.path("model.json")).expect("copied");
    let table = fs::read_to_string(data.join("mlp_a_io.csv")).expect("table");
    (folder, table)
}

fn reversed(table: &str) -> String {
    let line = |line: &str| line.split(',').rev().collect::<Vec<_>>().join(" , ");
    table.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn predictions_are_those_of_the_reference_in_any_order_of_columns() {
    let (folder, table) = with_model();
    folder
        .write("in.csv", &table)
        .write("reversed.csv", reversed(&table));
    folder.good("predict --model model.json in.csv -o out.csv");
    let predictions = folder.text("out.csv");
    assert!(predictions.starts_with("contrast_r,contrast_g,contrast_b\n"));
    let (got, expected) = (numbers(&predictions), numbers(&table));
    assert_eq!((got.len(), expected.len()), (500, 500));
    for (got, expected) in got.iter().zip(&expected) {
        for k in 0..3 {
            // Columns 23.. are the predictions with the float32 weights, in double precision; the model file
            // prints these weights in 8 or 9 digits, which moves predictions by some 1e-7 counts.
            assert!(
                (got[k] - expected[23 + k]).abs() < 1e-6,
                "{got:?} {expected:?}"
            );
        }
    }
    folder.good("predict --model model.json reversed.csv -o again.csv");
    assert_eq!(folder.text("again.csv"), predictions);
}

#[test]
fn tables_that_do_not_fit_the_model_are_refused() {
    let (folder, table) = with_model();
    folder.write("missing.csv", table.replacen("kz_g", "kz_green", 1));
    folder.refused(
        "predict --model model.json missing.csv -o out.csv",
        &["missing.csv:1:", "lacks", "kz_g"],
    );
    folder.write("twice.csv", table.replacen("keras_contrast_r", "light", 1));
    folder.refused(
        "predict --model model.json twice.csv -o out.csv",
        &["twice.csv:1:", "light", "twice"],
    );
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    lines[3] = lines[3].replacen("1.", "dark", 1);
    folder.write("word.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json word.csv -o out.csv",
        &["word.csv:4:", "kz_r must be a finite number, got \"dark"],
    );
    lines[3] = lines[3].replacen("dark", "nan", 1);
    folder.write("nan.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json nan.csv -o out.csv",
        &["nan.csv:4:", "kz_r"],
    );
    lines[3] = "1,2,3".to_owned();
    folder.write("short.csv", lines.join("\n"));
    folder.refused(
        "predict --model model.json short.csv -o out.csv",
        &["short.csv", "line: 4"],
    );
    folder.refused(
        "predict --model model.json none.csv -o out.csv",
        &["none.csv"],
    );
}

#[test]
fn a_model_of_a_wrong_shape_is_refused() {
    let (folder, table) = with_model();
    let model = folder.text("model.json");
    let wrong = model.replacen("\"units\":", "\"units\":1", 1);
    assert_ne!(wrong, model);
    folder.write("in.csv", &table).write("wrong.json", wrong);
    folder.refused(
        "predict --model wrong.json in.csv -o out.csv",
        &["wrong.json", "layers[0]."],
    );
    folder.write("text.json", "not a model");
    folder.refused(
        "predict --model text.json in.csv -o out.csv",
        &["text.json", "JSON"],
    );
}

#[test]
fn a_profile_in_the_place_of_a_model_is_called_one() {
    let (folder, table) = with_model();
    folder.write("in.csv", &table).write(
        "profile.json",
        "{\"format\": \"uw-profile/1\", \"depth\": []}",
    );
    folder.refused(
        "predict --model profile.json in.csv -o out.csv",
        &[
            "profile.json: format must be \"uw-mlp\" (a trained model)",
            "got \"uw-profile/1\" (a calibration profile)",
        ],
    );
}

/// A water file in the place of a model: the same picture again, then what the table does not know.
#[test]
fn physics_predicts_from_a_picture_in_a_known_water() {
    let folder = Folder::new();
    folder.write("places.csv", "distance_m,light_pct\n1.0,20\n1.2,60\n");
    folder.good(
        "water-tables --jerlov II --distances-m 0.8 1.5 --views 3 --depths-m 3 --kilo-paths 8 -o water.json",
    );
    let made = folder.text("water.json");
    assert!(
        made.contains("\"format\":\"uw-water/1\""),
        "{}",
        &made[..200]
    );
    // A checked target of 40 pixels a square, in the camera's size.
    let square = |x: u32, y: u32| ((x / 40 + y / 40) % 2) as u8;
    let picture = image::RgbImage::from_fn(1280, 720, |x, y| {
        image::Rgb([90, 110, 130].map(|v: u8| v + 12 * square(x, y)))
    });
    picture.save(folder.path("now.png")).expect("a picture");
    let arguments =
        "predict --water water.json --image now.png --distance-m 1.0 --light-pct 20 -o out.csv";
    let run = folder.good(&format!("{arguments} --candidates places.csv"));
    assert!(!run.stderr.contains("full scale"), "{}", run.stderr);
    let text = folder.text("out.csv");
    let header = "distance_m,light_pct,contrast_r,contrast_g,contrast_b,error_r,error_g,error_b";
    assert!(text.starts_with(header), "{text}");
    let rows = numbers(&text);
    // Squares of 12 counts deviate by 6; the sensor's noise of half a count to two is added.
    for k in 0..3 {
        let (contrast, error) = (rows[0][2 + k], rows[0][5 + k]);
        assert!((contrast - 6.0).abs() < 0.3 && error > 0.0, "{text}");
    }
    folder.write("beyond.csv", "distance_m,light_pct\n1.0,20\n1.8,60\n");
    folder.refused(
        &format!("{arguments} --candidates beyond.csv"),
        &["beyond.csv:3:", "distance_m", "0.8 to 1.5", "1.8"],
    );
    let mut spots = picture;
    for (x, y, pixel) in spots.enumerate_pixels_mut() {
        if (x + 3 * y) % 19 == 0 {
            pixel[0] = 255;
        }
    }
    spots.save(folder.path("now.png")).expect("a picture");
    let run = folder.good(&format!("{arguments} --candidates places.csv"));
    let told = "now.png: R: more than 1 % of the pixels are at full scale";
    assert!(run.stderr.contains(told), "{}", run.stderr);
    assert!(numbers(&folder.text("out.csv"))[0][2] > 6.0);
    image::RgbImage::from_pixel(1280, 720, image::Rgb([100, 100, 100]))
        .save(folder.path("now.png"))
        .expect("a picture");
    folder.refused(
        &format!("{arguments} --candidates places.csv"),
        &["now.png", "cannot be predicted", "noise"],
    );
    // Far brighter than white in this light.
    let glare = image::RgbImage::from_fn(1280, 720, |x, y| {
        image::Rgb([230u8; 3].map(|v| v + 12 * square(x, y)))
    });
    glare.save(folder.path("now.png")).expect("a picture");
    let lamps_off = format!("{arguments} --candidates places.csv").replace("20 -o", "0 -o");
    let run = folder.good(&lamps_off);
    assert!(
        run.stderr.contains("red: no target is as bright"),
        "{}",
        run.stderr
    );
    let text = folder.text("out.csv");
    assert!(text.contains("1,20,,"), "{text}");
    folder.refused("predict --water water.json -o out.csv", &["--image"]);
    folder.refused(
        "predict --water water.json in.csv --image now.png -o out.csv",
        &["--water"],
    );
}

/// Tables without daylight hold at any depth, and without lamps nothing is seen there but the noise of a black picture, two counts.
#[test]
fn in_the_dark_the_depth_does_not_count() {
    let folder = Folder::new();
    folder.write("places.csv", "distance_m,light_pct\n1.0,60\n1.0,0\n");
    let tables = "water-tables --jerlov II --distances-m 0.8 1.5 --views 3 --kilo-paths 8 --dark";
    folder.good(&format!("{tables} -o water.json"));
    folder.refused(
        &format!("{tables} --depths-m 3 -o other.json"),
        &["--dark", "--depths-m"],
    );
    let square = |x: u32, y: u32| ((x / 40 + y / 40) % 2) as u8;
    let picture = image::RgbImage::from_fn(1280, 720, |x, y| {
        image::Rgb([70, 90, 100].map(|v: u8| v + 12 * square(x, y)))
    });
    picture.save(folder.path("now.png")).expect("a picture");
    let at = |depth: &str| {
        format!(
            "predict --water water.json --image now.png --distance-m 1.0 --light-pct 60 {depth} --candidates places.csv -o out.csv"
        )
    };
    let predicted = ["", "--depth-m 0", "--depth-m 4000"].map(|depth| {
        folder.good(&at(depth));
        folder.text("out.csv")
    });
    assert!(
        predicted.iter().all(|text| *text == predicted[0]),
        "{predicted:?}"
    );
    let rows = numbers(&predicted[0]);
    for k in 2..5 {
        assert!(
            (rows[0][k] - 6.0).abs() < 0.6 && (1.5..2.5).contains(&rows[1][k]),
            "{predicted:?}"
        );
    }
    folder.refused(
        &at("--depth-m=-1"),
        &["--depth-m must be finite and >= 0, got -1"],
    );
}

/// What a vehicle saw from farther away tells what the present picture does not show.
#[test]
fn pictures_taken_before_predict_too() {
    let folder = Folder::new();
    folder.good(
        "water-tables --a 0.01,0.01,0.01 --b 0.01,0.01,0.01 --distances-m 0.5 2 --views 3 --depths-m 3 \
         --kilo-paths 8 -o water.json",
    );
    // In water as clear as this pictures are alike from all distances. Squares of two sizes; the larger ones are stronger and beyond what is seen from nearby.
    let view = |distance_m: f64, name: &str| {
        let px_per_m = 1200.0 / distance_m;
        let picture = image::RgbImage::from_fn(1280, 720, |x, y| {
            let at = |i: u32, middle: f64| (f64::from(i) - middle) / px_per_m;
            let (x, y) = (at(x, 640.0), at(y, 360.0));
            let checked = ((x / 0.03).floor() + (y / 0.03).floor()).rem_euclid(2.0) > 0.5;
            let strength = if x.hypot(y) < 0.35 { 6 } else { 20 };
            image::Rgb([90, 110, 130].map(|v: u8| v + strength * u8::from(checked)))
        });
        picture.save(folder.path(name)).expect("a picture");
    };
    view(0.5, "now.png");
    view(2.0, "before.png");
    folder
        .write("places.csv", "distance_m,light_pct\n2,0\n")
        .write("earlier.csv", "file,distance_m,light_pct\nbefore.png,2,0\n")
        .write(
            "beyond.csv",
            "file,distance_m,light_pct,depth_m\nbefore.png,2,0,9\n",
        )
        .write(
            "other.csv",
            "file,distance_m,light_pct,kind\nbefore.png,2,0,contrast\n",
        );
    let arguments = "predict --water water.json --image now.png --distance-m 0.5 --light-pct 0 \
                     --candidates places.csv -o out.csv";
    folder.good(arguments);
    let alone = numbers(&folder.text("out.csv"));
    folder.good(&format!("{arguments} --earlier earlier.csv"));
    let knowing = numbers(&folder.text("out.csv"));
    for k in 0..3 {
        // Squares of 20 counts deviate by 10, less in the middle.
        let (alone, knowing) = (alone[0][2 + k], knowing[0][2 + k]);
        assert!(
            alone < 4.5 && (7.0..11.0).contains(&knowing),
            "{alone} {knowing}"
        );
    }
    // A picture that shows nothing is said to be of no use.
    image::RgbImage::from_pixel(1280, 720, image::Rgb([100, 100, 100]))
        .save(folder.path("before.png"))
        .expect("a picture");
    let run = folder.good(&format!("{arguments} --earlier earlier.csv"));
    assert!(
        run.stderr
            .contains("earlier.csv:2: before.png is passed over"),
        "{}",
        run.stderr
    );
    assert_eq!(numbers(&folder.text("out.csv")), alone);
    for (table, told) in [
        ("beyond.csv", &["beyond.csv:2: depth_m", "got 9"][..]),
        ("other.csv", &["other.csv", "kind"]),
    ] {
        folder.refused(&format!("{arguments} --earlier {table}"), told);
    }
}
