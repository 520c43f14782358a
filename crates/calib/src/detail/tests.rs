use super::*;
use crate::Encoding;
use crate::noise::SensorNoise;
use crate::normal::Normal;
use crate::response::{CountResponse, LinearNoise};
use crate::stats::patch_statistics;

const SIZE: [usize; 2] = [240, 144];
const PATCH_PIXELS: f64 = 24.0 * 24.0;
const PATCHES: f64 = 60.0;

/// Of the order of current small cameras, and of a poor one.
const NOISES: [LinearNoise; 2] = [
    LinearNoise { a: 2e-4, b: 1e-6 },
    LinearNoise { a: 1e-3, b: 1e-5 },
];

/// Detail several pixels wide around a level that rises by a half across the picture, in linear light.
fn texture(level: f64, amplitude: f64) -> impl Fn(usize) -> [f64; 3] {
    tilted(level, amplitude, 0.4)
}

/// The same with another rise.
fn tilted(level: f64, amplitude: f64, rise: f64) -> impl Fn(usize) -> [f64; 3] {
    move |i| {
        let (x, y) = ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
        let pattern = (0.50 * x + 0.3 * (0.11 * y).sin()).sin() * (0.43 * y).cos();
        let tilt = 1.0 + rise * (x / SIZE[0] as f64 - 0.5);
        [1.0, 0.8, 0.5].map(|channel| level * channel * tilt * (1.0 + amplitude * pattern))
    }
}

/// Counts as a sensor stores linear light, in steps of `step`.
fn stored(
    light: &dyn Fn(usize) -> [f64; 3],
    noise: LinearNoise,
    encoding: Encoding,
    step: f64,
    seed: u64,
) -> Vec<[f64; 3]> {
    let mut normal = Normal::new(seed);
    (0..SIZE[0] * SIZE[1])
        .map(|i| {
            light(i).map(|y| {
                let noisy = y + noise.standard_deviation(y) * normal.next();
                (encoding.counts(noisy) / step).round() * step
            })
        })
        .collect()
}

fn measure(counts: &[[f64; 3]], step: f64, model: &NoiseModel) -> (PatchGrid, Detail) {
    let pixel = |i: usize| counts[i];
    let grid = patch_statistics(SIZE[0], SIZE[1], pixel).unwrap();
    let planes = Planes::new(SIZE[0], SIZE[1], pixel);
    let detail = Detail::measure(&grid, &planes, step, model, None).unwrap();
    (grid, detail)
}

fn known(encoding: Encoding, noise: LinearNoise) -> NoiseModel {
    NoiseModel::Sensor(SensorNoise::new(encoding, noise).unwrap())
}

