//! Calibration with what a vehicle could take: several lamp levels, no picture that looks up.

use serde_json::Value;
use uw_calib::{Encoding, Profile};

use super::support::Folder;

const HEADER: &str = "file,kind,depth_m,distance_m,light_pct\n";
/// Size of the pictures, pixels.
const SIZE: (u32, u32) = (40, 24);

/// A picture of stripes that give back 0.5 and 1 of the light that falls on them, as a camera stores it.
fn target(folder: &Folder, name: &str, light: f64) {
    let stored = |share: f64| Encoding::Srgb.counts(share * light).round() as u8;
    let picture = image::RgbImage::from_fn(SIZE.0, SIZE.1, |x, _| {
        image::Rgb([stored(if x % 2 == 0 { 0.5 } else { 1.0 }); 3])
    });
    picture.save(folder.path(name)).expect("written");
}

fn profile(folder: &Folder, name: &str) -> Profile {
    Profile::read(&folder.path(name)).expect("a profile")
}

#[test]
fn what_is_missing_is_said_before_anything_else() {
    let folder = Folder::new();
    // None of the pictures is there.
    folder.write(
        "m.csv",
        format!(
            "{HEADER}a.png,contrast,3,0.5,40\nb.png,contrast,3,1.5,40\nc.png,contrast,3,2.5,80\n"
        ),
    );
    folder.refused(
        "calibrate m.csv -o p.json",
        &[
            "too few pictures",
            "lamps at 40 % from 2 distances (0.5 to 1.5 m)",
            "lamps at 80 % from 1 distance (2.5 m)",
            "no picture that looks up",
            "lacks pictures of the target with the lamps off",
            "--jerlov TYPE",
        ],
    );
    // A given water stands for the pictures that look up, not for the others.
    let run = folder.uw("calibrate m.csv -o p.json --jerlov 1C");
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    assert!(!run.stderr.contains("daylight falls"), "{}", run.stderr);
    assert!(run.stderr.contains("lamps off"), "{}", run.stderr);
}

#[test]
fn several_lamp_levels_become_one() {
    let folder = Folder::new();
    let (day, lamps) = (0.05, 0.4);
    let mut manifest = format!("{HEADER}up.png,depth,1,,0\n");
    target(&folder, "up.png", 0.4);
    // From 1 and 3 m at 80 %, from 2 m at another level only.
    for (distance, levels) in [(1, vec![0, 80]), (2, vec![0, 40]), (3, vec![0, 80])] {
        for level in levels {
            let name = format!("d{distance}_{level}.png");
            let fall = f64::from(distance).powi(-2);
            target(
                &folder,
                &name,
                day + lamps * fall * f64::from(level) / 100.0,
            );
            manifest += &format!("{name},contrast,3,{distance},{level}\n");
        }
    }
    folder.write("m.csv", manifest);
    let told = folder.good("calibrate m.csv -o p.json").stderr;
    assert!(
        told.contains("derived from pictures at other levels"),
        "{told}"
    );
    let made = profile(&folder, "p.json");
    // What a picture from 2 m at 80 % would have shown.
    target(&folder, "right.png", day + lamps / 4.0 * 0.8);
    let right = uw_calib::ImageStats::from_file(&folder.path("right.png")).expect("a picture");
    let k_c = made.k_c_on(2.0).expect("inside")[0];
    assert!(
        (k_c / right.contrast[0] - 1.0).abs() < 0.02,
        "{k_c} {right:?}"
    );
    assert!(
        made.source()
            .approximate()
            .is_some_and(|a| a.contains("at 2 m")),
        "{:?}",
        made.source()
    );
    // At the level asked for there is no picture at all: all are derived.
    folder.good("calibrate m.csv -o p60.json --light-pct 60");
    let k_c = profile(&folder, "p60.json").k_c_on(2.0).expect("inside")[0];
    target(&folder, "right.png", day + lamps / 4.0 * 0.6);
    let right = uw_calib::ImageStats::from_file(&folder.path("right.png")).expect("a picture");
    assert!(
        (k_c / right.contrast[0] - 1.0).abs() < 0.02,
        "{k_c} {right:?}"
    );
    folder.refused(
        "calibrate m.csv -o p.json --light-pct 0",
        &["--light-pct", "above 0"],
    );
}

/// A vehicle's file says which camera took the pictures: the profile states it, and pictures of another size are not its.
#[test]
fn a_vehicle_is_stated_by_the_profile_and_its_noise_taken_off() {
    let folder = Folder::new();
    let vehicle = |name: &str, width: u32| {
        let text = format!(
            "format = \"uw-vehicle/1\"\nwidth = {width}\nheight = 24\nhfov_deg = 72.0\nencoding = \"linear\"\nnoise_a = 3e-4\n"
        );
        folder.write(name, text);
    };
    vehicle("mine.toml", SIZE.0);
    vehicle("other.toml", 48);
    target(&folder, "up.png", 0.4);
    let mut manifest = format!("{HEADER}up.png,depth,1,,0\n");
    for distance in 1..=3 {
        let name = format!("d{distance}.png");
        target(&folder, &name, 0.5 / f64::from(distance));
        manifest += &format!("{name},contrast,3,{distance},0\n{name},contrast,3,{distance},60\n");
    }
    folder.write("m.csv", manifest);
    folder.good("calibrate m.csv --vehicle mine.toml -o p.json");
    let made = profile(&folder, "p.json");
    assert_eq!(made.rig().hfov_deg, Some(72.0));
    assert_eq!(made.rig().noise_a, Some(3e-4));
    // As the numbers themselves do, the vehicle's encoding with them.
    folder.good("calibrate m.csv --encoding linear --noise-a 3e-4 --noise-b 1e-6 -o q.json");
    let given = profile(&folder, "q.json");
    assert_eq!(made.corrected(), given.corrected());
    assert_eq!(given.rig().hfov_deg, None);
    folder.good("calibrate m.csv --encoding srgb --vehicle mine.toml -o r.json");
    assert_ne!(profile(&folder, "r.json").corrected(), given.corrected());
    folder.refused(
        "calibrate m.csv --vehicle other.toml -o p.json",
        &["m.csv:3:", "vehicle's 48 x 24 pixels, got 40 x 24"],
    );
    folder.refused(
        "calibrate m.csv --vehicle yacht -o p.json",
        &["--vehicle", "yacht"],
    );
    // `uw stats` takes the same.
    let run = folder.good("stats --json d1.png --vehicle mine.toml");
    let list: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(list[0]["noise_source"], "sensor");
}

