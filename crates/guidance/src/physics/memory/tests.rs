//! Predictions beside what was seen before.

use uw_calib::picture::Counts;

use super::super::tests::{at, contrast_of, even_water, picture, picture_of, reflectance};
use super::super::{Contrast, LinearPicture, Predictor, Sight, Unknown, WaterFile};
use super::Memory;
use crate::features::Candidate;

/// Sights speak for a channel of which the picture tells nothing where the others show the same target, and for no other target.
#[test]
fn sights_speak_for_a_clipped_channel_of_their_own_target_alone() {
    let mut file = even_water();
    let response = file.sensor.response();
    let here = at(1.0, 20.0);
    let shown = LinearPicture::of_counts(&picture(&file, &here, 9), file.sensor.encoding);
    file.sights = vec![Sight::new(&file.place(&response, 3.0), &shown, &here)];
    let mut counts = picture(&file, &here, 3);
    for pixel in counts.pixels.iter_mut().step_by(8) {
        pixel[0] = 255.0;
    }
    let unknown = |counts: &Counts| {
        let linear = LinearPicture::of_counts(counts, file.sensor.encoding);
        let now = (&here, contrast_of(counts));
        let place = file.place(&response, 3.0);
        Predictor::new(place, &linear, now, &file.sights).unknown()
    };
    assert_eq!(unknown(&counts), [None; 3]);
    // Three times the contrast: another target.
    let mean = counts.pixels.iter().map(|p| p[1]).sum::<f64>() / counts.pixels.len() as f64;
    let mut other = counts.clone();
    for pixel in &mut other.pixels {
        for count in &mut pixel[1..] {
            *count = mean + 3.0 * (*count - mean);
        }
    }
    assert_eq!(unknown(&other), [Some(Unknown::Clipped), None, None]);
    // Nothing that tells which target it is.
    for pixel in counts.pixels.iter_mut().step_by(8) {
        *pixel = [255.0; 3];
    }
    assert_eq!(unknown(&counts), [Some(Unknown::Clipped); 3]);
}

/// A target that is nearly even in the middle and has detail around it.
fn bare_in_the_middle(x: f64, y: f64) -> f64 {
    let strength = if x.hypot(y) < 0.6 { 1.0 } else { 4.0 };
    0.4 + strength * (reflectance(x, y) - 0.3)
}

fn sight(file: &WaterFile, from: &Candidate, target: &dyn Fn(f64, f64) -> f64) -> Sight {
    let shown = picture_of(file, from, 9, target);
    let linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    Sight::new(&file.place(&file.sensor.response(), 3.0), &linear, from)
}

/// What a picture from 1 m of the same target predicts there, `earlier` being remembered.
fn predicted(file: &WaterFile, there: &Candidate, earlier: &[Sight]) -> Contrast {
    let here = at(1.0, 0.0);
    let shown = picture_of(file, &here, 3, &bare_in_the_middle);
    let linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    let (response, now) = (file.sensor.response(), (&here, contrast_of(&shown)));
    let place = file.place(&response, 3.0);
    Predictor::on_the_way(place, &linear, now, [earlier, &[]]).contrast(there)
}

/// A vehicle that has come from afar knows the surroundings, which its picture from nearby does not show.
#[test]
fn what_was_seen_on_the_way_is_known() {
    let file = even_water();
    let there = at(2.5, 0.0);
    let truth = contrast_of(&picture_of(&file, &there, 8, &bare_in_the_middle));
    let alone = predicted(&file, &there, &[]);
    let seen = sight(&file, &at(3.0, 0.0), &bare_in_the_middle);
    let knowing = predicted(&file, &there, &[seen]);
    for k in 0..3 {
        let off = |found: &Contrast| (found.counts[k] / truth[k] - 1.0).abs();
        assert!(off(&alone) > 0.4, "{alone:?} {truth:?}");
        assert!(off(&knowing) < 0.1, "{knowing:?} {truth:?}");
        let errors = (knowing.counts[k] - truth[k]).abs() / knowing.error_counts[k];
        assert!(errors < 2.0, "{knowing:?} {truth:?}");
    }
}