/// The root of a noisy difference has, on average, nearly the root of the true one, and what the floor is made of is its own.
#[test]
fn the_root_near_zero_is_nearly_unbiased() {
    let step = 0.01;
    // Middles of steps: the root jumps at 0.
    let normal: Vec<(f64, f64)> = (-700..700)
        .map(|i| (f64::from(i) + 0.5) * step)
        .map(|z| {
            (
                z,
                step * (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt(),
            )
        })
        .collect();
    let mean = |of: &dyn Fn(f64) -> f64| normal.iter().map(|&(z, p)| p * of(z)).sum::<f64>();
    let mut cut: f64 = 0.0;
    for k in 0..=400 {
        let right = 0.05 * f64::from(k);
        let bias = mean(&|z| root(right + z, 1.0)) - right.sqrt();
        assert!(bias.abs() < 0.142, "{right} {bias}");
        assert!(bias.abs() < 0.01 || right < 4.0, "{right} {bias}");
        cut = cut.max(mean(&|z| (right + z).max(0.0).sqrt()) - right.sqrt());
    }
    assert!(cut > 0.4);
    let at_zero = mean(&|z| root(z, 1.0));
    let deviation = (mean(&|z| root(z, 1.0).powi(2)) - at_zero * at_zero).sqrt();
    let slope = mean(&|z| z * root(z, 1.0));
    for (got, used) in [
        (at_zero, ROOT_MEAN),
        (deviation, ROOT_DEVIATION),
        (slope, ROOT_SLOPE),
    ] {
        assert!((got - used).abs() < 1e-3, "{got} {used}");
    }
    // Units: counts for squared counts.
    assert!((root(9.0 * 0.7, 9.0) - 3.0 * root(0.7, 1.0)).abs() < 1e-12);
}

/// Texture through a noisy sensor has the contrast that it has without the noise.
#[test]
fn contrast_without_noise_is_that_of_the_picture_without_noise() {
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        for noise in NOISES {
            for (level, amplitude) in [(0.05, 0.3), (0.2, 0.08), (0.4, 0.03), (0.6, 0.15)] {
                let light = texture(level, amplitude);
                let right =
                    patch_statistics(SIZE[0], SIZE[1], |i| light(i).map(|y| encoding.counts(y)))
                        .unwrap()
                        .stats
                        .contrast;
                for (step, seed) in [(1.0, 3), (1.0 / 257.0, 4)] {
                    let counts = stored(&light, noise, encoding, step, seed);
                    for (model, shared) in
                        [(known(encoding, noise), 0.0), (NoiseModel::Picture, 0.12)]
                    {
                        let (grid, detail) = measure(&counts, step, &model);
                        for k in 0..3 {
                            let variance = detail.noise[k].powi(2);
                            // Errors of s² by the noise in it, of each patch for itself, and of the noise that patches share.
                            let own = variance / PATCH_PIXELS
                                * (1.0 + 0.5 * variance / right[k].powi(2))
                                / PATCHES;
                            let common = shared * variance / (2.0 * right[k]);
                            // What is clipped at 0 or 1 and levels between quadrature points: 1 %.
                            let error = 4.0 * own.sqrt() + common + 0.01 * right[k];
                            let got = detail.contrast[k];
                            assert!(
                                (got - right[k]).abs() < error,
                                "{encoding:?} {noise:?} {level} {step} {k}: {got} {} {error}, with noise {}",
                                right[k],
                                grid.stats.contrast[k]
                            );
                        }
                    }
                }
            }
        }
    }
}

/// A picture that is black but for noise has published contrast, and none without the noise.
#[test]
fn noise_alone_stays_below_the_floor() {
    let (mut channels, mut above, mut published) = (0, 0, [f64::INFINITY, 0.0]);
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        for noise in NOISES {
            for level in [0.0, 1e-3, 0.05, 0.5] {
                for seed in 1..=4 {
                    let counts = stored(&|_| [level; 3], noise, encoding, 1.0, seed);
                    for model in [known(encoding, noise), NoiseModel::Picture] {
                        let (grid, detail) = measure(&counts, 1.0, &model);
                        for k in 0..3 {
                            let contrast = grid.stats.contrast[k];
                            published = [published[0].min(contrast), published[1].max(contrast)];
                            channels += 1;
                            above += usize::from(detail.contrast[k] > detail.floor[k]);
                            // Nor is it far below 0, nor is the floor near the published contrast.
                            assert!(!detail.noise_overstated()[k], "{detail:?}");
                            assert!(detail.floor[k] < 0.5 * contrast.max(0.6), "{detail:?}");
                        }
                    }
                }
            }
        }
    }
    assert!(published[1] > 5.0, "{published:?}");
    // Three standard errors: 0.5 of 384 expected; more than 4 in one of 5000 tries.
    assert!(above <= 4, "{above} of {channels}");
}

/// The mean over many pictures of noise and of faint texture, against the plain root that is cut off at 0.
#[test]
fn faint_texture_comes_out_without_the_bias_of_a_cut_root() {
    let noise = NOISES[1];
    let model = known(Encoding::Linear, noise);
    for amplitude in [0.0, 0.004, 0.008] {
        let light = tilted(0.3, amplitude, 0.0);
        let right = patch_statistics(SIZE[0], SIZE[1], |i| light(i).map(|y| 255.0 * y)).unwrap();
        let (mut got, mut cut, mut scale) = (0.0, 0.0, 0.0);
        let pictures = 12;
        for seed in 1..=pictures {
            let counts = stored(&light, noise, Encoding::Linear, 1.0, seed);
            let (grid, detail) = measure(&counts, 1.0, &model);
            let patches = grid.patches.iter().map(|p| p.std[0].powi(2));
            cut += patches
                .map(|s| (s - detail.noise[0].powi(2)).max(0.0).sqrt())
                .sum::<f64>()
                / PATCHES;
            got += detail.contrast[0];
            scale += (detail.noise[0].powi(2) * (2.0 / PATCH_PIXELS).sqrt()).sqrt();
        }
        let n = pictures as f64;
        let (got, cut, scale) = (got / n, cut / n, scale / n);
        let right = right.stats.contrast[0];
        // The bias of the root, and 4 standard errors of the mean of 12 × 60 patches.
        let allowed = scale * (0.142 + 4.0 * ROOT_DEVIATION / (n * PATCHES).sqrt());
        assert!(
            (got - right).abs() < allowed,
            "{amplitude}: {got} {right} {allowed}"
        );
        if amplitude == 0.0 {
            assert!(
                cut - right > 1.5 * (got - right).abs(),
                "{cut} {got} {right}"
            );
        }
    }
}

