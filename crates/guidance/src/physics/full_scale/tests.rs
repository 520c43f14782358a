use super::super::tests::{at, contrast_of, even_water, picture_of, reflectance};
use super::super::{LinearPicture, Predictor};
use super::*;

const WIDTH: usize = 200;
const HEIGHT: usize = 120;

/// Values cut off at 1, and which are.
fn cut(values: &[f64]) -> (Vec<f64>, Vec<bool>) {
    let at_full = values.iter().map(|&value| value >= 1.0).collect();
    (values.iter().map(|value| value.min(1.0)).collect(), at_full)
}

fn restored(values: &[f64]) -> Vec<f64> {
    let (mut values, at_full) = cut(values);
    let mut cut_off = CutOff {
        width: WIDTH,
        height: HEIGHT,
        values: &mut values,
        at_full: &at_full,
    };
    cut_off.restore();
    values
}

fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Numbers evenly in (0, 1), the same in each patch of 20 × 20 pixels.
fn rank(i: usize) -> f64 {
    let (x, y) = (i % WIDTH % 20, i / WIDTH % 20);
    (((y * 20 + x) * 157 % 400) as f64 + 0.5) / 400.0
}

#[test]
fn values_that_grow_rarer_as_an_exponential_does_are_what_they_were() {
    // 5 % are cut off in the upper half, 15 % in the lower.
    let value = |i: usize| match i < WIDTH * HEIGHT / 2 {
        true => -rank(i).ln() / 3.0,
        false => -rank(i).ln() / 1.9,
    };
    let values: Vec<f64> = (0..WIDTH * HEIGHT).map(value).collect();
    let found = restored(&values);
    for half in [0..WIDTH * HEIGHT / 2, WIDTH * HEIGHT / 2..WIDTH * HEIGHT] {
        let truth = deviation(&values[half.clone()]);
        let (cut, _) = cut(&values[half.clone()]);
        let off = deviation(&found[half]) / truth - 1.0;
        assert!(off.abs() < 0.03, "{off}");
        assert!(deviation(&cut) / truth < 0.85);
    }
    for (found, value) in found.iter().zip(&values) {
        assert!(*value >= 1.0 || found == value);
    }
}

#[test]
fn the_middle_of_a_bright_spot_is_brighter_than_its_rim() {
    let value = |i: usize| {
        let (x, y) = (i % WIDTH % 20, i / WIDTH % 20);
        let square = (x as f64 - 9.5).powi(2) + (y as f64 - 9.5).powi(2);
        1.6 * (-square / 30.0).exp()
    };
    let values: Vec<f64> = (0..WIDTH * HEIGHT).map(value).collect();
    let found = restored(&values);
    let at = |x: usize| found[49 * WIDTH + 60 + x];
    assert!(at(9) > at(7) && at(7) > 1.0, "{} {}", at(9), at(7));
}

/// A patch that is white nearly everywhere goes on as the others do; where no patch tells, all stays.
#[test]
fn white_patches_go_on_as_others_do() {
    let value = |i: usize| match i % WIDTH < 20 {
        true => 2.0 + 0.001 * rank(i),
        false => -rank(i).ln() / 3.0,
    };
    let mut values: Vec<f64> = (0..WIDTH * HEIGHT).map(value).collect();
    let found = restored(&values);
    let white: Vec<f64> = (0..HEIGHT)
        .flat_map(|y| found[y * WIDTH..y * WIDTH + 20].to_vec())
        .collect();
    let mean = white.iter().sum::<f64>() / white.len() as f64;
    assert!((mean - 1.0 - 1.0 / 3.0).abs() < 0.03, "{mean}");
    values.fill(2.0);
    assert!(restored(&values).iter().all(|&value| value == 1.0));
}

/// A picture of which lamps bring a twentieth to full scale tells what is there without them.
#[test]
fn pictures_with_bright_spots_predict_darker_ones() {
    let file = even_water();
    let bright = |x: f64, y: f64| 0.22 * (22.0 * (reflectance(x, y) - 0.3)).exp();
    let [here, there] = [at(1.0, 100.0), at(1.0, 0.0)];
    let [shown, truth] = [here, there].map(|place| picture_of(&file, &place, 5, &bright));
    let clipped = shown.pixels.iter().filter(|p| p[1] >= 254.9).count();
    let share = clipped as f64 / shown.pixels.len() as f64;
    assert!((0.03..0.08).contains(&share), "{share}");
    let linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    let response = file.sensor.response();
    let place = file.place(&response, 3.0);
    let predictor = Predictor::new(place, &linear, (&here, contrast_of(&shown)), &[]);
    assert_eq!(predictor.unknown(), [None; 3]);
    let (found, truth) = (predictor.contrast(&there), contrast_of(&truth));
    for k in 0..3 {
        let off = found.counts[k] / truth[k] - 1.0;
        assert!(off.abs() < 0.03, "{found:?} {truth:?}");
        let error = found.error_counts[k] / truth[k];
        assert!(error > 0.2 * share.sqrt(), "{error} {share}");
        assert!(
            off.abs() < 2.0 * error && error < 0.12,
            "{found:?} {truth:?}"
        );
    }
}
