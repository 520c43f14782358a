//! Walks from the camera to the target that scatter on their way: share and spread of the sight of it.

use std::f64::consts::TAU;

use glam::DVec3;
use uw_media::phase::PhaseTable;

use super::Setting;
use super::evaluate::{Group, Path};
use super::flights::{self, Flight};
use super::light::Light;
use crate::estimate::numbers::{self, Numbers};
use crate::estimate::target_view::Sight;

/// Sets these walks' random numbers apart.
const PURPOSE: u32 = 2;
/// Powers of 1/cos - 1 that the share is a polynomial of, as in [`crate::estimate::spread`].
pub(super) const SHARE_TERMS: usize = 3;

/// Walks of `group`, weighted with the lamps' light where they end, and the same in even light; `frequencies` in cycles per metre.
pub(super) fn walks(
    setting: &Setting,
    phase: &PhaseTable,
    frequencies: &[f64],
    group: u32,
    points: u32,
) -> [Group; 2] {
    let [mut lit, mut even] = [0; 2].map(|_| Group::new(SHARE_TERMS));
    let mut unused = vec![0.0; setting.basis.len()];
    for mut numbers in numbers::of_paths(setting.seed, group, PURPOSE, points) {
        let Some(sight) = setting.sight(&mut numbers, &mut unused) else {
            continue;
        };
        let m = 1.0 / setting.view.incidence(sight.direction) - 1.0;
        let powers = [1.0, m, m * m];
        lit.point(&powers);
        even.point(&powers);
        let Some((end, mut path)) = walk(setting, phase, &sight, &mut numbers) else {
            continue;
        };
        let (dx, dy) = setting.view.offset(sight.point, end);
        let wave = |f: &f64| 0.5 * ((TAU * f * dx).cos() + (TAU * f * dy).cos());
        let functions = || powers.into_iter().chain(frequencies.iter().map(wave));
        even.add(path, functions());
        path.weigh(&Light::new(setting, sight.point), &Light::new(setting, end));
        lit.add(path, functions());
    }
    [lit, even]
}

/// A walk that scatters at least once: where it meets the target.
fn walk(
    setting: &Setting,
    phase: &PhaseTable,
    sight: &Sight,
    numbers: &mut Numbers,
) -> Option<(DVec3, Path)> {
    let rate = flights::rate(numbers.next());
    let forced = |rate: f64| -(-rate * sight.range_m).exp_m1();
    let first = -(-numbers.next() * forced(rate)).ln_1p() / rate;
    let start = Flight {
        origin: setting.view.camera.position_m + first * sight.direction,
        direction: sight.direction,
        length_m: first,
    };
    let longest_m = flights::MOST_STRETCH * sight.range_m;
    flights::to_target(setting, phase, (start, rate), longest_m, numbers, |rate| {
        1.0 / forced(rate)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::Iops;
    use uw_media::phase::{FournierForand, Phase};
    use uw_render::prepare::PreparedLamp;
    use uw_render::scene::{Variation, Water};

    use super::super::test_scene::even_target;
    use crate::estimate::every_water::{EveryWater, ScatteredSight, Values};
    use crate::estimate::guess::{Guess, LampGuess};
    use crate::estimate::target_view::TargetView;
    use crate::estimate::walks::{Sums, Walker};

    /// Cycles per metre.
    const FREQUENCIES: [f64; 4] = [0.5, 2.0, 8.0, 32.0];
    /// Groups of the estimate's walks, 2048 each.
    const TRUE_GROUPS: u32 = 64;
    /// Angles at which shares are compared: the middle, the right edge, and near a corner; 1/cos - 1.
    const PLACES: [f64; 3] = [0.0, 0.15, 0.18];
    /// Bound of |z| for the 336 comparisons below at 1 % altogether (Šidák), of Student's t with 23 degrees of freedom: the
    /// standard errors come from 24 groups and 64.
    const MOST_Z: f64 = 5.1;
    /// What the polynomial and the expansion of the guess may leave.
    const MARGIN: f64 = 0.005;

    fn mean_and_error(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        (mean, (spread / (n * (n - 1.0))).sqrt())
    }

    /// Share of scattered rays and their spread are those of the walks made for each water.
    #[test]
    fn share_and_transfer_are_those_of_walks_in_each_water() {
        let waters = [
            ("I", 0.0183, 1.6),
            ("II", 0.05, 0.8),
            ("III", 0.0183, 4.0),
            ("1C", 0.005, 1.6),
            ("5C", 0.0183, 1.6),
            ("9C", 0.05, 0.8),
            ("9C", 0.005, 1.6),
            ("5C", 0.05, 4.0),
        ];
        for (jerlov, fraction, distance_m) in waters {
            let scene = even_target(jerlov, fraction, distance_m);
            let view = TargetView::new(&scene).unwrap();
            let phase = Phase::FournierForand(FournierForand::new(1.10, fraction).unwrap());
            let table = PhaseTable::new(&phase);
            let lamps: Vec<_> = scene.lamps.iter().map(PreparedLamp::build).collect();
            let sets: Vec<EveryWater> = (0..3)
                .map(|seed| {
                    EveryWater::with_frequencies(&view, &lamps, &table, &FREQUENCIES, 16384, seed)
                })
                .collect::<Result<_, _>>()
                .unwrap();
            let guess = Guess::Lamps(LampGuess::new(&scene, view.normal));
            let Iops { a, b } = scene.water.as_ref().unwrap().iops;
            let water = Water {
                iops: Iops { a, b },
                phase,
                refractive_index: 1.34,
                variation: Variation::default(),
            };
            type SightOf = fn(&Values) -> &ScatteredSight;
            let lights: [(&str, &Guess, SightOf); 2] = [
                ("lamps", &guess, |values| &values.sight),
                ("even light", &Guess::Even, |values| &values.even_sight),
            ];
            for (k, (light, guess, sight)) in (0..3).flat_map(|k| lights.map(|light| (k, light))) {
                let walker = Walker::new(&water, &table, &view, guess, None, k);
                let groups = 0..TRUE_GROUPS;
                let truths: Vec<Sums> = groups.map(|g| walker.walks(&FREQUENCIES, 9, g)).collect();
                let own: Vec<_> = sets.iter().flat_map(|s| s.by_group(a[k], b[k])).collect();
                let compare = |what: String, own: Vec<f64>, truth: Vec<f64>| {
                    let ((own, own_error), (truth, error)) =
                        (mean_and_error(&own), mean_and_error(&truth));
                    let beyond = ((own - truth).abs() - MARGIN * truth.abs()).max(0.0);
                    let z = beyond / own_error.hypot(error);
                    assert!(
                        z < MOST_Z,
                        "{jerlov} B {fraction} {distance_m} m {light} channel {k} {what}: {own} ± {own_error}, \
                         {truth} ± {error}: z {z:.1}"
                    );
                };
                for m in PLACES {
                    let polynomial = |[x, y, z]: [f64; 3]| x + m * (y + m * z);
                    let own = own
                        .iter()
                        .map(|v| polynomial(sight(v).share.map(|s| s.value)));
                    let truth = truths.iter().map(|t| polynomial(t.share()));
                    compare(format!("share at {m}"), own.collect(), truth.collect());
                }
                for (i, f) in FREQUENCIES.iter().enumerate() {
                    let own = own.iter().map(|v| sight(v).transfer[i].value);
                    let truth = truths.iter().map(|t| t.transfer()[i]);
                    compare(format!("transfer at {f}"), own.collect(), truth.collect());
                }
            }
        }
    }
}