/// The noise found in a picture is that of the sensor, with texture in it and where the level differs.
#[test]
fn noise_found_in_the_picture_is_that_of_the_sensor() {
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        for noise in NOISES {
            for level in [0.004, 0.1, 0.5] {
                let counts = stored(&texture(level, 0.1), noise, encoding, 1.0, 7);
                let (_, sensor) = measure(&counts, 1.0, &known(encoding, noise));
                let (_, picture) = measure(&counts, 1.0, &NoiseModel::Picture);
                assert_eq!(
                    (sensor.source, picture.source),
                    (NoiseSource::Sensor, NoiseSource::Picture)
                );
                for k in 0..3 {
                    // 4 standard errors of three medians of 80 cells are 11 % of the variance; noise below half a count is
                    // not told from rounding.
                    let ratio = picture.noise[k] / sensor.noise[k];
                    assert!(
                        (ratio - 1.0).abs() < 0.06 || sensor.noise[k] < 0.5,
                        "{encoding:?} {noise:?} {level} {k}: {ratio} of {}",
                        sensor.noise[k]
                    );
                }
            }
        }
    }
}

/// The same without texture, averaged over pictures: the median of cells is brought to the mean.
#[test]
fn noise_found_in_even_pictures_is_unbiased() {
    for encoding in [Encoding::Srgb, Encoding::Linear] {
        let pictures = 12;
        let mut ratio = 0.0;
        for seed in 1..=pictures {
            let counts = stored(&|_| [0.3; 3], NOISES[1], encoding, 1.0, seed);
            let (_, sensor) = measure(&counts, 1.0, &known(encoding, NOISES[1]));
            let (_, picture) = measure(&counts, 1.0, &NoiseModel::Picture);
            let squared = |k: usize| (picture.noise[k] / sensor.noise[k]).powi(2);
            ratio += (squared(0) + squared(1) + squared(2)) / (3.0 * pictures as f64);
        }
        // 4 standard errors of 36 medians of 240 cells.
        assert!((ratio - 1.0).abs() < 0.019, "{encoding:?} {ratio}");
    }
}

/// Of a patch that spans many levels the mean over its levels counts, not the noise at its mean.
#[test]
fn noise_of_a_patch_is_the_mean_over_its_levels() {
    let encoding = Encoding::Srgb;
    let sensor = SensorNoise::new(encoding, NOISES[1]).unwrap();
    let light = |i: usize| 0.1 * (1.0 + 0.85 * (0.05 * f64::from(i as u32)).sin());
    let n = 4000;
    let levels: Vec<f64> = (0..n).map(light).collect();
    let response = CountResponse::new(encoding, NOISES[1]);
    let stored: Vec<(f32, f32)> = levels.iter().map(|&y| response.at(y as f32)).collect();
    let right = stored.iter().map(|s| f64::from(s.1)).sum::<f64>() / f64::from(n as u32);
    let counts: Vec<f64> = stored.iter().map(|s| f64::from(s.0)).collect();
    let mean = counts.iter().sum::<f64>() / f64::from(n as u32);
    let texture = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / f64::from(n as u32);
    let got = sensor.of_patch(mean, texture + right, 1.0);
    let at_mean = sensor.of_patch(mean, 0.0, 1.0);
    assert!((got / right - 1.0).abs() < 0.04, "{got} {right} {at_mean}");
    assert!((at_mean / right - 1.0).abs() > 0.08, "{at_mean} {right}");
}

