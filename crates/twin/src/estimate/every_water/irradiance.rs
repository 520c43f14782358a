//! Paths from the target to the lamps: its irradiance over π.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;

use super::bridge::{Bridge, Place, quarter_turns};
use super::evaluate::{Derived, Group, Path};
use super::orders::Orders;
use super::{Setting, mean};
use crate::estimate::numbers;
use crate::estimate::target_view::TargetView;

/// Sets these paths' random numbers apart.
const PURPOSE: u32 = 1;
/// Columns and rows of the image at whose middles unscattered light is taken for its mean.
const GRID: (usize, usize) = (40, 24);

/// Paths of `group` that scatter.
pub(super) fn scattered(setting: &Setting, phase: &PhaseTable, group: u32, points: u32) -> Group {
    let mut paths = Group::new(setting.basis.len());
    let mut phi = vec![0.0; setting.basis.len()];
    let mut bridge = Bridge::default();
    for mut numbers in numbers::of_paths(setting.seed, group, PURPOSE, points) {
        let Some(sight) = setting.sight(&mut numbers, &mut phi) else {
            continue;
        };
        paths.point(&phi);
        let (lamp, end) = setting.lamp_point(numbers.next(), &mut numbers);
        let place = Place::new(sight.point, end);
        let orders = Orders::new(1, place.distance_m());
        let Some(order) = orders.draw(numbers.next(), numbers.next()) else {
            continue;
        };
        let roll = numbers.next();
        if !bridge.draw(order, phase, &mut numbers) {
            continue;
        }
        let lit = arriving(setting.view, lamp, &bridge, &place, roll);
        let (distance_m, length_m) = (place.distance_m(), place.distance_m() * bridge.stretch());
        let others = setting.lamps.len() as f64 / PI;
        let density = orders.density(order, length_m) * distance_m.powi(3) / length_m;
        let path = Path {
            scatterings: order as f32,
            length_m,
            log_weight: (others * setting.intensity(lamp) * lit / density).ln(),
            light: [0.0; 2],
        };
        paths.add(path, phi.iter().copied());
    }
    paths
}

/// Beam of the lamp times cosine at the target, the mean of four rolls; those that meet the target bring nothing.
fn arriving(
    view: &TargetView,
    lamp: &PreparedLamp,
    bridge: &Bridge,
    place: &Place,
    roll: f64,
) -> f64 {
    let of_roll = |roll: (f64, f64)| {
        let cosine = view.normal.dot(bridge.start_direction(place, roll));
        if !(cosine > 0.0) {
            return 0.0;
        }
        let beam = lamp.relative_intensity(-bridge.end_direction(place, roll));
        if !(beam > 0.0) {
            return 0.0;
        }
        let free = bridge
            .interior(place, roll)
            .all(|x| view.range_m(x, -view.normal).is_some());
        if free { beam * cosine } else { 0.0 }
    };
    quarter_turns(roll).map(of_roll).iter().sum::<f64>() / 4.0
}

/// Light of the lamps that reaches the target without scattering, in closed form: irradiance over π, W/(m² sr).
#[derive(Clone, Debug)]
pub struct Unscattered {
    scene: Arc<(TargetView, Vec<PreparedLamp>)>,
    /// Of the straight ways, 1/m.
    attenuation: Derived,
}

impl Unscattered {
    /// Of the lamps of `setting` in clear water.
    pub(super) fn new(setting: &Setting) -> Self {
        Self {
            scene: Arc::new((setting.view.clone(), setting.lamps.to_vec())),
            attenuation: Derived::default(),
        }
    }

    /// The same light in `water`.
    pub(super) fn in_water(&self, attenuation: Derived) -> Self {
        Self {
            scene: Arc::clone(&self.scene),
            attenuation,
        }
    }

    /// Its value at image coordinates (p, q) in [-1, 1]; 0 where the image does not show the target.
    pub fn at(&self, p: f64, q: f64) -> Derived {
        let (view, lamps) = &*self.scene;
        let (width, height) = view.size_px();
        let sight = view.sight(0.5 * width * (1.0 + p), 0.5 * height * (1.0 + q));
        let Some(sight) = sight else {
            return Derived::default();
        };
        lamps.iter().fold(Derived::default(), |sum, lamp| {
            let (beam, length_m) = straight(view.normal, lamp, sight.point, 0.0);
            let value = beam * mean(&lamp.intensity) / PI;
            let left = value * (-self.attenuation.value * length_m).exp();
            sum + self.attenuation.chain(left, -length_m * left)
        })
    }

    /// Its mean over the image.
    pub fn mean(&self) -> Derived {
        self.mean_about((0.0, 0.0), (1.0, 1.0), GRID)
    }

    /// Its mean over the part of the image that reaches `half` as far from `middle` on either side, from the middles of as many columns
    /// and rows as `parts` says.
    pub fn mean_about(
        &self,
        middle: (f64, f64),
        half: (f64, f64),
        parts: (usize, usize),
    ) -> Derived {
        let place = |i: usize, n: usize| (2 * i + 1) as f64 / n as f64 - 1.0;
        let points = (0..parts.0).flat_map(|i| (0..parts.1).map(move |j| (i, j)));
        let sum = points.fold(Derived::default(), |sum, (i, j)| {
            let p = middle.0 + half.0 * place(i, parts.0);
            let q = middle.1 + half.1 * place(j, parts.1);
            sum + self.at(p, q)
        });
        sum * (1.0 / (parts.0 * parts.1) as f64)
    }
}

/// Irradiance relative to the lamp's intensity that its straight light would bring through nothing, with at least `floor`
/// of the beam, and the length of the way, m.
pub(super) fn straight(normal: DVec3, lamp: &PreparedLamp, point: DVec3, floor: f64) -> (f64, f64) {
    let way = point - lamp.position;
    let length_m = way.length().max(1e-6);
    let direction = way / length_m;
    let cosine = -normal.dot(direction).min(0.0);
    let beam = lamp.relative_intensity(direction).max(floor);
    (beam * cosine / (length_m * length_m), length_m)
}
