//! Pictures that were made of stored ones predict what pictures of the water file's camera do.

use std::sync::Arc;

use uw_calib::photo::{Origin, PatchOrigin};
use uw_calib::picture::Counts;
use uw_calib::{Encoding, Even};

use super::super::tests::{
    Noise, at, contrast_of, even_water, exposed, picture, picture_of, reflectance,
};
use super::super::{LinearPicture, Present, Sight, Water, WaterFile};
use crate::features::Candidate;

/// A water file whose sensor hides what is finest in the dark.
fn noisy_water() -> WaterFile {
    let mut file = even_water();
    file.sensor.noise_a = 4e-4;
    file.sensor.noise_b = 1e-5;
    file
}

fn present(file: &WaterFile, counts: &Counts, here: &Candidate) -> Present {
    let water = Arc::new(Water::new(file.clone()));
    Present::new(water, counts, (here, 3.0), contrast_of(counts), &[])
}

/// What a picture from `here` predicts for `there` is what the file's camera sees there, as far as the prediction's error says and within
/// `share` of it; and its contrast at `here` is the one of that camera.
fn tells(file: &WaterFile, counts: &Counts, here: &Candidate, share: f64) {
    let found = present(file, counts, here);
    let own = contrast_of(&picture(file, here, 8));
    for k in 0..3 {
        let off = found.measured()[k] / own[k] - 1.0;
        assert!(off.abs() < 0.05, "{:?} {own:?}", found.measured());
    }
    for there in [at(2.0, 60.0), at(1.5, 0.0), at(1.2, 100.0)] {
        let truth = contrast_of(&picture(file, &there, 8));
        let contrast = found.contrast(&there);
        for k in 0..3 {
            let off = contrast.counts[k] / truth[k] - 1.0;
            let errors = (contrast.counts[k] - truth[k]).abs() / contrast.error_counts[k];
            assert!(
                off.abs() < share && errors < 3.0,
                "{there:?}: {contrast:?} {truth:?}"
            );
        }
    }
    let residual = present(file, &picture(file, &at(2.0, 60.0), 9), &at(2.0, 60.0));
    let residual = residual.residual_at(here, found.measured());
    assert!(residual.expect("told").misfit < 0.5, "{residual:?}");
}

/// A dark place, where most of the contrast is noise, and a brighter one.
fn places() -> [Candidate; 2] {
    [at(2.0, 0.0), at(1.5, 20.0)]
}

#[test]
fn exposures_of_other_lengths() {
    let file = noisy_water();
    for (here, share) in places().into_iter().zip([0.4, 0.3]) {
        for over in [0.25, 1.0, 3.0] {
            let mut counts = exposed(&file, &here, (3, over), &reflectance);
            if over != 1.0 {
                Even::of_exposure(over, Encoding::Srgb).apply(&mut counts);
            }
            tells(&file, &counts, &here, share);
        }
    }
}

fn without_noise(file: &WaterFile) -> WaterFile {
    let mut ideal = file.clone();
    ideal.sensor.noise_a = 0.0;
    ideal.sensor.noise_b = 0.0;
    ideal
}

/// A picture without noise, and what the camera's noise makes of a pixel of it: `noise` times its deviation.
fn with_noise(file: &WaterFile, here: &Candidate, noise: impl Fn(usize) -> f64) -> Counts {
    let mut counts = picture(&without_noise(file), here, 3);
    for (i, pixel) in counts.pixels.iter_mut().enumerate() {
        let light = Encoding::Srgb.light(pixel[0]);
        let deviation = file.sensor.noise().standard_deviation(light);
        *pixel = [Encoding::Srgb.counts(light + deviation * noise(i)); 3];
    }
    counts
}

#[test]
fn means_of_frames() {
    let file = noisy_water();
    for (here, share) in places().into_iter().zip([0.2, 0.1]) {
        let mut noise = Noise(11);
        let mut mean = || (0..9).map(|_| noise.next()).sum::<f64>() / 9.0;
        let means: Vec<f64> = (0..1 << 20).map(|_| mean()).collect();
        let mut counts = with_noise(&file, &here, |i| means[i]);
        counts.origin = Some(Origin::alike(PatchOrigin {
            left: 1.0 / 9.0,
            pixels: 9.0,
            ..PatchOrigin::STORED
        }));
        tells(&file, &counts, &here, share);
    }
}

/// Resampling makes neighbours alike: the means over many pixels keep their noise.
#[test]
fn smoothed_noise() {
    let file = noisy_water();
    for (here, share) in places().into_iter().zip([0.2, 0.1]) {
        let mut noise = Noise(12);
        let single: Vec<f64> = (0..1 << 20).map(|_| noise.next()).collect();
        let width = file.sensor.width_px;
        let smooth = |i: usize| {
            let around = [i, i + 1, i + width, i + width + 1];
            around.iter().map(|&j| single[j]).sum::<f64>() / 4.0
        };
        let mut counts = with_noise(&file, &here, smooth);
        counts.origin = Some(Origin::alike(PatchOrigin {
            left: 0.25,
            ..PatchOrigin::STORED
        }));
        tells(&file, &counts, &here, share);
    }
}

/// Noise that was cut off at black makes a mean too bright: of a short exposure more than of the water file's own.
#[test]
fn means_of_short_exposures_near_black() {
    let mut file = even_water();
    file.sensor.noise_b = 1e-3;
    let earlier = present(&file, &picture(&file, &at(1.0, 0.0), 3), &at(1.0, 0.0));
    let here = at(2.0, 0.0);
    let errors = [1.0, 0.25].map(|over| {
        let mut counts = exposed(&file, &here, (5, over), &reflectance);
        Even::of_exposure(over, Encoding::Srgb).apply(&mut counts);
        let found = earlier.brightness_at(&present(&file, &counts, &here));
        found.expect("a comparison").error_counts[1]
    });
    assert!(errors[1] > errors[0] + 0.5, "{errors:?}");
}

/// Of an even target such noise is no detail of any size.
#[test]
fn smoothed_noise_alone() {
    let file = noisy_water();
    let here = at(1.5, 20.0);
    let mut noise = Noise(13);
    let single: Vec<f64> = (0..1 << 20).map(|_| noise.next()).collect();
    let width = file.sensor.width_px;
    let mut counts = with_noise(&file, &here, |i| {
        let around = [i, i + 1, i + width, i + width + 1];
        around.iter().map(|&j| single[j]).sum::<f64>() / 4.0
    });
    let ideal = picture_of(&without_noise(&file), &here, 3, &reflectance);
    let even = picture_of(&without_noise(&file), &here, 3, &|_, _| 0.3);
    let pairs = counts.pixels.iter_mut().zip(&ideal.pixels);
    for ((pixel, ideal), even) in pairs.zip(&even.pixels) {
        *pixel = [0, 1, 2].map(|k| pixel[k] - ideal[k] + even[k]);
    }
    counts.origin = Some(Origin::alike(PatchOrigin {
        left: 0.25,
        ..PatchOrigin::STORED
    }));
    let linear = LinearPicture::of_counts(&counts, Encoding::Srgb);
    let response = file.sensor.response();
    let sight = Sight::new(&file.place(&response, 3.0), &linear, &here);
    let detail = sight.channel(1);
    for (variance, doubt) in detail.variance.iter().zip(&detail.doubt) {
        assert!(
            variance.abs() < 4.0 * doubt,
            "{variance} {doubt} {detail:?}"
        );
    }
}
