//! Paths from the target to the lamps: its irradiance over π.

use std::f64::consts::PI;

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;

use super::Setting;
use super::bridge::{Bridge, Place, quarter_turns};
use super::evaluate::{Coefficients, Derived, Field, Group, Path, project};
use super::orders::Orders;
use crate::estimate::basis::Basis;
use crate::estimate::numbers;
use crate::estimate::target_view::TargetView;

/// Sets these paths' random numbers apart.
const PURPOSE: u32 = 1;
/// Columns and rows of the image at whose middles unscattered light is taken.
const GRID: (usize, usize) = (40, 24);
/// Degree of the polynomial of unscattered light, which has no noise.
const UNSCATTERED_DEGREE: usize = 6;

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

/// Light that reaches the target without scattering, in closed form.
#[derive(Clone, Debug)]
pub(super) struct Unscattered {
    /// Per image point and lamp: strength and length of the way.
    ways: Vec<(f64, f64)>,
    /// Per image point the functions' values.
    functions: Vec<f64>,
    basis: Basis,
    matrix: Vec<f64>,
    lamps: usize,
}

impl Unscattered {
    pub(super) fn new(setting: &Setting) -> Self {
        let basis = Basis::new(UNSCATTERED_DEGREE, setting.even_q);
        let n = basis.len();
        let (mut ways, mut functions, mut matrix) = (Vec::new(), Vec::new(), vec![0.0; n * n]);
        let mut phi = vec![0.0; n];
        let (width, height) = setting.view.size_px();
        let points = (0..GRID.0).flat_map(|i| (0..GRID.1).map(move |j| (i, j)));
        for (i, j) in points {
            let x = (i as f64 + 0.5) / GRID.0 as f64 * width;
            let y = (j as f64 + 0.5) / GRID.1 as f64 * height;
            let Some(sight) = setting.view.sight(x, y) else {
                continue;
            };
            basis.values(sight.image.0, sight.image.1, &mut phi);
            functions.extend(&phi);
            for k in 0..n * n {
                matrix[k] += phi[k / n] * phi[k % n];
            }
            ways.extend(setting.lamps.iter().map(|lamp| {
                let (beam, length_m) = straight(setting.view.normal, lamp, sight.point, 0.0);
                (beam * setting.intensity(lamp) / PI, length_m)
            }));
        }
        Self {
            ways,
            functions,
            basis,
            matrix,
            lamps: setting.lamps.len(),
        }
    }

    pub(super) fn at(&self, water: &Coefficients) -> Field {
        let n = self.basis.len();
        let mut means = vec![Derived::default(); n];
        let of_points = self.ways.chunks_exact(self.lamps);
        for (ways, phi) in of_points.zip(self.functions.chunks_exact(n)) {
            let light = ways.iter().fold(Derived::default(), |sum, &(way, length)| {
                let value = way * (-(water.a + water.b) * length).exp();
                sum + Derived {
                    value,
                    by_a: -length * value,
                    by_b: -length * value,
                    by_ln_backscatter: 0.0,
                }
            });
            let sums = means.iter_mut().zip(phi);
            sums.for_each(|(sum, phi)| *sum = *sum + light * *phi);
        }
        let coefficients = project(&self.matrix, &means).unwrap_or(means);
        Field {
            basis: self.basis.clone(),
            coefficients,
        }
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