/// Pictures from about the same place are off by much the same: that there are two makes little surer, independent ones would take three tenths off the error.
#[test]
fn a_second_picture_from_here_makes_predictions_little_surer() {
    let file = even_water();
    let there = at(2.5, 0.0);
    let again = sight(&file, &at(1.1, 0.0), &bare_in_the_middle);
    let (alone, twice) = (
        predicted(&file, &there, &[]),
        predicted(&file, &there, &[again]),
    );
    for k in 0..3 {
        let share = |found: &Contrast| found.error_counts[k] / found.counts[k];
        assert!(share(&twice) > 0.9 * share(&alone), "{alone:?} {twice:?}");
    }
}

/// Another target, seen a while ago, counts little beside the picture.
#[test]
fn another_target_seen_before_is_told_from_this_one() {
    let file = even_water();
    let there = at(2.5, 0.0);
    let other = |x: f64, y: f64| 0.5 + 0.3 * (20.0 * x).sin() * (20.0 * y).cos();
    let seen = sight(&file, &at(3.0, 0.0), &other);
    let (alone, misled) = (
        predicted(&file, &there, &[]),
        predicted(&file, &there, &[seen]),
    );
    for k in 0..3 {
        let off = (misled.counts[k] - alone.counts[k]).abs();
        assert!(off < 0.5 * alone.error_counts[k], "{alone:?} {misled:?}");
        assert!(
            misled.error_counts[k] > 0.8 * alone.error_counts[k],
            "{alone:?} {misled:?}"
        );
    }
}

/// The nearer of two sights does not show the surroundings, which the farther one does: what lies between them is as the farther one says.
#[test]
fn of_two_sights_the_surer_one_counts_more() {
    let file = even_water();
    let there = at(1.8, 0.0);
    let truth = contrast_of(&picture_of(&file, &there, 8, &bare_in_the_middle));
    let sights = [1.2, 3.0].map(|from_m| sight(&file, &at(from_m, 0.0), &bare_in_the_middle));
    let found = predicted(&file, &there, &sights);
    for k in 0..3 {
        let off = found.counts[k] / truth[k] - 1.0;
        assert!(off.abs() < 0.1, "{found:?} {truth:?}");
    }
}

/// What noise hides of the middle of a far picture is no difference of the target.
#[test]
fn what_a_sight_does_not_tell_of_this_place_is_no_difference() {
    let file = even_water();
    let here = sight(&file, &at(1.0, 0.0), &bare_in_the_middle);
    let far = sight(&file, &at(4.0, 0.0), &bare_in_the_middle);
    let memory = Memory::new([far].into(), &here);
    for k in 0..3 {
        let [seen, known] = [
            here.look(k, 1.0, &|_| 1.0).deviation,
            memory.look(k, 1.0, &|_| 1.0).expect("a look").deviation,
        ];
        let (off, told) = (
            (seen / known).ln(),
            memory.compared(k).expect("one").deviation.ln(),
        );
        assert!(off.abs() > 0.03 && told / off < 0.9, "{off} {told}");
    }
}

/// A sight of which the veil leaves less than nothing is not compared, and a picture that shows its target itself is believed.
#[test]
fn what_cannot_be_compared_takes_no_pictures_place() {
    let file = even_water();
    let (from, there) = (at(3.0, 0.0), at(2.5, 0.0));
    let shown = picture_of(&file, &from, 9, &bare_in_the_middle);
    let mut linear = LinearPicture::of_counts(&shown, file.sensor.encoding);
    let lit = 0.5 * (-0.4 * from.distance_m).exp() * 0.45;
    for signal in linear.signal.iter_mut().flatten() {
        *signal -= lit as f32;
    }
    let seen = Sight::new(&file.place(&file.sensor.response(), 3.0), &linear, &from);
    assert!((0..3).all(|k| seen.channel(k).mean < 0.0 && seen.tells(k)));
    assert_eq!(
        predicted(&file, &there, &[seen]),
        predicted(&file, &there, &[])
    );
}
