use super::super::detail::ChannelDetail;
use super::super::file::WaterFile;
use super::super::predict::Contrast;
use super::super::tests::{Noise as Normal, at, contrast_of, even_water, reflectance};
use super::super::{LinearPicture, Predictor, Sight, Unknown};
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
    picture_of(file, beam, (distance_m, seed), &reflectance)
}

/// The same of another target.
fn picture_of(
    file: &WaterFile,
    beam: &[f64; PATCHES],
    (distance_m, seed): (f64, u64),
    reflectance: &dyn Fn(f64, f64) -> f64,
) -> Counts {
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

/// Contrast per channel of a picture.
type Measured = [f64; 3];

/// What a picture from `from_m` tells of the places `to_m`, with what is seen there.
fn told(edge: f64, from_m: f64, to_m: &[f64]) -> (Vec<(Contrast, Measured)>, [Option<Unknown>; 3]) {
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

/// A channel of what a picture from `distance_m` shows of the target of `reflectance`, whose light is that of `beam`.
fn shown(file: &WaterFile, counts: &Counts, distance_m: f64) -> ChannelDetail {
    let response = file.sensor.response();
    let linear = LinearPicture::of_counts(counts, file.sensor.encoding);
    let place = file.place(&response, 3.0);
    let sight = Sight::new(&place, &linear, &at(distance_m, 100.0));
    sight.channel(0).clone()
}

/// A veil that is 2 % off makes reflectances without end of corners without light; they are not the target's, nor is their noise its detail.
#[test]
fn places_without_light_say_nothing_of_the_target() {
    let beam = beam(1e-3);
    let mut file = dark_water(&beam);
    let counts = picture(&file, &beam, 1.6, 3);
    let lamps = file.tables.views.iter_mut().map(|view| &mut view.lamps);
    for veil in lamps.flat_map(|lamps| &mut lamps.veil) {
        veil.iter_mut().for_each(|veil| *veil *= 0.98);
    }
    let detail = shown(&file, &counts, 1.6);
    assert!((detail.mean / 0.3 - 1.0).abs() < 0.25, "{}", detail.mean);
    for corner in [0, 9, PATCHES - 10, PATCHES - 1] {
        let deviation = detail.shape.deviations[corner];
        assert!((0.8..1.2).contains(&deviation), "{corner}: {deviation}");
    }
}

/// As long as noise is less than the detail, what is seen in little light counts as much as what is seen in the middle.
#[test]
fn places_with_little_light_count_the_same_where_noise_is_little() {
    let beam = beam(0.1);
    let mut file = dark_water(&beam);
    (file.sensor.noise_a, file.sensor.noise_b) = (1e-9, 1e-11);
    let outward = |x: f64, y: f64| 0.3 + 8.0 * (x * x + y * y) * (reflectance(x, y) - 0.3);
    let counts = picture_of(&file, &beam, (1.2, 3), &outward);
    let detail = shown(&file, &counts, 1.2);
    let patches: f64 = detail.shape.deviations.iter().map(|d| d * d).sum();
    assert!((patches / PATCHES as f64 - 1.0).abs() < 0.03, "{patches}");
}

/// The error of a weighted mean of variances, found by drawing them.
#[test]
fn the_error_of_uneven_noise_is_that_of_drawn_ones() {
    let blocks: Vec<Noise> = (0..64)
        .map(|i| {
            let of_pixel = if i < 16 { 1.0 } else { 1.0 + f64::from(i) };
            Noise {
                of_pixel,
                of_means: of_pixel,
            }
        })
        .collect();
    let dimness = blocks.iter().map(|noise| noise.of_pixel).collect();
    let map = NoiseMap {
        blocks: blocks.into(),
        dimness,
        bright: 1.0,
        grid: [8; 2],
        block_px: [6.0; 2],
        corner_px: [0; 2],
        size_px: [48; 2],
        lit: 1.0,
        detail: 0.5,
    };
    let (mut normal, draws, share) = (Normal(5), 4000, 0.1);
    let mut square = 0.0;
    for _ in 0..draws {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (noise, weight) in map.weighted() {
            sum += weight * noise.of_pixel * share * normal.next();
            weights += weight;
        }
        square += (sum / weights / map.mean().of_pixel).powi(2);
    }
    let found = (square / f64::from(draws)).sqrt();
    let even = share / 64f64.sqrt();
    assert!(map.unevenness() > 1.1, "{}", map.unevenness());
    let off = found / (even * map.unevenness()) - 1.0;
    assert!(off.abs() < 0.05, "{found} {even} {}", map.unevenness());
}

/// Bright spots have more noise, and more detail; in even light they count as much as others.
#[test]
fn in_even_light_bright_and_dark_places_count_the_same() {
    let beam = beam(1.0);
    let file = dark_water(&beam);
    let response = file.sensor.response();
    let halves = |x: f64, _: f64| if x < 0.0 { 0.1 } else { 0.8 };
    let counts = picture_of(&file, &beam, (2.0, 3), &halves);
    let linear = LinearPicture::of_counts(&counts, file.sensor.encoding);
    let place = file.place(&response, 3.0);
    let column = place.column();
    let seen = place.seen(&column.lit(2.0), 100.0);
    let map = NoiseMap::new(&linear, &seen, place.exposure, 0, &response);
    let [(dark, of_dark), (bright, of_bright)] = [0, 160].map(|x| map.over([x, 0], [160, 192]));
    assert!(bright.of_pixel > 1.5 * dark.of_pixel, "{dark:?} {bright:?}");
    assert!((of_dark - 1.0).abs() < 1e-9 && (of_bright - 1.0).abs() < 1e-9);
}
