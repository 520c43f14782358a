//! The sensor against its own closed forms.

use super::*;
use crate::scene::Encoding;
use uw_media::Vignetting;

fn uniform(level: f32, width: u32, height: u32) -> Picture {
    Picture {
        data: vec![[level; 3]; width as usize * height as usize],
        ..Picture::black(width, height)
    }
}

fn linear_16_bits(noise: Noise) -> Sensor {
    Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Linear,
        bits: 16,
        noise: Some(noise),
        ..Sensor::default()
    }
}

fn counts_16(frame: &Frame) -> Vec<u16> {
    match &frame.counts {
        Counts::Bits16(counts) => counts.clone(),
        Counts::Bits8(_) => panic!("16 bits were asked for"),
    }
}

/// A plain picture is darker by the share at each pixel, and noise is that of what is left; the mean of automatic exposure counts it.
#[test]
fn vignetting_is_before_noise_and_exposure() {
    let lens = Vignetting::new([-0.5, 0.1, 0.0]).expect("a lens");
    let sensor = Sensor {
        vignetting: Some(lens),
        noise: None,
        ..linear_16_bits(Noise { a: 0.0, b: 0.0 })
    };
    let plain = uniform(0.5, 64, 36);
    let counts = counts_16(&sensor.expose(&plain, 1));
    for (i, count) in counts.iter().step_by(3).enumerate() {
        let i = i as u32;
        let want = 0.5 * 65_535.0 * lens.share_at((i % 64, i / 64), (64, 36));
        assert!(
            (f64::from(*count) - want).abs() < 0.51,
            "{i} {count} {want}"
        );
    }
    let auto = Sensor {
        exposure: Exposure::AutoMean(0.3),
        ..sensor
    };
    let seen = counts_16(&auto.expose(&plain, 1));
    let mean = seen.iter().map(|&c| f64::from(c)).sum::<f64>() / seen.len() as f64;
    assert!((mean / 65_535.0 - 0.3).abs() < 1e-5, "{mean}");
    let noisy = Sensor {
        noise: Some(Noise { a: 4e-4, b: 0.0 }),
        ..sensor
    };
    let corner = lens.share(1.0);
    let seeds = 0..400;
    let values: Vec<f64> = seeds
        .map(|seed| f64::from(counts_16(&noisy.expose(&uniform(0.5, 8, 8), seed))[0]) / 65_535.0)
        .collect();
    let mean = values.iter().sum::<f64>() / 400.0;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 399.0;
    let share = lens.share_at((0, 0), (8, 8));
    assert!(share > corner);
    // Five standard errors of a variance of 400 values.
    let off = variance / (4e-4 * 0.5 * share) - 1.0;
    assert!(off.abs() < 5.0 * (2.0f64 / 399.0).sqrt(), "{off}");
}

fn counts_8(frame: &Frame) -> Vec<u8> {
    match &frame.counts {
        Counts::Bits8(counts) => counts.clone(),
        Counts::Bits16(_) => panic!("8 bits were asked for"),
    }
}

/// Standard normal distribution function by Simpson's rule from -9, where it is below 1e-18.
fn normal_cdf(x: f64) -> f64 {
    let (from, steps) = (-9.0, 4000);
    let h = (x - from) / f64::from(steps);
    let weight = |i| {
        if i == 0 || i == steps {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=steps)
        .map(|i| weight(i) * normal_density(from + h * f64::from(i)))
        .sum::<f64>()
        * h
        / 3.0
}

fn normal_density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / TAU.sqrt()
}

/// Mean and variance of min(max(N(y, s²), 0), 1) (Foi 2009, Signal Processing 89, 2609-2629).
fn clipped_moments(y: f64, s: f64) -> (f64, f64) {
    let (low, high) = (y / s, (y - 1.0) / s);
    let (cdf_low, cdf_high) = (normal_cdf(low), normal_cdf(high));
    let (density_low, density_high) = (normal_density(low), normal_density(high));
    let mean = cdf_low * y - cdf_high * (y - 1.0) + s * density_low - s * density_high;
    let common = y * y - 2.0 * mean * y + s * s;
    let variance = cdf_low * common + mean * mean - cdf_high * (common + 2.0 * mean - 1.0)
        + s * density_high * (2.0 * mean - y - 1.0)
        - s * density_low * (2.0 * mean - y);
    (mean, variance)
}

#[test]
fn noise_has_the_mean_and_variance_of_the_clipped_model() {
    // Foi's test values of (a, b), at the dark end, in the middle and near saturation.
    for (a, b) in [
        (0.01, 0.0016),
        (0.01, 0.0004),
        (0.0, 0.04),
        (0.033333, 0.01),
    ] {
        for level in [0.0_f32, 0.02, 0.5, 0.9, 1.0, 1.05] {
            let noise = Noise { a, b };
            let frame = linear_16_bits(noise).expose(&uniform(level, 400, 250), 11);
            let values: Vec<f64> = counts_16(&frame)
                .into_iter()
                .map(|count| f64::from(count) / 65535.0)
                .collect();
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let squares: Vec<f64> = values.iter().map(|value| (value - mean).powi(2)).collect();
            let variance = squares.iter().sum::<f64>() / n;
            let y = f64::from(level);
            let (expected_mean, expected_variance) = clipped_moments(y, (a * y + b).sqrt());
            // 48 comparisons: 4.5 standard errors are exceeded by chance once in 3000 runs of this test
            // under other seeds; the seed is fixed.
            let mean_error = (expected_variance / n).sqrt();
            let fourth = squares
                .iter()
                .map(|square| (square - variance).powi(2))
                .sum::<f64>()
                / n;
            let variance_error = (fourth / n).sqrt();
            assert!(
                (mean - expected_mean).abs() < 4.5 * mean_error,
                "mean at {a} {b} {level}: {mean} {expected_mean}"
            );
            assert!(
                (variance - expected_variance).abs() < 4.5 * variance_error,
                "variance at {a} {b} {level}: {variance} {expected_variance}"
            );
        }
    }
}

