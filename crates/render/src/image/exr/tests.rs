//! EXR files, written and read.

use super::*;

fn example() -> ExrImage {
    let data: Vec<[f32; 3]> = (0..12)
        .map(|i| [i as f32, 1e-9 * i as f32, 1e6 + i as f32])
        .collect();
    let layer = |name: &str, data| Layer {
        name: name.to_string(),
        data,
    };
    ExrImage {
        layers: vec![
            layer(
                "depth",
                LayerData::Scalar((0..12).map(|i| i as f32 / 3.0).collect()),
            ),
            layer(
                "lamp.left",
                LayerData::Colour(data.iter().map(|p| p.map(|v| v * 0.5)).collect()),
            ),
            layer("normal", LayerData::Vector(vec![[0.0, 0.6, -0.8]; 12])),
        ],
        picture: Picture {
            width: 4,
            height: 3,
            data,
        },
        attributes: vec![
            ("uw.scene".to_string(), "pool.toml".to_string()),
            ("uw.seed".to_string(), "7".to_string()),
        ],
    }
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("out.exr");
    example().write(&path).expect("written");
    assert_eq!(ExrImage::read(&path).expect("read"), example());
    assert_eq!(std::fs::read_dir(folder.path()).expect("folder").count(), 1);
}

#[test]
fn half_floats_keep_eleven_bits_in_half_the_size() {
    let folder = tempfile::tempdir().expect("folder");
    let [full, half] = ["full.exr", "half.exr"].map(|name| folder.path().join(name));
    let data = (0..4096u32)
        .map(|i| [0, 1, 2].map(|k| 1e-4 * 1.003_f32.powi((i + k) as i32)))
        .collect();
    let image = ExrImage::new(Picture {
        width: 64,
        height: 64,
        data,
    });
    image.write(&full).expect("written");
    image.write_half(&half).expect("written");
    let size = |path: &Path| std::fs::metadata(path).expect("there").len();
    assert!(size(&half) < size(&full));
    let read = ExrImage::read(&half).expect("read").picture;
    let mut largest = 0.0_f32;
    for (stored, value) in read.data.iter().zip(&image.picture.data) {
        for k in 0..3 {
            largest = largest.max((stored[k] / value[k] - 1.0).abs());
        }
    }
    let expected = 2f32.powi(-11);
    assert!(largest <= expected && largest > 0.5 * expected, "{largest}");
}

#[test]
fn channels_have_the_names_that_other_programs_look_for() {
    let names: Vec<String> = example()
        .channels(Path::new("x"))
        .expect("valid")
        .into_keys()
        .collect();
    let expected = [
        "B",
        "G",
        "R",
        "depth.Z",
        "lamp.left.B",
        "lamp.left.G",
        "lamp.left.R",
        "normal.X",
        "normal.Y",
        "normal.Z",
    ];
    assert_eq!(names, expected);
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("out.exr");
    let mut short = example();
    short.layers[0].data = LayerData::Scalar(vec![0.0; 11]);
    assert!(
        short
            .write(&path)
            .expect_err("short")
            .to_string()
            .contains("depth.Z must have 12 values, got 11")
    );
    let mut twice = example();
    twice.layers.push(twice.layers[1].clone());
    assert!(
        twice
            .write(&path)
            .expect_err("twice")
            .to_string()
            .contains("lamp.left is given twice")
    );
    let mut dark = example();
    dark.picture.data[6][1] = f32::NAN;
    assert!(
        dark.write(&path)
            .expect_err("not a number")
            .to_string()
            .contains("1 pixels are no finite numbers, the first in column 2, row 1")
    );
    assert!(!path.exists());
    std::fs::write(&path, b"\x76\x2f\x31\x01 and no more").expect("writable");
    assert!(
        ExrImage::read(&path)
            .expect_err("cut")
            .to_string()
            .contains("out.exr")
    );
}
