//! What is kept of earlier pictures.

use std::sync::Arc;

use super::super::tests::{at, contrast_of, even_water, picture};
use super::super::{Earlier, Present, Water};
use uw_calib::picture::Counts;

fn present(distance_m: f64, change: &dyn Fn(&mut Counts)) -> Present {
    let (file, here) = (even_water(), at(distance_m, 20.0));
    let mut counts = picture(&file, &here, 3);
    change(&mut counts);
    let measured = contrast_of(&counts);
    let water = Arc::new(Water::new(file));
    Present::new(water, &counts, (&here, 3.0), measured, &[])
}

fn distances_m(earlier: &Earlier, now_s: f64) -> Vec<f64> {
    let sights = earlier.sights(now_s);
    sights.iter().map(|sight| sight.distance_m).collect()
}

#[test]
fn the_newest_picture_of_a_distance_counts_for_ten_minutes() {
    let mut earlier = Earlier::default();
    let [far, near, nearer] = [2.0, 1.0, 0.9].map(|distance_m| present(distance_m, &|_| {}));
    earlier.keep(&far, 0.0);
    earlier.keep(&near, 100.0);
    assert_eq!(distances_m(&earlier, 100.0), [2.0, 1.0]);
    earlier.keep(&nearer, 200.0);
    assert_eq!(distances_m(&earlier, 200.0), [2.0, 0.9]);
    // One that comes late does not take the place of a newer one.
    earlier.keep(&near, 150.0);
    assert_eq!(distances_m(&earlier, 200.0), [2.0, 0.9]);
    assert_eq!(distances_m(&earlier, 700.0), [0.9]);
    // A white picture does not take the place of one that shows something.
    let white = present(0.9, &|counts| counts.pixels.fill([255.0; 3]));
    earlier.keep(&white, 250.0);
    assert_eq!(distances_m(&earlier, 250.0), [2.0, 0.9]);
    assert!(distances_m(&earlier, 801.0).is_empty());
}

/// What no target can show in this light was taken from elsewhere than was said.
#[test]
fn a_picture_of_another_light_is_not_kept() {
    let kept = |mean: f64| {
        let mut earlier = Earlier::default();
        let moved = |counts: &mut Counts| {
            let sum: f64 = counts.pixels.iter().map(|pixel| pixel[0]).sum();
            let by = mean - sum / counts.pixels.len() as f64;
            for pixel in &mut counts.pixels {
                *pixel = pixel.map(|count| (count + by).min(253.0));
            }
        };
        earlier.keep(&present(1.0, &moved), 0.0);
        distances_m(&earlier, 0.0).len()
    };
    assert_eq!([140.0, 225.0].map(kept), [1, 0]);
}
