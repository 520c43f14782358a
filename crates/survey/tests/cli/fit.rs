//! `uw fit`: what it refuses, and that nothing is written then.

use image::{Rgb, RgbImage};

use super::support::Folder;

const HEADER: &str = "file,kind,depth_m,distance_m,light_pct\n";

/// Pictures of an even wall, with the lamps off and on, from `distances_m`.
fn pictures(folder: &Folder, size: (u32, u32), distances_m: &[f64]) {
    let mut manifest = HEADER.to_owned();
    for (name, level) in [("off.png", 20), ("on.png", 90)] {
        let picture = RgbImage::from_pixel(size.0, size.1, Rgb([level; 3]));
        picture.save(folder.path(name)).expect("written");
    }
    for distance_m in distances_m {
        manifest += &format!("off.png,contrast,3,{distance_m},0\n");
        manifest += &format!("on.png,contrast,3,{distance_m},100\n");
    }
    folder.write("m.csv", manifest);
    folder.write(
        "small.toml",
        "format = \"uw-vehicle/1\"\nwidth = 320\nheight = 180\n",
    );
}

#[test]
fn what_cannot_be_fitted_is_refused_by_name() {
    let folder = Folder::new();
    pictures(&folder, (320, 180), &[0.5, 1.0, 2.0]);
    folder.refused(
        "fit m.csv -o w.json",
        &["m.csv", "1280 x 720", "got 320 x 180"],
    );
    folder.refused("fit m.csv -o w.json --vehicle yacht", &["yacht", "default"]);
    let vehicle = "--vehicle small.toml";
    for (option, told) in [
        ("--gain-error 0", "--gain-error must be above 0"),
        (
            "--backscatter-fraction 0.3",
            "--backscatter-fraction must be from",
        ),
        (
            "--backscatter-error 9",
            "--backscatter-error must be above 0",
        ),
        (
            "--dark --depths-m 3",
            "--depths-m must be left out in the dark",
        ),
    ] {
        folder.refused(&format!("fit m.csv -o w.json {vehicle} {option}"), &[told]);
    }
    pictures(&folder, (320, 180), &[0.5, 1.0]);
    folder.refused(
        &format!("fit m.csv -o w.json {vehicle}"),
        &["m.csv", "3 distances or more", "[0.5, 1.0] m"],
    );
    // From 20 m a camera of 320 pixels sees what it saw from 0.5 m in 8.
    pictures(&folder, (320, 180), &[0.5, 1.0, 20.0]);
    folder.refused(
        &format!("fit m.csv -o w.json {vehicle}"),
        &["m.csv", "20 m", "0.5 m", "too few pixels"],
    );
    folder.write("m.csv", format!("{HEADER}none.png,contrast,3,0.5,0\n"));
    folder.refused(
        &format!("fit m.csv -o w.json {vehicle}"),
        &["m.csv:2", "none.png"],
    );
    assert!(!folder.path("w.json").exists());
}
