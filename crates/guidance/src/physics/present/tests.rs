//! Pictures made ready: what a search sees of them, and what they say of later ones.

use std::sync::Arc;

use super::super::tests::{at, contrast_of, even_water, picture, picture_of, reflectance};
use super::super::{LinearPicture, Present, ResidualFrom, Sight, Unknown, Water, WaterFile};
use crate::features::Candidate;

fn present(water: &Arc<Water>, here: &Candidate, seed: u64) -> Present {
    let counts = picture(&even_water(), here, seed);
    let measured = contrast_of(&counts);
    Present::new(Arc::clone(water), &counts, (here, 3.0), measured, &[])
}

/// A search looks at cubics between nodes: to a hundredth of a count, but where pixels reach full scale and contrast falls to nothing
/// within a few centimetres.
#[test]
fn the_sheet_is_what_predictions_say() {
    let mut file = even_water();
    let response = file.sensor.response();
    let seen = at(3.0, 0.0);
    let far = LinearPicture::of_counts(&picture(&file, &seen, 9), file.sensor.encoding);
    file.sights = vec![Sight::new(&file.place(&response, 3.0), &far, &seen)];
    let water = Arc::new(Water::new(file));
    let present = present(&water, &at(1.3, 30.0), 3);
    let (mut worst, mut clipped) = (0.0_f64, 0.0_f64);
    for i in 0..=60 {
        for light_pct in [0.0, 0.4, 1.0, 3.0, 10.0, 47.0, 88.0, 100.0] {
            let there = at(0.5 * 8f64.powf(f64::from(i) / 60.0), light_pct);
            let (quick, exact) = (present.quick_contrast(&there), present.contrast(&there));
            for k in 0..3 {
                let off = (quick[k] - exact.counts[k]).abs();
                match there.distance_m > 1.1 {
                    true => worst = worst.max(off),
                    false => clipped = clipped.max(off),
                }
            }
        }
    }
    assert!(worst < 0.015 && clipped < 0.4, "{worst} {clipped}");
}

/// An earlier picture predicts this one where water and lamps are the file's, and does not where the lamps are five times as bright.
#[test]
fn earlier_pictures_tell_whether_the_light_is_that_of_the_file() {
    let (here, before) = (at(1.0, 100.0), at(1.0, 0.0));
    let measured = contrast_of(&picture(&even_water(), &here, 8));
    let of = |file: WaterFile| present(&Arc::new(Water::new(file)), &before, 5);
    let right = of(even_water()).residual_at(&here, measured);
    let right = right.expect("a residual");
    assert!(right.misfit < 0.2, "{right:?}");
    assert_eq!(right.from, ResidualFrom::Picture);
    let mut dim = even_water();
    for view in &mut dim.tables.views {
        view.lamps
            .light
            .iter_mut()
            .flatten()
            .for_each(|light| *light *= 0.2);
    }
    let wrong = of(dim).residual_at(&here, measured);
    assert!(wrong.expect("a residual").misfit > 1.3, "{wrong:?}");
}

/// Sights of the same target predict its picture; the file without any predicts nothing.
#[test]
fn sights_predict_a_picture_of_their_target_alone() {
    let mut file = even_water();
    let here = at(1.0, 20.0);
    let none = present(&Arc::new(Water::new(file.clone())), &here, 8);
    assert_eq!(none.residual_of_sights(), None);
    let response = file.sensor.response();
    let sights = [0.7, 1.6].map(|distance_m| {
        let seen = at(distance_m, 0.0);
        let shown = LinearPicture::of_counts(&picture(&file, &seen, 9), file.sensor.encoding);
        Sight::new(&file.place(&response, 3.0), &shown, &seen)
    });
    file.sights = sights.to_vec();
    let residual = present(&Arc::new(Water::new(file)), &here, 8).residual_of_sights();
    let residual = residual.expect("a residual");
    assert!(residual.misfit < 0.2, "{residual:?}");
    assert_eq!(residual.from, ResidualFrom::Sights);
}

/// Channels that the picture does not tell have its contrast everywhere, and others their own.
#[test]
fn a_clipped_channel_prefers_no_place() {
    let file = even_water();
    let here = at(1.0, 20.0);
    let mut counts = picture(&file, &here, 3);
    for pixel in counts.pixels.iter_mut().step_by(8) {
        pixel[0] = 255.0;
    }
    let measured = contrast_of(&counts);
    let water = Arc::new(Water::new(file));
    let present = Present::new(water, &counts, (&here, 3.0), measured, &[]);
    assert_eq!(present.unknown(), [Some(Unknown::Clipped), None, None]);
    for there in [here, at(2.0, 0.0)] {
        assert_eq!(present.contrast(&there).counts[0], measured[0]);
        assert_eq!(present.quick_contrast(&there)[0], measured[0]);
    }
    assert!(present.contrast(&at(2.0, 0.0)).counts[1] < 0.8 * measured[1]);
}

/// What was seen from a place earlier comes back as it was, whatever the water: the check of a picture asks the ones from elsewhere alone.
#[test]
fn a_residual_does_not_ask_what_was_seen_from_there() {
    let mut clearer = even_water();
    for view in &mut clearer.tables.views {
        let more = (0.1 * view.distance_m).exp();
        for source in [&mut view.lamps, &mut view.daylight[0]] {
            let straight = source.straight.iter_mut().flatten();
            straight.for_each(|share| *share *= more);
        }
    }
    let water = Arc::new(Water::new(clearer));
    let target = |x: f64, y: f64| 0.4 + 5.0 * (reflectance(x, y) - 0.3);
    let taken = |from: &Candidate, earlier: &[Sight]| {
        let counts = picture_of(&even_water(), from, 5, &target);
        let measured = contrast_of(&counts);
        Present::new(Arc::clone(&water), &counts, (from, 3.0), measured, earlier)
    };
    let (near, far) = (at(1.0, 0.0), at(3.0, 0.0));
    let seen = taken(&far, &[]);
    let truth = seen.measured();
    let alone = taken(&near, &[]);
    let knowing = taken(&near, &[seen.sight().clone()]);
    let [told, untold] = [&knowing, &alone].map(|p| p.residual_at(&far, truth).expect("one"));
    for (told, untold) in told.counts.iter().zip(untold.counts) {
        let apart = told.expect("one") - untold.expect("one");
        assert!(apart.abs() < 1e-3, "{apart}");
    }
    let off = |p: &Present| (p.contrast(&far).counts[1] / truth[1] - 1.0).abs();
    let [told, untold] = [&knowing, &alone].map(off);
    assert!(told < 0.5 * untold, "{told} {untold}");
}
