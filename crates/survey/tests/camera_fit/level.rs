//! Lamps' levels found from pictures of a board.

use uw_calib::Encoding;
use uw_calib::vehicle::Vehicle;
use uw_render::image::{Frame, Picture};
use uw_survey::camera_fit::level::{LevelError, fit};
use uw_twin::environment::sensor;

use crate::draw::Draw;

const SIZE: (u32, u32) = (240, 160);

/// A board under a lamp at a share of its light, and the room's.
fn frame((share, room): (f64, f64), exposure: f64, encoding: Encoding, seed: u64) -> Frame {
    let mut picture = Picture::black(SIZE.0, SIZE.1);
    for (i, pixel) in picture.data.iter_mut().enumerate() {
        let across = f64::from(i as u32 % SIZE.0) / f64::from(SIZE.0) - 0.5;
        let down = f64::from(i as u32 / SIZE.0) / f64::from(SIZE.1) - 0.4;
        let lamp = 0.8 * (-6.0 * (across * across + down * down)).exp();
        *pixel = [1.0, 0.9, 0.8].map(|tint| (lamp * share * tint + room * (1.0 - across)) as f32);
    }
    let vehicle = Vehicle {
        encoding,
        ..Vehicle::default()
    };
    sensor(&vehicle, exposure).expose(&picture, seed)
}

#[test]
fn hidden_curves_are_found() {
    let mut draw = Draw(9);
    for case in 0..12u64 {
        let encoding = [Encoding::Srgb, Encoding::Linear][case as usize % 2];
        // Light as a power of the level above a dead band, as drivers of lamps have it.
        let (power, dead) = (draw.between(0.7, 3.0), draw.between(0.0, 15.0));
        let share = |level: f64| ((level - dead).max(0.0) / (100.0 - dead)).powf(power);
        let room = draw.between(0.0, 0.02);
        let levels = [0.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0];
        // Dim ones are exposed longer.
        let exposures = levels.map(|level| if level < 50.0 { 1.2 } else { 1.0 });
        let frames: Vec<Frame> = levels
            .iter()
            .zip(exposures)
            .map(|(&level, exposure)| {
                let seed = 100 * case + level as u64;
                frame((share(level), room), exposure, encoding, seed)
            })
            .collect();
        let found = fit(&frames, &levels, &exposures, encoding).expect("a curve");
        for ([level, light, error], own) in found.points.iter().zip(levels) {
            let hidden = 100.0 * share(own);
            assert_eq!(*level, own);
            assert!(
                (light - hidden).abs() < 0.05 + 0.005 * hidden,
                "{case}, {level} %: {light} ± {error}, hidden {hidden}"
            );
            let back = found.curve.light_pct(own);
            assert!((back - hidden).abs() < 0.05 + 0.01 * hidden, "{back}");
        }
        assert!(found.spread < 0.05, "{}", found.spread);
    }
}

#[test]
fn what_tells_nothing_of_the_levels_is_refused() {
    let at = |share: f64, room: f64, seed: u64| frame((share, room), 1.0, Encoding::Srgb, seed);
    let refused = |frames: &[Frame], levels: &[f64]| {
        let same = vec![1.0; frames.len()];
        fit(frames, levels, &same, Encoding::Srgb).expect_err("refused")
    };
    let (half, full) = (at(0.5, 0.0, 1), at(1.0, 0.0, 2));
    for (frames, levels, words) in [
        (vec![full.clone()], vec![100.0], "two pictures are needed"),
        (
            vec![half.clone(), full.clone()],
            vec![50.0],
            "got 2 pictures, 1 levels",
        ),
        (
            vec![half.clone(), full.clone()],
            vec![50.0, 90.0],
            "must be 100",
        ),
        (
            vec![half.clone(), full.clone()],
            vec![0.0, 100.0],
            "at least one between 0 and 100",
        ),
        (
            vec![half.clone(), full.clone()],
            vec![50.0, 101.0],
            "must be in [0, 100] percent, got 101",
        ),
        // In the wrong order.
        (
            vec![at(0.7, 0.0, 3), at(0.2, 0.0, 4), full.clone()],
            vec![20.0, 70.0, 100.0],
            "light must not fall where the level rises",
        ),
        (
            vec![half.clone(), at(2.0, 0.0, 5)],
            vec![50.0, 100.0],
            "of picture 2 are at full scale",
        ),
        (
            vec![at(0.005, 0.0, 6), at(0.01, 0.0, 7)],
            vec![50.0, 100.0],
            "a board nearer to the lamp",
        ),
        // The room's light, without a picture of it.
        (
            vec![at(0.1, 0.1, 8), at(0.8, 0.1, 9)],
            vec![50.0, 100.0],
            "give a picture at level 0",
        ),
    ] {
        let told = refused(&frames, &levels).to_string();
        assert!(told.contains(words), "{told}");
    }
    let wrong = fit(&[half, full], &[50.0, 100.0], &[1.0, 0.0], Encoding::Srgb);
    assert_eq!(wrong, Err(LevelError::Exposure(0.0)));
}