#[test]
fn noise_depends_on_seed_place_and_channel_but_not_on_threads() {
    let sensor = linear_16_bits(Noise { a: 0.01, b: 0.001 });
    let picture = uniform(0.4, 64, 32);
    let frame = sensor.expose(&picture, 3);
    let alone = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("pool");
    assert_eq!(alone.install(|| sensor.expose(&picture, 3)), frame);
    assert_ne!(sensor.expose(&picture, 4), frame);
    let counts = counts_16(&frame);
    let pair_products = |step: usize| {
        let pairs = counts.iter().zip(&counts[step..]);
        let deviations =
            pairs.map(|(x, y)| (f64::from(*x) / 65535.0 - 0.4) * (f64::from(*y) / 65535.0 - 0.4));
        deviations.sum::<f64>() / (counts.len() - step) as f64 / 0.005
    };
    // Correlation between channels, pixels and rows: 0 within 4.5 standard errors of 1/sqrt(6144).
    for step in [1, 2, 3, 6, 192] {
        assert!(
            pair_products(step).abs() < 4.5 / 6144.0_f64.sqrt(),
            "step {step}"
        );
    }
}

#[test]
fn without_noise_counts_are_the_encoded_signal_rounded() {
    let mut picture = uniform(0.5, 3, 1);
    picture.data = vec![
        [0.0, 0.25, 0.5],
        [1.0, 2.0, -1.0],
        [0.001, f32::NAN, f32::INFINITY],
    ];
    let srgb = Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding: Encoding::Srgb,
        bits: 8,
        noise: None,
        ..Sensor::default()
    };
    // sRGB: 0.25 is 136.96, 0.5 is 187.52, 0.001 is 3.29 of 255.
    assert_eq!(
        counts_8(&srgb.expose(&picture, 0)),
        [0, 137, 188, 255, 255, 0, 3, 0, 255]
    );
    let linear = Sensor {
        encoding: Encoding::Linear,
        bits: 16,
        ..srgb
    };
    assert_eq!(
        counts_16(&linear.expose(&picture, 0))[..5],
        [0, 16384, 32768, 65535, 65535]
    );
    let double = Sensor {
        exposure: Exposure::Fixed(2.0),
        ..linear
    };
    assert_eq!(counts_16(&double.expose(&picture, 0))[1], 32768);
}

#[test]
fn automatic_exposure_brings_the_mean_to_its_value() {
    let auto = Sensor {
        exposure: Exposure::AutoMean(0.4),
        encoding: Encoding::Linear,
        bits: 16,
        noise: None,
        ..Sensor::default()
    };
    let mut picture = uniform(0.0, 2, 1);
    picture.data = vec![[0.01, 0.02, 0.03], [0.02, 0.03, 0.01]];
    assert!((auto.exposure_factor(&picture) - 20.0).abs() < 1e-5);
    let counts = counts_16(&auto.expose(&picture, 0));
    let mean = counts.iter().map(|count| f64::from(*count)).sum::<f64>() / 6.0 / 65535.0;
    assert!((mean - 0.4).abs() < 1e-5);
    assert_eq!(auto.exposure_factor(&Picture::black(4, 4)), 1.0);
}

#[test]
fn white_balance_makes_a_grey_world_grey_after_the_noise() {
    let picture = Picture {
        width: 2,
        height: 1,
        data: vec![[0.05, 0.2, 0.1], [0.15, 0.4, 0.3]],
    };
    let of = |white_balance, exposure| Sensor {
        white_balance,
        exposure,
        encoding: Encoding::Linear,
        bits: 16,
        ..Sensor::default()
    };
    let stored = |sensor: Sensor| -> Vec<f64> {
        let counts = counts_16(&sensor.expose(&picture, 1));
        counts
            .iter()
            .map(|&count| f64::from(count) / 65_535.0)
            .collect()
    };
    let gray = stored(of(WhiteBalance::Gray, Exposure::Fixed(1.0)));
    for k in [0, 2] {
        assert!((gray[k] + gray[k + 3] - gray[1] - gray[4]).abs() < 1e-4);
    }
    let auto = stored(of(WhiteBalance::Gray, Exposure::AutoMean(0.4)));
    assert!((auto.iter().sum::<f64>() / 6.0 - 0.4).abs() < 1e-4);
    let gains = stored(of(
        WhiteBalance::Gains([2.0, 1.0, 0.5]),
        Exposure::Fixed(1.0),
    ));
    assert!((gains[0] - 0.1).abs() < 1e-4 && (gains[5] - 0.15).abs() < 1e-4);
    // What the matrix makes of the balanced signal, clipped only then.
    let matrix = stored(Sensor {
        color_matrix: [[1.5, -0.5, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 2.0]],
        ..of(WhiteBalance::Gains([2.0, 1.0, 0.5]), Exposure::Fixed(1.0))
    });
    for (got, expected) in matrix.iter().zip([0.05, 0.2, 0.0, 0.25, 0.4, 0.0]) {
        assert!((got - expected).abs() < 1e-4, "{matrix:?}");
    }
}
