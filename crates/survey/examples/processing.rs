//! What a camera's processing takes off the contrast of pictures: JPEG, denoising and sharpening, before the shipped targets.
//!
//! `cargo run --release -p uw-survey --example processing` prints the tables of docs/vehicle.md.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::error::Error;
use std::sync::atomic::AtomicBool;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _, RgbImage};
use uw_assets::assets_dir;
use uw_calib::ImageStats;
use uw_calib::vehicle::Vehicle;
use uw_render::scene::Noise;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::target_image::TargetImage;

/// A clear water 1 m from the target and a turbid one 1.5 m from it.
const WATERS: [(&str, f64, f64); 2] = [("IB", 0.0075, 1.0), ("3C", 0.0183, 1.5)];
const DEPTH_M: f64 = 3.0;
const LIGHT_PCT: f64 = 60.0;

type Step = (&'static str, fn(&RgbImage) -> RgbImage);

const STEPS: [Step; 7] = [
    ("JPEG 75", |p| jpeg(p, 75)),
    ("JPEG 85", |p| jpeg(p, 85)),
    ("JPEG 95", |p| jpeg(p, 95)),
    ("median 3 x 3", |p| near(p, median)),
    ("Gauss 3 x 3", |p| near(p, |v| weighted(v, 0.0))),
    ("unsharp 0.5", |p| near(p, |v| weighted(v, 0.5))),
    ("unsharp 1", |p| near(p, |v| weighted(v, 1.0))),
];

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle = Vehicle {
        width: 640,
        height: 360,
        exposure: 5.0,
        ..Vehicle::default()
    };
    for with_noise in [false, true] {
        for (water, backscatter_fraction, distance_m) in WATERS {
            let names = STEPS.map(|(name, _)| format!("{name:>13}"));
            println!(
                "{water} from {distance_m} m, {} noise: change of contrast, percent (green)",
                if with_noise { "with" } else { "without" }
            );
            println!("{:18} {:>8} {}", "target", "contrast", names.join(" "));
            let body = WaterBody {
                jerlov: water.parse()?,
                backscatter_fraction,
            };
            for pattern in Pattern::ALL {
                let picture = picture(&vehicle, &body, pattern, distance_m, with_noise)?;
                let contrast = |p: &RgbImage| -> Result<f64, Box<dyn Error>> {
                    let (w, h) = (p.width() as usize, p.height() as usize);
                    Ok(ImageStats::from_rgb8(w, h, p.as_raw())?.contrast[1])
                };
                let clean = contrast(&picture)?;
                let mut row = format!("{:18} {clean:8.2}", pattern.name());
                for (_, step) in STEPS {
                    let change = 100.0 * (contrast(&step(&picture))? / clean - 1.0);
                    row += &format!(" {change:13.1}");
                }
                println!("{row}");
            }
        }
    }
    Ok(())
}

fn picture(
    vehicle: &Vehicle,
    body: &WaterBody,
    pattern: Pattern,
    distance_m: f64,
    with_noise: bool,
) -> Result<RgbImage, Box<dyn Error>> {
    let target = Target::read(pattern, &assets_dir()?)?;
    let pyramid = TexturePyramid::new(&target.texture, f64::from(pattern.tile_m()));
    let view = View::Target {
        depth_m: DEPTH_M,
        distance_m,
    };
    let scene = scene(vehicle, body, &target, view)?;
    let image = TargetImage::render(&scene, &pyramid, 7, 1024, &AtomicBool::new(false))?;
    let picture = image.ok_or("stopped")?.picture(LIGHT_PCT);
    let mut sensor = sensor(vehicle, vehicle.exposure);
    if !with_noise {
        sensor.noise = None::<Noise>;
    }
    let counts = sensor.expose(&picture, 3).in_8_bit_counts();
    let bytes = counts.iter().flatten().map(|c| c.round() as u8).collect();
    RgbImage::from_raw(vehicle.width, vehicle.height, bytes).ok_or_else(|| "a size".into())
}

fn jpeg(picture: &RgbImage, quality: u8) -> RgbImage {
    let mut bytes = Vec::new();
    let (width, height) = picture.dimensions();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(picture, width, height, ExtendedColorType::Rgb8)
        .expect("written to memory");
    image::load_from_memory(&bytes)
        .expect("just written")
        .to_rgb8()
}

/// Each pixel by those around it, row by row, its own in the middle.
fn near(picture: &RgbImage, of: fn([f64; 9]) -> f64) -> RgbImage {
    let (width, height) = picture.dimensions();
    RgbImage::from_fn(width, height, |x, y| {
        let value = |k: usize| {
            of(std::array::from_fn(|i| {
                let at =
                    |at: u32, step: usize, n: u32| (at + step as u32).saturating_sub(1).min(n - 1);
                f64::from(picture[(at(x, i % 3, width), at(y, i / 3, height))][k])
            }))
        };
        image::Rgb([0, 1, 2].map(|k| value(k).round().clamp(0.0, 255.0) as u8))
    })
}

fn median(mut values: [f64; 9]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[4]
}

/// The mean by [1 2 1; 2 4 2; 1 2 1], or the pixel away from that mean by `sharper` times what it differs.
fn weighted(values: [f64; 9], sharper: f64) -> f64 {
    let weights = [1.0, 2.0, 1.0, 2.0, 4.0, 2.0, 1.0, 2.0, 1.0];
    let mean = values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>() / 16.0;
    match sharper > 0.0 {
        true => values[4] + sharper * (values[4] - mean),
        false => mean,
    }
}
