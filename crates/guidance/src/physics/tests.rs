//! Predictions in waters so simple that the truth is known.

use uw_calib::ImageStats;
use uw_calib::picture::Counts;
use uw_calib::response::CountResponse;

use super::file::{SensorNumbers, WATER_FORMAT, WaterFile, WaterNumbers};
use super::grid::PATCHES;
use super::water::{Field, SourceTables, ViewTables, WaterTables};
use super::{LinearPicture, Predictor, Sight};
use crate::features::Candidate;

const WIDTH: usize = 320;
const HEIGHT: usize = 192;
const HALF_VIEW: f64 = 0.5;
const VEIL: f64 = 0.05;
const C_PER_M: f64 = 0.4;

fn even(value: f64) -> Field {
    std::array::from_fn(|_| vec![value; PATCHES])
}

/// Water that attenuates and adds an even veil that grows with the distance, no scattered rays; lamps whose light falls with its
/// square, and daylight of 0.5.
pub(super) fn even_water() -> WaterFile {
    let frequencies_per_m = vec![1.0, 10.0, 100.0];
    let source = |light: f64, veil: f64, distance_m: f64| SourceTables {
        veil: even(veil),
        light: even(light),
        straight: even((-C_PER_M * distance_m).exp()),
        scattered: even(0.0),
        transfer: std::array::from_fn(|_| vec![0.0; 3]),
    };
    let view = |distance_m: f64| ViewTables {
        distance_m,
        lamps: source(2.0 / (distance_m * distance_m), VEIL, distance_m),
        daylight: vec![source(0.5, VEIL * distance_m, distance_m)],
    };
    WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: "a test".to_owned(),
        water: WaterNumbers {
            a_per_m: [0.1; 3],
            b_per_m: [0.3; 3],
            backscatter_fraction: 0.02,
        },
        sensor: SensorNumbers {
            width_px: WIDTH,
            height_px: HEIGHT,
            encoding: uw_calib::Encoding::Srgb,
            exposure_m2_sr_per_w: 1.0,
            noise_a: 1e-4,
            noise_b: 1e-6,
        },
        tables: WaterTables {
            half_view: [HALF_VIEW, HALF_VIEW * HEIGHT as f64 / WIDTH as f64],
            frequencies_per_m,
            depths_m: vec![3.0],
            views: [0.5, 1.0, 2.0, 4.0].map(view).to_vec(),
        },
        sights: Vec::new(),
        fit: None,
    }
}

/// Reflectance at a point of the target, m: waves of many lengths in both directions.
fn reflectance(x: f64, y: f64) -> f64 {
    let wave = |length_m: f64, phase: f64| {
        let turn = std::f64::consts::TAU / length_m;
        (turn * x + phase).sin() * (turn * y - phase).cos()
    };
    0.3 + 0.02 * (wave(0.61, 0.3) + wave(0.23, 1.0) + wave(0.09, 2.0) + wave(0.041, 0.7))
        + 0.015 * (wave(1.7, 0.1) + wave(0.021, 0.5))
}

/// Normal numbers by adding twelve even ones: good enough for noise.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

/// The stored picture from a distance, pixels averaged over 3 × 3 points, at a lamp level.
fn picture(file: &WaterFile, at: &Candidate, seed: u64) -> Counts {
    let (d, level) = (at.distance_m, 0.01 * at.light_pct);
    let light = 0.5 + level * 2.0 / (d * d);
    let veil = VEIL * d + level * VEIL;
    let pixel_m = 2.0 * HALF_VIEW * d / WIDTH as f64;
    let mut noise = Noise(seed);
    let encoding = uw_calib::Encoding::Srgb;
    let pixel = |i: usize| {
        let (column, row) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        let mut mean = 0.0;
        for j in 0..9 {
            let (u, v) = (
                (j % 3) as f64 / 3.0 + 1.0 / 6.0,
                (j / 3) as f64 / 3.0 + 1.0 / 6.0,
            );
            let x = (column + u - 0.5 * WIDTH as f64) * pixel_m;
            let y = (row + v - 0.5 * HEIGHT as f64) * pixel_m;
            mean += reflectance(x, y) / 9.0;
        }
        let signal = veil + light * (-C_PER_M * d).exp() * mean;
        [0, 1, 2].map(|_| {
            let deviation = (file.sensor.noise_a * signal + file.sensor.noise_b).sqrt();
            encoding.counts(signal + deviation * noise.next()).round()
        })
    };
    Counts {
        width: WIDTH,
        height: HEIGHT,
        pixels: (0..WIDTH * HEIGHT).map(pixel).collect(),
    }
}

