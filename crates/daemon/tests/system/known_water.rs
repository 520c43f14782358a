//! A water so simple that its pictures are known, its file, and pictures of it.

use std::path::Path;

use uw_calib::Encoding;
use uw_guidance::physics::file::{SensorNumbers, WATER_FORMAT, WaterFile, WaterNumbers};
use uw_guidance::physics::water::{Field, SourceTables, ViewTables, WaterTables};

use crate::support::Numbers;

pub(crate) const SIZE_PX: [u32; 2] = [320, 192];
const HALF_VIEW: f64 = 0.5;
const DAYLIGHT: f64 = 0.5;
const C_PER_M: f64 = 0.4;
/// Light of the lamps at 100 % over that of daylight.
const LAMPS: f64 = 0.2;
const PATCHES: usize = 60;
/// Variance of a sensor's noise: a·y + b.
pub(crate) const NOISE: [f64; 2] = [1e-4, 1e-6];

/// Daylight at a depth of 1 to 6 m and lamps that add a fifth to it, an even veil that grows with the distance, no scattered rays.
pub(crate) fn water_file(distances_m: &[f64], noise: [f64; 2]) -> WaterFile {
    attenuating(1.0, distances_m, noise)
}

/// The same in the dark: lamps as bright as daylight and lamps together, and no daylight at any depth.
pub(crate) fn dark(distances_m: &[f64], noise: [f64; 2]) -> WaterFile {
    let mut file = water_file(distances_m, noise);
    file.tables.depths_m.clear();
    for view in &mut file.tables.views {
        view.daylight.clear();
        for field in [&mut view.lamps.veil, &mut view.lamps.light] {
            let values = field.iter_mut().flatten();
            values.for_each(|value| *value *= (1.0 + LAMPS) / LAMPS);
        }
    }
    file
}

/// The same that attenuates `times` as much.
pub(crate) fn attenuating(
    times: f64,
    distances_m: &[f64],
    [noise_a, noise_b]: [f64; 2],
) -> WaterFile {
    let even = |value: f64| -> Field { std::array::from_fn(|_| vec![value; PATCHES]) };
    let source = |share: f64, distance_m: f64| SourceTables {
        veil: even(share * veil(distance_m)),
        light: even(share * DAYLIGHT),
        straight: even((-times * C_PER_M * distance_m).exp()),
        scattered: even(0.0),
        transfer: std::array::from_fn(|_| vec![0.0; 3]),
    };
    let view = |&distance_m: &f64| ViewTables {
        distance_m,
        lamps: source(LAMPS, distance_m),
        daylight: vec![source(1.0, distance_m); 2],
    };
    WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: "tests".to_owned(),
        water: WaterNumbers {
            a_per_m: [0.1; 3],
            b_per_m: [0.3; 3],
            backscatter_fraction: 0.02,
        },
        sensor: SensorNumbers {
            width_px: SIZE_PX[0] as usize,
            height_px: SIZE_PX[1] as usize,
            encoding: Encoding::Srgb,
            exposure_m2_sr_per_w: 1.0,
            noise_a,
            noise_b,
            vignetting: None,
        },
        tables: WaterTables {
            half_view: [
                HALF_VIEW,
                HALF_VIEW * f64::from(SIZE_PX[1]) / f64::from(SIZE_PX[0]),
            ],
            frequencies_per_m: vec![1.0, 10.0, 100.0],
            sun: None,
            depths_m: vec![1.0, 6.0],
            views: distances_m.iter().map(view).collect(),
        },
        sights: Vec::new(),
        fit: None,
    }
}

fn veil(distance_m: f64) -> f64 {
    0.03 * distance_m
}

/// Reflectance of a target with waves of many lengths, m.
pub(crate) fn waves(x: f64, y: f64) -> f64 {
    let wave = |length_m: f64, phase: f64| {
        let turn = std::f64::consts::TAU / length_m;
        (turn * x + phase).sin() * (turn * y - phase).cos()
    };
    0.3 + 0.02 * (wave(0.61, 0.3) + wave(0.23, 1.0) + wave(0.09, 2.0) + wave(0.041, 0.7))
        + 0.015 * (wave(1.7, 0.1) + wave(0.021, 0.5))
}

/// Writes the picture of a target from a distance with lamps at a level.
pub(crate) fn write_picture(
    path: &Path,
    place: (f64, f64),
    reflectance: &dyn Fn(f64, f64) -> f64,
    noise: [f64; 2],
) {
    picture_through(&|x, y| [x, y], SIZE_PX, place, reflectance, noise)
        .save(path)
        .unwrap();
}

/// The same of a camera of another size, whose point (x, y) lies at `ideal(x, y)` in the picture of the water file's camera, pixels.
pub(crate) fn picture_through(
    ideal: &dyn Fn(f64, f64) -> [f64; 2],
    size_px: [u32; 2],
    (distance_m, light_pct): (f64, f64),
    reflectance: &dyn Fn(f64, f64) -> f64,
    [noise_a, noise_b]: [f64; 2],
) -> image::RgbImage {
    let mut numbers = Numbers::new(5);
    let light = 1.0 + LAMPS * 0.01 * light_pct;
    let left = (-C_PER_M * distance_m).exp();
    let pixel_m = 2.0 * HALF_VIEW * distance_m / f64::from(SIZE_PX[0]);
    image::RgbImage::from_fn(size_px[0], size_px[1], |column, row| {
        let within = |i: u32, part: u32| f64::from(i) + f64::from(part) / 3.0 + 1.0 / 6.0;
        let parts = (0..9).map(|j| {
            let [x, y] = ideal(within(column, j % 3), within(row, j / 3));
            let [x, y] = [(x, SIZE_PX[0]), (y, SIZE_PX[1])]
                .map(|(at, side)| (at - 0.5 * f64::from(side)) * pixel_m);
            reflectance(x, y)
        });
        let mean = parts.sum::<f64>() / 9.0;
        let signal = light * (veil(distance_m) + DAYLIGHT * left * mean);
        let deviation = (noise_a * signal + noise_b).sqrt();
        image::Rgb([0, 1, 2].map(|_| {
            let seen = signal + deviation * numbers.normal();
            Encoding::Srgb.counts(seen).round() as u8
        }))
    })
}
