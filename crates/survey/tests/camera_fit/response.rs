//! Curves found from exposure series.

use uw_calib::Encoding;
use uw_render::image::{Counts, Frame, Picture};
use uw_render::scene::{Exposure, Noise, Sensor};
use uw_survey::camera_fit::response::{MOST_OFF, ResponseError, fit};

use crate::draw::Draw;

/// Light over two and a half decades, with detail; shifted by `shift` pixels.
fn view(shift: f64) -> Picture {
    let mut picture = Picture::black(240, 160);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let (x, y) = ((i % 240) as f64 + shift, (i / 240) as f64);
        let light = 10_f64.powf(-2.5 + 2.6 * x / 240.0);
        let value = light * (1.0 + 0.2 * (x / 9.0).sin() * (y / 13.0).cos());
        *pixel = [value, 0.8 * value, 0.5 * value].map(|v| v as f32);
    }
    picture
}

/// Frames of a sensor whose counts are 255·curve(light), with the noise of a usual one, rounded to 8 bits.
fn curved(light: &[f64], curve: impl Fn(f64) -> f64) -> Vec<Frame> {
    let frame = |(seed, exposure): (usize, &f64)| {
        let sensor = Sensor {
            exposure: Exposure::Fixed(*exposure),
            encoding: Encoding::Linear,
            bits: 16,
            noise: Some(Noise { a: 3e-4, b: 2e-6 }),
            ..Sensor::default()
        };
        let linear = sensor.expose(&view(0.0), seed as u64).in_8_bit_counts();
        let counts = linear
            .iter()
            .flatten()
            .map(|c| (255.0 * curve(c / 255.0)).round() as u8);
        Frame {
            width: 240,
            height: 160,
            counts: Counts::Bits8(counts.collect()),
        }
    };
    light.iter().enumerate().map(frame).collect()
}

/// Four pictures, each 1.7 to 3 times the light of the one before.
fn series(draw: &mut Draw) -> Vec<f64> {
    let mut light = vec![draw.between(0.1, 0.2)];
    for i in 0..3 {
        let next = light[i] * draw.between(1.7, 3.0);
        light.push(next);
    }
    light
}

/// The largest difference of the curve found from `truth` in the logarithm of light, after the best factor.
fn largest_off(curve: &[[f64; 3]], truth: impl Fn(f64) -> f64) -> f64 {
    let off = curve.iter().map(|row| (row[1] / truth(row[0])).ln());
    let off: Vec<f64> = off.collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    off.iter()
        .fold(0.0, |most: f64, o| most.max((o - mean).abs()))
}

#[test]
fn hidden_curves_are_found() {
    let mut draw = Draw(7);
    for run in 0..8 {
        let light = series(&mut draw);
        let hidden = [Encoding::Srgb, Encoding::Linear][run % 2];
        let frames = curved(&light, |y| hidden.counts(y) / 255.0);
        let found = fit(&frames, &light).expect("a fit");
        assert_eq!(found.encoding, hidden, "{light:?}");
        let off = largest_off(&found.curve, |counts| hidden.light(counts));
        // Noise and detail within a block bend the mean of counts by up to 2 % of light; nodes of 5 counts by 1 % in the dark.
        assert!(off < 0.04, "{hidden:?} {light:?}: {off}");
        assert!(found.nearer().rms < 0.01, "{hidden:?}: {:?}", found.off);
    }
}

/// A tone curve is found as it is, and serves as an encoding of its own.
#[test]
fn a_tone_curve_is_an_encoding_of_its_own() {
    let mut draw = Draw(8);
    for _ in 0..6 {
        let (light, gamma) = (series(&mut draw), draw.between(1.4, 1.8));
        let frames = curved(&light, |y| y.powf(1.0 / gamma));
        let found = fit(&frames, &light).expect("a fit");
        let off = largest_off(&found.curve, |counts| (counts / 255.0).powf(gamma));
        assert!(off < 0.05, "{gamma}: {off}");
        assert!(found.nearer().rms > MOST_OFF, "{gamma}: {:?}", found.off);
        assert!(matches!(found.encoding, Encoding::Curve(_)), "{gamma}");
        let taken: Vec<[f64; 3]> = (20..=240)
            .map(f64::from)
            .map(|counts| [counts, found.encoding.light(counts), 0.0])
            .collect();
        let off = largest_off(&taken, |counts| (counts / 255.0).powf(gamma));
        assert!(off < 0.05, "{gamma}: {off}");
    }
}

#[test]
fn what_does_not_go_together_is_refused() {
    let light = [0.1, 0.2, 0.4, 0.8];
    let frames = curved(&light, |y| Encoding::Srgb.counts(y) / 255.0);
    // The third picture had twice the light that is said.
    let told = fit(&frames, &[0.1, 0.2, 0.2, 0.8]).expect_err("wrong light");
    assert!(
        matches!(told, ResponseError::Contradiction { .. }),
        "{told}"
    );
    let told = fit(&frames, &[0.1, 0.2, 0.4]).expect_err("too few");
    assert_eq!(
        told.to_string(),
        "a response needs two or more pictures and a factor of light for each; got 4 pictures and 3 factors"
    );
    let told = fit(&frames, &[0.1, 0.0, 0.4, 0.8]).expect_err("no light");
    assert!(
        told.to_string()
            .contains("picture 2 must be finite and above 0, got 0"),
        "{told}"
    );
    let told = fit(&frames, &[1.0, 1.1, 1.0, 1.0]).expect_err("alike");
    assert!(matches!(told, ResponseError::Alike(_)), "{told}");
    // Even cards show a few counts each, with gaps between.
    let even = |light: &f64| Frame {
        width: 240,
        height: 160,
        counts: Counts::Bits8(vec![Encoding::Srgb.counts(*light) as u8; 3 * 240 * 160]),
    };
    let cards: Vec<Frame> = light.iter().map(even).collect();
    let told = fit(&cards, &light).expect_err("even cards");
    assert!(matches!(told, ResponseError::TooLittle { .. }), "{told}");
    let dark = curved(&[1e-3, 2e-3], |y| y);
    let told = fit(&dark, &[1.0, 2.0]).expect_err("dark");
    assert!(matches!(told, ResponseError::TooLittle { .. }), "{told}");
}
