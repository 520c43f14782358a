//! How the light that a path ends in depends on the water, as the estimate's guess has it.

use glam::DVec3;

use super::Setting;
use super::evaluate::Path;
use super::irradiance::straight;
use crate::estimate::guess::FAINTEST;

/// Part of the lamps' beam that also reaches points outside their cones, as the estimate's guess has it.
const FLOOR: f64 = 0.02;
/// Losses of light, 1/m, about which the guess is expanded.
const MIDDLE_LOSS: f64 = 0.5;

/// What the guess has of the lamps' light at a point, as a function of its losses per metre: its logarithm's first
/// cumulants.
pub(super) struct Light {
    /// The light at the middle loss.
    middle: f64,
    /// Mean length of its ways there, m.
    mean_m: f64,
    /// Variance of the same, m².
    variance: f64,
}

impl Light {
    pub(super) fn new(setting: &Setting, point: DVec3) -> Self {
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for lamp in setting.lamps {
            let (beam, length_m) = straight(setting.view.normal, lamp, point, FLOOR);
            let light = beam * setting.intensity(lamp) * (-MIDDLE_LOSS * length_m).exp();
            sum += light;
            first += light * length_m;
            second += light * length_m * length_m;
        }
        if !(sum > FAINTEST) {
            return Self {
                middle: FAINTEST,
                mean_m: 0.0,
                variance: 0.0,
            };
        }
        let mean_m = first / sum;
        Self {
            middle: sum,
            mean_m,
            variance: (second / sum - mean_m * mean_m).max(0.0),
        }
    }
}

impl Path {
    /// Weights the path with the light `there`, where it ends, over that `here`, in whatever water. Two lamps at about the
    /// same distance leave next to nothing to the third power of the loss.
    pub(super) fn weigh(&mut self, here: &Light, there: &Light) {
        let by_loss = here.mean_m - there.mean_m;
        let by_square = 0.5 * (there.variance - here.variance);
        // Expanded about the middle loss, written in powers of the loss itself.
        self.log_weight += (there.middle / here.middle).ln() - by_loss * MIDDLE_LOSS
            + by_square * MIDDLE_LOSS * MIDDLE_LOSS;
        self.light = [
            (by_loss - 2.0 * by_square * MIDDLE_LOSS) as f32,
            by_square as f32,
        ];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_render::prepare::PreparedLamp;

    use super::super::test_scene::even_target;
    use crate::estimate::guess::{Guess, LampGuess};
    use crate::estimate::target_view::TargetView;

    /// The expansion is the guess itself at any loss that natural waters have, from the middle of the image to anywhere in it.
    #[test]
    fn light_at_the_end_of_a_path_is_the_guess_at_every_loss() {
        let scene = even_target("II", 0.0183, 0.8);
        let view = TargetView::new(&scene).unwrap();
        let lamps: Vec<_> = scene.lamps.iter().map(PreparedLamp::build).collect();
        let setting = Setting::new(&view, &lamps, 1);
        let here = view.sight(640.0, 360.0).unwrap().point;
        for (x, y) in [(0.0, 0.0), (900.0, 300.0), (1280.0, 500.0)] {
            let there = view.sight(x, y).unwrap().point;
            for loss in [0.02, 0.5, 1.9] {
                let guess = LampGuess::new(&scene, view.normal).losing([loss; 3]);
                let guess = Guess::Lamps(guess);
                let exact = guess.at(there)[0] / guess.at(here)[0];
                let mut path = Path {
                    scatterings: 1.0,
                    length_m: 1.0,
                    log_weight: 0.0,
                    light: [0.0; 2],
                };
                path.weigh(&Light::new(&setting, here), &Light::new(&setting, there));
                let [first, second] = path.light.map(f64::from);
                let found = (path.log_weight + loss * (first + second * loss)).exp();
                // The third power of the loss, at 0.8 m, where ways differ most.
                assert!(
                    (found / exact - 1.0).abs() < 3e-3,
                    "{x} {y} {loss}: {found} {exact}"
                );
            }
        }
    }
}