/// Texture of single pixels is noise as far as a picture can tell; a known sensor knows better.
#[test]
fn the_estimate_is_an_upper_bound_where_texture_is_fine() {
    let mut normal = Normal::new(5);
    let fine: Vec<f64> = (0..SIZE[0] * SIZE[1]).map(|_| normal.next()).collect();
    let light = |i: usize| [0.3 * (1.0 + 0.05 * fine[i]); 3];
    let counts = stored(&light, NOISES[0], Encoding::Linear, 1.0, 1);
    let (_, picture) = measure(&counts, 1.0, &NoiseModel::Picture);
    let (_, sensor) = measure(&counts, 1.0, &known(Encoding::Linear, NOISES[0]));
    let right = 255.0 * 0.3 * 0.05;
    assert!(
        (sensor.contrast[1] / right - 1.0).abs() < 0.03,
        "{sensor:?}"
    );
    assert!(
        picture.noise[1] > 0.95 * right && picture.at_floor()[1],
        "{picture:?}"
    );
    assert!(!sensor.at_floor()[1]);
}

#[test]
fn clipped_pixels_are_counted_and_told() {
    let pixel = |i: usize| -> [f64; 3] {
        let part = (i % 100) as f64;
        [
            if part < 2.0 { 255.0 } else { 100.0 + part },
            if part < 1.0 { 255.0 } else { 100.0 + part },
            if part < 50.0 { 0.0 } else { part },
        ]
    };
    let grid = patch_statistics(100, 60, pixel).unwrap();
    let detail = Detail::measure(
        &grid,
        &Planes::new(100, 60, pixel),
        1.0,
        &NoiseModel::Picture,
        None,
    )
    .unwrap();
    assert_eq!(detail.saturated, [0.02, 0.01, 0.0]);
    assert_eq!(detail.black, [0.0, 0.0, 0.5]);
    let told = detail.warnings();
    assert!(
        told.iter().any(|t| t.starts_with("R: more than 1 %")),
        "{told:?}"
    );
    // Half of the noise about a black level of 0 is clipped.
    let dark = stored(&|_| [0.0; 3], NOISES[1], Encoding::Linear, 1.0, 1);
    let (_, dark) = measure(&dark, 1.0, &NoiseModel::Picture);
    assert!(dark.black.iter().all(|&share| share > 0.5), "{dark:?}");
    assert!(dark.warnings()[0].starts_with("R, G, B: contrast is at the noise floor"));
}

#[test]
fn even_pictures_small_ones_and_wrong_noise() {
    let even = |_: usize| [128.0, 0.0, 255.0];
    let grid = patch_statistics(40, 24, even).unwrap();
    let planes = Planes::new(40, 24, even);
    for model in [known(Encoding::Srgb, NOISES[0]), NoiseModel::Picture] {
        let detail = Detail::measure(&grid, &planes, 1.0, &model, None).unwrap();
        assert_eq!(detail.contrast, [0.0; 3]);
        assert_eq!(detail.at_floor(), [true; 3]);
    }
    // Patches of 2 x 2 pixels have no difference of Laplacians.
    let grid = patch_statistics(20, 12, even).unwrap();
    let planes = Planes::new(20, 12, even);
    assert_eq!(
        Detail::measure(&grid, &planes, 1.0, &NoiseModel::Picture, None),
        None
    );
    assert!(
        Detail::measure(&grid, &planes, 1.0, &known(Encoding::Srgb, NOISES[0]), None).is_some()
    );
    // A sensor five times as noisy as the picture.
    let counts = stored(&|_| [0.3; 3], NOISES[0], Encoding::Srgb, 1.0, 1);
    let wrong = LinearNoise { a: 1e-3, b: 5e-6 };
    let (_, detail) = measure(&counts, 1.0, &known(Encoding::Srgb, wrong));
    assert_eq!(detail.noise_overstated(), [true; 3]);
    assert!(detail.warnings()[0].contains("less noise than is stated"));
    assert_eq!(
        SensorNoise::new(Encoding::Srgb, LinearNoise { a: -1.0, b: 0.0 }),
        None
    );
}