fn at(distance_m: f64, light_pct: f64) -> Candidate {
    Candidate {
        distance_m,
        light_pct,
    }
}

fn contrast_of(picture: &Counts) -> [f64; 3] {
    let stats = ImageStats::from_counts(picture.width, picture.height, &picture.pixels);
    stats.expect("a picture").contrast
}

fn predictor<'a>(
    file: &'a WaterFile,
    response: &'a CountResponse,
    here: &Candidate,
) -> Predictor<'a> {
    let counts = picture(file, here, 3);
    let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let now = (here, contrast_of(&counts));
    Predictor::new(file.place(response, 3.0), &linear, now, &file.sights)
}

/// The same distance at other lamp levels needs the light alone, and nearer ones what the middle of the picture shows.
#[test]
fn other_levels_and_nearer_distances_are_predicted_from_one_picture() {
    let file = even_water();
    let response = file.sensor.response();
    let here = at(2.0, 20.0);
    let predictor = predictor(&file, &response, &here);
    for (there, allowed) in [
        (here, 0.015),
        (at(2.0, 0.0), 0.02),
        (at(2.0, 100.0), 0.02),
        (at(1.4, 20.0), 0.06),
        (at(1.0, 40.0), 0.08),
    ] {
        let truth = contrast_of(&picture(&file, &there, 8));
        let found = predictor.contrast(&there);
        for k in 0..3 {
            let off = found.counts[k] / truth[k] - 1.0;
            assert!(off.abs() < allowed, "{there:?}: {found:?} {truth:?}");
            let errors = (found.counts[k] - truth[k]).abs() / found.error_counts[k];
            assert!(errors < 4.0, "{there:?}: {found:?} {truth:?}");
        }
    }
}

/// A near picture does not show what farther ones will: its error says so, and a sight from there tells.
#[test]
fn farther_distances_are_told_by_earlier_sights_or_left_open() {
    let mut file = even_water();
    let response = file.sensor.response();
    let (here, there) = (at(0.5, 0.0), at(3.0, 50.0));
    let alone = predictor(&file, &response, &here).contrast(&there);
    let truth = contrast_of(&picture(&file, &there, 8));
    let seen = at(3.0, 0.0);
    let remembered = LinearPicture::of_counts(&picture(&file, &seen, 9), file.sensor.encoding);
    let near = LinearPicture::of_counts(&picture(&file, &here, 10), file.sensor.encoding);
    let sights = [(&remembered, seen), (&near, here)]
        .map(|(picture, from)| Sight::new(&file.place(&response, 3.0), picture, &from));
    file.sights = sights.to_vec();
    let told = predictor(&file, &response, &here).contrast(&there);
    for k in 0..3 {
        assert!(alone.error_counts[k] > 0.15 * alone.counts[k], "{alone:?}");
        assert!(
            told.error_counts[k] < 0.5 * alone.error_counts[k],
            "{told:?}"
        );
        assert!(
            (told.counts[k] / truth[k] - 1.0).abs() < 0.05,
            "{told:?} {truth:?}"
        );
        let off = (alone.counts[k] - truth[k]).abs() / alone.error_counts[k];
        assert!(off < 3.0, "{alone:?} {truth:?}");
    }
}

/// A grey card has no contrast but its noise, which is not taken for detail: nearer by, with more light, it stays noise.
#[test]
fn noise_is_not_detail() {
    let file = even_water();
    let response = file.sensor.response();
    let here = at(4.0, 0.0);
    let mut counts = picture(&file, &here, 3);
    let mean: f64 = counts.pixels.iter().map(|p| p[0]).sum::<f64>() / counts.pixels.len() as f64;
    let mut noise = Noise(5);
    let encoding = uw_calib::Encoding::Srgb;
    let signal = encoding.light(mean);
    let deviation = (file.sensor.noise_a * signal + file.sensor.noise_b).sqrt();
    for pixel in &mut counts.pixels {
        *pixel = [0, 1, 2].map(|_| encoding.counts(signal + deviation * noise.next()).round());
    }
    let linear = LinearPicture::of_counts(&counts, encoding);
    let now = (&here, contrast_of(&counts));
    let predictor = Predictor::new(file.place(&response, 3.0), &linear, now, &[]);
    for k in 0..3 {
        let found = predictor.contrast(&at(0.5, 0.0)).counts[k];
        let as_detail = now.1[k] * (C_PER_M * 3.5).exp();
        assert!(found < 0.5 * as_detail, "{found} {as_detail}");
    }
}
