use super::super::file::WaterFile;
use super::super::tests::{Noise as Normal, at, contrast_of, even_water, reflectance};
use super::super::{Contrast, LinearPicture, Predictor, Unknown};
use super::*;
use crate::features::Candidate;
use uw_calib::picture::Counts;

/// Shares of four stored pixels in a point `t` behind the second, by Keys' cubics.
fn shares(t: f64) -> [f64; 4] {
    [
        -0.5 * t + t * t - 0.5 * t.powi(3),
        1.0 - 2.5 * t * t + 1.5 * t.powi(3),
        0.5 * t + 2.0 * t * t - 1.5 * t.powi(3),
        -0.5 * t * t + 0.5 * t.powi(3),
    ]
}

/// Variance of the mean over `n` pixels in a row that are `width` stored pixels wide, of `samples` points each; those have 1.
fn of_row(n: usize, width: f64, samples: usize) -> f64 {
    let phases = 200;
    let of_phase = |phase: usize| {
        let mut stored = [0.0; 64];
        for i in 0..n * samples {
            let part = (i as f64 + 0.5) / samples as f64;
            let at = 20.0 + phase as f64 / f64::from(phases) + width * part;
            let first = at as usize;
            for (k, share) in shares(at - at.floor()).into_iter().enumerate() {
                stored[first - 1 + k] += share / (n * samples) as f64;
            }
        }
        stored.iter().map(|share| share * share).sum::<f64>()
    };
    (0..phases as usize).map(of_phase).sum::<f64>() / f64::from(phases)
}

#[test]
fn means_of_interpolated_pixels_have_the_noise_that_is_said() {
    for (width, samples) in [(0.6, 1), (0.8, 1), (1.0, 1), (1.3, 2), (2.0, 2)] {
        let noise = Noise {
            of_pixel: of_row(1, width, samples).powi(2),
            of_means: 1.0 / (width * width),
        };
        for n in [2, 4, 8] {
            let found = of_row(n, width, samples).powi(2);
            let off = noise.of((n * n) as f64) / found - 1.0;
            assert!(off.abs() < 0.065, "{width} {n}: {off}");
        }
    }
}

/// Water in the dark, with lamps whose light in the patches' middles is that of even ones times `beam`.
fn dark_water(beam: &[f64; PATCHES]) -> WaterFile {
    let mut file = even_water();
    file.tables.depths_m = Vec::new();
    for view in &mut file.tables.views {
        view.daylight = Vec::new();
        for light in &mut view.lamps.light {
            for (light, beam) in light.iter_mut().zip(beam) {
                *light *= beam;
            }
        }
    }
    file
}

/// Light that falls with the distance from the middle, to `edge` in the corners.
fn beam(edge: f64) -> [f64; PATCHES] {
    std::array::from_fn(|i| {
        let (x, y) = ((i % 10) as f64 / 4.5 - 1.0, (i / 10) as f64 / 2.5 - 1.0);
        edge.powf(0.5 * (x * x + y * y))
    })
}

/// A picture of the waves of `reflectance` with the lamps at 100 %.
fn picture(file: &WaterFile, beam: &[f64; PATCHES], distance_m: f64, seed: u64) -> Counts {
    let (width, height) = (file.sensor.width_px, file.sensor.height_px);
    let pixel_m = 2.0 * file.tables.half_view[0] * distance_m / width as f64;
    let view = &file.tables.views[0].lamps;
    let (veil, encoding) = (view.veil[0][0], file.sensor.encoding);
    let left = view.straight[0][0].powf(distance_m / file.tables.views[0].distance_m);
    let mut noise = Normal(seed);
    let pixel = |i: usize| {
        let (column, row) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let light = 2.0 / (distance_m * distance_m)
            * grid::at(beam, column / width as f64, row / height as f64);
        let [x, y] = [column - 0.5 * width as f64, row - 0.5 * height as f64];
        let signal = veil + light.max(0.0) * left * reflectance(x * pixel_m, y * pixel_m);
        [0, 1, 2].map(|_| {
            let deviation = (file.sensor.noise_a * signal + file.sensor.noise_b).sqrt();
            encoding.counts(signal + deviation * noise.next()).round()
        })
    };
    Counts::stored(width, height, (0..width * height).map(pixel).collect())
}

/// What a picture from `from_m` tells of the places `to_m`, with what is seen there.
fn told(edge: f64, from_m: f64, to_m: &[f64]) -> (Vec<(Contrast, [f64; 3])>, [Option<Unknown>; 3]) {
    let beam = beam(edge);
    let file = dark_water(&beam);
    let response = file.sensor.response();
    let counts = picture(&file, &beam, from_m, 3);
    let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let here: Candidate = at(from_m, 100.0);
    let place = file.place(&response, 3.0);
    let predictor = Predictor::new(place, &linear, (&here, contrast_of(&counts)), &[]);
    let seen = |&m: &f64| {
        let truth = contrast_of(&picture(&file, &beam, m, 8));
        (predictor.contrast(&at(m, 100.0)), truth)
    };
    (to_m.iter().map(seen).collect(), predictor.unknown())
}

/// Lamps leave the corners dark, where reflectance is nearly noise alone: the middle tells what nearer pictures show.
#[test]
fn noise_of_dark_corners_is_not_that_of_the_middle() {
    for (edge, from_m) in [(0.3, 2.5), (0.1, 2.5), (0.03, 2.0)] {
        let (found, unknown) = told(edge, from_m, &[1.2, 0.9]);
        assert_eq!(unknown, [None; 3], "{edge}");
        for (contrast, truth) in found {
            for k in 0..3 {
                let off = contrast.counts[k] / truth[k] - 1.0;
                let errors = (contrast.counts[k] - truth[k]).abs() / contrast.error_counts[k];
                assert!(
                    off.abs() < 0.1 && errors < 2.0,
                    "{edge} from {from_m} m: {contrast:?} {truth:?}"
                );
            }
        }
    }
}

/// Corners without light count for nothing, so that what the beam lights is told. Light that falls to a tenth from one patch to the next is more than the
/// tables' straight lines between patches can follow.
#[test]
fn a_narrow_beam_tells_what_it_lights() {
    let (found, unknown) = told(1e-3, 1.6, &[1.6, 0.9]);
    assert_eq!(unknown, [None; 3]);
    for (contrast, truth) in found {
        for k in 0..3 {
            let off = contrast.counts[k] / truth[k] - 1.0;
            assert!(off.abs() < 0.25, "{contrast:?} {truth:?}");
        }
    }
}
