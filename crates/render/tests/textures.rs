//! Textures: in memory as their files store them, and refused by their headers where they are too large.

use std::path::Path;

use image::{ColorType, DynamicImage, GenericImageView, ImageFormat};
use uw_render::scene::{Scene, Texture, TextureEncoding, TextureFilter};

/// A picture of all kinds of values, saved as PNG or TIFF.
fn saved(color: ColorType, folder: &Path) -> std::path::PathBuf {
    let mut picture = DynamicImage::new(64, 32, ColorType::Rgb32F);
    let samples = picture.as_mut_rgb32f().expect("floats");
    for (x, y, texel) in samples.enumerate_pixels_mut() {
        texel.0 = [x as f32 / 63.0, y as f32 / 31.0, (x * y) as f32 / 1953.0];
    }
    let (picture, extension, format) = match color {
        ColorType::L8 => (picture.to_luma8().into(), "png", ImageFormat::Png),
        ColorType::Rgb8 => (picture.to_rgb8().into(), "png", ImageFormat::Png),
        ColorType::Rgba8 => (picture.to_rgba8().into(), "png", ImageFormat::Png),
        ColorType::L16 => (picture.to_luma16().into(), "png", ImageFormat::Png),
        ColorType::Rgb16 => (picture.to_rgb16().into(), "png", ImageFormat::Png),
        _ => (picture, "tiff", ImageFormat::Tiff),
    };
    let path = folder.join(format!("{color:?}.{extension}"));
    picture.save_with_format(&path, format).expect("saved");
    path
}

#[test]
fn texels_take_no_more_memory_than_their_picture_and_are_looked_up_as_its_values() {
    let folder = tempfile::tempdir().expect("folder");
    let kinds = [
        (ColorType::L8, 1),
        (ColorType::Rgb8, 3),
        (ColorType::Rgba8, 3),
        (ColorType::L16, 2),
        (ColorType::Rgb16, 6),
        (ColorType::Rgb32F, 12),
    ];
    for (color, bytes) in kinds {
        let path = saved(color, folder.path());
        let picture = image::open(&path).expect("read");
        assert_eq!(picture.color(), color);
        let values = picture.to_rgb32f();
        let linear =
            Texture::read(&path, TextureEncoding::Linear, TextureFilter::Nearest).expect("valid");
        let srgb =
            Texture::read(&path, TextureEncoding::Srgb, TextureFilter::Nearest).expect("valid");
        assert_eq!(
            (linear.texels.bytes(), srgb.texels.bytes()),
            (64 * 32 * bytes, 64 * 32 * bytes),
            "{color:?}"
        );
        for (x, y, _) in picture.pixels() {
            let stored = values.get_pixel(x, y).0;
            let (u, v) = ((f64::from(x) + 0.5) / 64.0, (f64::from(y) + 0.5) / 32.0);
            let to_linear = |value: f32| uw_render::image::srgb_to_linear(f64::from(value));
            for k in 0..3 {
                // Two roundings in single precision.
                let near = |got: f64, expected: f64| (got - expected).abs() <= 3e-7 * expected;
                let place = format!("{color:?} {x} {y}");
                assert!(
                    near(linear.sample(u, v)[k], f64::from(stored[k])),
                    "{place}"
                );
                assert!(near(srgb.sample(u, v)[k], to_linear(stored[k])), "{place}");
            }
        }
    }
}

/// The beginning of a PNG file of RGB, without any of its data.
fn png_header(width: u32, height: u32, bits: u8) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([bits, 2, 0, 0, 0]);
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    let check = crc32(&header);
    file.extend(header);
    file.extend(check.to_be_bytes());
    // The decoder reads on to the first chunk of data.
    file.extend(b"\0\0\0\0IDAT");
    file.extend(crc32(b"IDAT").to_be_bytes());
    file
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |rest: u32, byte: &u8| {
        (0..8).fold(rest ^ u32::from(*byte), |rest, _| {
            (rest >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(rest & 1))
        })
    };
    !bytes.iter().fold(!0, step)
}

#[test]
fn a_picture_that_is_too_large_is_refused_by_its_header() {
    let folder = tempfile::tempdir().expect("folder");
    let read = |width, height, bits| {
        let path = folder.path().join("bomb.png");
        std::fs::write(&path, png_header(width, height, bits)).expect("written");
        let text = "format = \"uw-scene/1\"\n[camera]\nposition_m = [0, 0, 0]\nforward = [1, 0, 0]\nhfov_deg = 60\nwidth = 4\nheight = 3\n\
            [[object]]\nplane = { center_m = [2, 0, 0], normal = [-1, 0, 0], size_m = [1, 1] }\nreflectance = { texture = \"bomb.png\" }\n";
        Scene::parse(text, folder.path(), "bomb.toml")
            .expect_err("no data")
            .to_string()
    };
    let error = read(16_384, 16_384, 16);
    assert!(
        error.contains("bomb.png: 16384 x 16384 texels of 6 bytes take 1610612736 bytes of memory; a scene's textures may take 1073741824 in all, of which 1073741824 are left"),
        "{error}"
    );
    let error = read(20_000, 10, 8);
    assert!(
        error.contains("1 to 16384 texels wide and high, got 20000 x 10"),
        "{error}"
    );
    // One of the largest size is not too large: only its data are missing.
    let error = read(16_384, 16_384, 8);
    assert!(!error.contains("take"), "{error}");
}
