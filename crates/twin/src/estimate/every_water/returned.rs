//! Light that the target sends out and the water scatters back onto it.
//!
//! What comes back to a point comes from places that the lamps light less, the farther away the more so: walks backwards from
//! the point are weighted with the light where they end, as the guess has it, over that at the point.

use uw_media::phase::PhaseTable;
use uw_render::sampling::directions::cosine_hemisphere;

use super::Setting;
use super::evaluate::Group;
use super::flights::{self, Flight};
use super::light::Light;
use crate::estimate::numbers;

/// Sets these walks' random numbers apart.
const PURPOSE: u32 = 3;

/// Walks of `group` from the target back to it.
pub(super) fn walks(setting: &Setting, phase: &PhaseTable, group: u32, points: u32) -> Group {
    let mut paths = Group::new(1);
    let mut unused = vec![0.0; setting.basis.len()];
    for mut numbers in numbers::of_paths(setting.seed, group, PURPOSE, points) {
        let Some(sight) = setting.sight(&mut numbers, &mut unused) else {
            continue;
        };
        paths.point(&[1.0]);
        let direction = cosine_hemisphere(setting.view.normal, numbers.next(), numbers.next());
        let rate = flights::rate(numbers.next());
        let length_m = numbers.length() / rate;
        let start = Flight {
            origin: sight.point + length_m * direction,
            direction,
            length_m,
        };
        let longest_m = flights::MOST_STRETCH * sight.range_m;
        let onward = flights::to_target(
            setting,
            phase,
            (start, rate),
            longest_m,
            &mut numbers,
            |_| 1.0,
        );
        if let Some((end, mut path)) = onward {
            path.weigh(&Light::new(setting, sight.point), &Light::new(setting, end));
            paths.add(path, [1.0].into_iter());
        }
    }
    paths
}