#[test]
fn pictures_with_the_lamps_off_show_how_daylight_falls() {
    let folder = Folder::new();
    // As in Jerlov 5C water, whose pictures of a target fall by about that.
    let k_d = 0.3;
    let mut manifest = HEADER.to_owned();
    for depth in [1, 2, 3, 5] {
        let name = format!("z{depth}.png");
        target(&folder, &name, 0.4 * f64::exp(-k_d * f64::from(depth)));
        manifest += &format!("{name},contrast,{depth},1.5,0\n");
    }
    target(&folder, "on.png", 0.5);
    manifest += "on.png,contrast,3,1.5,67\n";
    folder.write("m.csv", &manifest);
    let told = folder.good("calibrate m.csv -o p.json").stderr;
    assert!(told.contains("one distance"), "{told}");
    // Rounding to whole counts takes its share.
    assert!(
        told.contains("K_d of 0.299, 0.299, 0.299 per m of 4"),
        "{told}"
    );
    let made = profile(&folder, "p.json");
    assert_eq!(made.depth_range_m(), (0.5, 5.0));
    assert!(made.k_z(5.0).expect("inside")[0] < made.k_z(1.0).expect("inside")[0]);
    // K_c off is that of the depth of the picture with the lamps on, not the mean over all depths.
    let right = uw_calib::ImageStats::from_file(&folder.path("z3.png")).expect("a picture");
    assert_eq!(made.k_c_off(1.5).expect("inside"), right.contrast);
    let text: Value = serde_json::from_slice(&folder.read("p.json")).expect("JSON");
    let note = text["source"]["note"].as_str().expect("a note");
    assert!(
        note.starts_with("approximate: K_z rendered for Jerlov") && note.contains("4 pictures"),
        "{note}"
    );
}

#[test]
fn daylight_can_be_given() {
    let folder = Folder::new();
    target(&folder, "on.png", 0.5);
    target(&folder, "off.png", 0.2);
    let rows = "on.png,contrast,,1,67\non.png,contrast,,2,67\noff.png,contrast,,1,0\noff.png,contrast,,2,0\n";
    folder.write("m.csv", format!("{HEADER}{rows}"));
    let told = folder
        .good("calibrate m.csv -o kd.json --kd-per-m 0.56,0.30,0.58")
        .stderr;
    assert!(told.contains("Jerlov 5C water"), "{told}");
    // Of a water: the K_z that the project's routine finds there.
    folder.good("calibrate m.csv -o jerlov.json --jerlov 5C");
    let made = profile(&folder, "jerlov.json");
    assert_eq!(made.depth(), profile(&folder, "kd.json").depth());
    assert_eq!(made.k_z(0.5).expect("inside"), [1.0; 3]);
    let [red, green, _] = made.k_z(6.0).expect("inside");
    assert!(red < 0.5 * green && green < 1.0, "{red} {green}");
    assert!(
        made.source()
            .approximate()
            .is_some_and(|a| a.contains("Jerlov 5C"))
    );

    folder.write("up.csv", format!("{HEADER}on.png,depth,1,,\n{rows}"));
    folder.refused(
        "calibrate up.csv -o p.json --jerlov 5C",
        &["kind depth", "--jerlov"],
    );
    folder.refused(
        "calibrate m.csv -o p.json --kd-per-m 0.1,0.1",
        &["--kd-per-m", "three numbers"],
    );
    folder.refused(
        "calibrate m.csv -o p.json --kd-per-m 0.1,0.1,-1",
        &["--kd-per-m", "> 0"],
    );
    folder.refused("calibrate m.csv -o p.json --jerlov 3c", &["--jerlov", "3C"]);
}

#[test]
fn pictures_of_the_target_that_show_nothing_are_warned_of() {
    let folder = Folder::new();
    target(&folder, "on.png", 0.5);
    let black = image::RgbImage::new(SIZE.0, SIZE.1);
    black.save(folder.path("black.png")).expect("written");
    folder.write(
        "m.csv",
        format!("{HEADER}on.png,depth,1,,\non.png,contrast,,1,67\nblack.png,contrast,,2,67\non.png,contrast,,1,0\n"),
    );
    let told = folder.good("calibrate m.csv -o p.json").stderr;
    let blank: Vec<&str> = told
        .lines()
        .filter(|l| l.contains("shows nothing"))
        .collect();
    assert!(blank.len() == 1 && blank[0].contains("m.csv:4: "), "{told}");
}
