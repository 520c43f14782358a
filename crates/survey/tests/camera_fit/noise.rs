//! Noise found from frames that the project's own sensor made.

use uw_calib::Encoding;
use uw_render::image::{Frame, Picture};
use uw_render::scene::{Exposure, Noise, Sensor, WhiteBalance};
use uw_survey::camera_fit::FramesError;
use uw_survey::camera_fit::noise::{NoiseFit, fit};

const SIZE: (u32, u32) = (160, 120);

/// A picture with dark and bright parts, black and saturated spots, and detail down to a pixel; shifted by `shift` pixels.
fn view(shift: f64) -> Picture {
    let mut picture = Picture::black(SIZE.0, SIZE.1);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let x = (i % SIZE.0 as usize) as f64 + shift;
        let y = (i / SIZE.0 as usize) as f64;
        let light = (x / 160.0).powi(2) * 1.2;
        let broad = 1.0 + 0.4 * (x / 7.0 + (y / 11.0).sin()).sin() * (y / 9.0).cos();
        let fine = 1.0 + 0.15 * (1.9 * x).sin() * (2.3 * y).cos();
        let value = light * broad * fine;
        *pixel = [value, 0.6 * value + 0.01, 0.3 * value].map(|v| v as f32);
    }
    picture
}

fn sensor(encoding: Encoding, bits: u8, noise: [f64; 2]) -> Sensor {
    Sensor {
        exposure: Exposure::Fixed(1.0),
        encoding,
        bits: bits.into(),
        noise: Some(Noise {
            a: noise[0],
            b: noise[1],
        }),
        ..Sensor::default()
    }
}

fn frames(sensor: &Sensor, seeds: &[u64]) -> Vec<Frame> {
    let exposed = seeds.iter().map(|&seed| sensor.expose(&view(0.0), seed));
    exposed.collect()
}

fn good(frames: &[Frame], encoding: Encoding) -> NoiseFit {
    fit(frames, encoding, false).expect("a fit")
}

/// Errors told are errors made: over 40 pairs or triples of frames deviations have a mean square near 1 in units of the errors (its
/// root scatters by 0.11), and 90 % intervals hold the hidden values at least 31 times (98.5 % of the time if they are right).
#[test]
fn hidden_noise_lies_within_the_errors_told() {
    let cases = [
        (Encoding::Srgb, 8, [2e-4, 1e-6], 2),
        (Encoding::Srgb, 8, [1e-3, 1e-5], 2),
        (Encoding::Linear, 8, [1e-3, 1e-5], 3),
        (Encoding::Linear, 16, [2e-4, 1e-6], 2),
    ];
    for (encoding, bits, hidden, count) in cases {
        let sensor = sensor(encoding, bits, hidden);
        let mut held = [0; 2];
        let (mut sums, mut squares, mut offs, mut misfit) = ([0.0; 2], [0.0; 2], [0.0; 2], 0.0);
        for run in 0..40 {
            let seeds: Vec<u64> = (0..count).map(|i| 100 * run + i + 1).collect();
            let found = good(&frames(&sensor, &seeds), encoding);
            let values = [found.noise.a, found.noise.b];
            for k in 0..2 {
                let off = (values[k] - hidden[k]) / found.errors[k];
                held[k] += usize::from(off.abs() < 1.645);
                sums[k] += off;
                offs[k] += off * off;
                squares[k] += found.errors[k] / hidden[k];
            }
            misfit += found.misfit;
            assert_eq!(found.warnings, Vec::<String>::new(), "{encoding:?} {bits}");
        }
        assert!(misfit / 40.0 < 1.3, "{encoding:?} {bits}: {misfit}");
        for k in 0..2 {
            // Two frames of this size know a within 2 % and b within 20 %.
            let relative = squares[k] / 40.0;
            assert!(
                relative < [0.02, 0.2][k],
                "{encoding:?} {bits} {k}: {relative}"
            );
            assert!(held[k] >= 31, "{encoding:?} {bits} {held:?}");
            let rms = (offs[k] / 40.0).sqrt();
            assert!((0.6..1.4).contains(&rms), "{encoding:?} {bits} {k}: {rms}");
            // The mean of 40 scatters by 0.16 errors; half an error would be a bias.
            assert!((sums[k] / 40.0).abs() < 0.5, "{encoding:?} {bits} {sums:?}");
        }
    }
}

#[test]
fn a_gain_between_frames_is_removed_and_told() {
    let hidden = [5e-4, 4e-6];
    let dim = sensor(Encoding::Srgb, 8, hidden);
    let bright = Sensor {
        exposure: Exposure::Fixed(1.06),
        ..dim
    };
    let pair = [dim.expose(&view(0.0), 1), bright.expose(&view(0.0), 2)];
    let found = good(&pair, Encoding::Srgb);
    assert!((found.gains[1] / found.gains[0] - 1.06).abs() < 2e-3);
    assert!(found.warnings.iter().any(|w| w.contains("times the light")));
    let off = (found.noise.a - hidden[0]).abs();
    assert!(off < 4.0 * found.errors[0], "{found:?}");
    let brighter = Sensor {
        exposure: Exposure::Fixed(2.0),
        ..dim
    };
    let pair = [dim.expose(&view(0.0), 1), brighter.expose(&view(0.0), 2)];
    let told = fit(&pair, Encoding::Srgb, false).expect_err("another exposure");
    assert!(matches!(told, FramesError::Exposure { .. }), "{told}");
}

#[test]
fn frames_that_do_not_match_are_refused() {
    let sensor = sensor(Encoding::Srgb, 8, [2e-4, 1e-6]);
    let first = sensor.expose(&view(0.0), 1);
    let told = |second: &Frame| {
        let pair = [first.clone(), second.clone()];
        fit(&pair, Encoding::Srgb, false).expect_err("refused")
    };
    for shift in [0.2, 1.0, 3.0, 20.0] {
        let told = told(&sensor.expose(&view(shift), 2));
        let moved = matches!(
            told,
            FramesError::Moved { .. } | FramesError::Smooth { .. } | FramesError::Unlike { .. }
        );
        assert!(moved, "{shift}: {told}");
    }
    assert_eq!(told(&first), FramesError::Same(1, 2));
    let small = sensor.expose(&Picture::black(80, 60), 2);
    let words = told(&small).to_string();
    assert!(
        words.contains("frame 2 has 80 x 60 pixels of 8 bits"),
        "{words}"
    );
    let deep = Sensor { bits: 16, ..sensor }.expose(&view(0.0), 2);
    assert!(matches!(told(&deep), FramesError::Different { .. }));
    let one = fit(std::slice::from_ref(&first), Encoding::Srgb, false);
    assert_eq!(one, Err(FramesError::TooFew(1)));
    let dark = |seed| sensor.expose(&Picture::black(160, 120), seed);
    let none = fit(&[dark(1), dark(2)], Encoding::Srgb, false);
    assert!(
        matches!(none, Err(FramesError::TooLittle { .. })),
        "{none:?}"
    );
}

/// What the model does not hold for is told: gains of a white balance, another curve than was said.
#[test]
fn what_the_line_does_not_fit_is_told() {
    let plain = sensor(Encoding::Srgb, 8, [1e-3, 1e-5]);
    let balanced = Sensor {
        white_balance: WhiteBalance::Gains([1.0, 1.6, 2.5]),
        ..plain
    };
    let found = good(&frames(&balanced, &[1, 2]), Encoding::Srgb);
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.contains("channels have different noise")),
        "{:?}",
        found.warnings
    );
    let found = good(&frames(&plain, &[1, 2]), Encoding::Linear);
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.contains("no straight line")),
        "{:?}",
        found.warnings
    );
}
