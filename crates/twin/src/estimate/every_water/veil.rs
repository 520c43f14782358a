//! Paths from the camera to the lamps that never meet the target: the veil.
//!
//! A walk from the camera scatters up to `MOST_JOINTS` times; from each of its vertices a bridge leads to a lamp. A path
//! of n scatterings can be made with the joint at its first, second .. vertex, and counts for the light that it carries
//! over the sum of the densities of all these ways of making it (balance heuristic, `docs/transport.md`).

use glam::DVec3;
use uw_media::phase::PhaseTable;
use uw_render::sampling::directions::{sin2_half, turn};

use super::Setting;
use super::bridge::{Bridge, Place, quarter_turns};
use super::evaluate::{Group, Path};
use super::orders::{Orders, RATES_PER_M};
use crate::estimate::numbers::{self, Numbers};
use crate::estimate::target_view::Sight;

/// Sets the random numbers of walks apart; those of the bridge at joint m follow.
const PURPOSE: u32 = 16;
/// Most joints of a walk; what scatters more often is left to the bridges.
const MOST_JOINTS: usize = 8;
/// Share of first flights that are drawn evenly over the angle under which a lamp sees them.
const TOWARDS_LAMPS: f64 = 0.5;

/// Where a walk's first flight may end: the densities of the ways to draw it.
struct FirstFlight<'a> {
    setting: &'a Setting<'a>,
    sight: Sight,
}

/// What a lamp sees of a ray.
struct Angles {
    /// Place on the ray that is nearest to the lamp, m.
    nearest_m: f64,
    /// Its distance from the lamp, m.
    height_m: f64,
    from: f64,
    to: f64,
}

impl FirstFlight<'_> {
    fn angles(&self, lamp: DVec3) -> Angles {
        let way = lamp - self.setting.view.camera.position_m;
        let nearest_m = way.dot(self.sight.direction);
        let height_m = (way - nearest_m * self.sight.direction).length().max(1e-6);
        let angle = |t: f64| ((t - nearest_m) / height_m).atan();
        Angles {
            nearest_m,
            height_m,
            from: angle(0.0),
            to: angle(self.sight.range_m),
        }
    }

    /// A length below the ray's own, for walks of `rate`.
    fn draw(&self, rate: f64, numbers: &mut Numbers) -> f64 {
        let (kind, u) = (numbers.next(), numbers.next());
        if kind >= TOWARDS_LAMPS {
            let all = -(-rate * self.sight.range_m).exp_m1();
            return -(-u * all).ln_1p() / rate;
        }
        let lamps = self.setting.lamps;
        let chosen = (kind / TOWARDS_LAMPS * lamps.len() as f64) as usize;
        let seen = self.angles(lamps[chosen.min(lamps.len() - 1)].position);
        let angle = seen.from + u * (seen.to - seen.from);
        (seen.nearest_m + seen.height_m * angle.tan()).clamp(0.0, self.sight.range_m)
    }

    /// Density of the length as the lamps see it.
    fn towards_lamps(&self, length_m: f64) -> f64 {
        let lamps = self.setting.lamps;
        let density = |seen: Angles| {
            let beside = length_m - seen.nearest_m;
            let square = seen.height_m * seen.height_m + beside * beside;
            seen.height_m / ((seen.to - seen.from) * square)
        };
        let sum: f64 = lamps.iter().map(|l| density(self.angles(l.position))).sum();
        sum / lamps.len() as f64
    }

    /// Per rate the density of the first flight, over that of later flights of the rate that are as long.
    fn densities(&self, length_m: f64) -> [f64; RATES_PER_M.len()] {
        let towards = TOWARDS_LAMPS * self.towards_lamps(length_m);
        RATES_PER_M.map(|rate| {
            let free = rate * (-rate * length_m).exp();
            let forced = free / -(-rate * self.sight.range_m).exp_m1();
            ((1.0 - TOWARDS_LAMPS) * forced + towards) / RATES_PER_M.len() as f64
        })
    }
}

/// A path from the camera to a lamp.
#[derive(Default)]
struct Way {
    /// Vertices, the camera first and the lamp last, m.
    vertices: Vec<DVec3>,
    directions: Vec<DVec3>,
    lengths_m: Vec<f64>,
}

impl Way {
    /// Measures its parts.
    fn measure(&mut self) {
        self.directions.clear();
        self.lengths_m.clear();
        for ends in self.vertices.windows(2) {
            let (way, length) = (ends[1] - ends[0], ends[0].distance(ends[1]));
            self.directions.push(way / length);
            self.lengths_m.push(length);
        }
    }

    /// Sum of the densities of all ways to make it, over the phase values of all its scatterings.
    fn density(&self, first: &[f64; RATES_PER_M.len()], phase: &PhaseTable) -> f64 {
        let scatterings = self.vertices.len() - 2;
        let lamp = self.vertices[scatterings + 1];
        let mut left_m: f64 = self.lengths_m[1..].iter().sum();
        let mut of_rate = *first;
        let mut sum = 0.0;
        for joint in 1..=scatterings.min(MOST_JOINTS) {
            let distance_m = self.vertices[joint].distance(lamp);
            let orders = Orders::new(0, distance_m).density(scatterings - joint, left_m);
            let deflection = sin2_half(self.directions[joint - 1], self.directions[joint]);
            let walk: f64 = of_rate.iter().sum();
            sum += walk * orders * distance_m.powi(3) / (left_m * phase.value(deflection));
            let flight = self.lengths_m[joint];
            left_m = (left_m - flight).max(f64::MIN_POSITIVE);
            let rates = of_rate.iter_mut().zip(RATES_PER_M);
            rates.for_each(|(density, rate)| *density *= rate * (-rate * flight).exp());
        }
        sum
    }
}

/// Paths of `group`.
pub(super) fn veil(setting: &Setting, phase: &PhaseTable, group: u32, points: u32) -> Group {
    let mut paths = Group::new(setting.basis.len());
    let mut phi = vec![0.0; setting.basis.len()];
    let (mut bridge, mut way) = (Bridge::default(), Way::default());
    for (index, mut numbers) in (0..).zip(numbers::of_paths(setting.seed, group, PURPOSE, points)) {
        let Some(sight) = setting.sight(&mut numbers, &mut phi) else {
            continue;
        };
        paths.point(&phi);
        let rate = RATES_PER_M[(numbers.next() * RATES_PER_M.len() as f64) as usize];
        let flight = FirstFlight { setting, sight };
        let length_m = flight.draw(rate, &mut numbers);
        let first = flight.densities(length_m);
        let mut direction = sight.direction;
        let mut walk = vec![setting.view.camera.position_m];
        walk.push(walk[0] + length_m * direction);
        for joint in 1..=MOST_JOINTS {
            let mut own = numbers::of_path(setting.seed, group, PURPOSE + joint as u32, index);
            way.vertices.clear();
            way.vertices.extend(&walk);
            let path = joined(setting, phase, (&mut bridge, &mut way), &first, &mut own);
            if let Some(path) = path {
                paths.add(path, phi.iter().copied());
            }
            if joint == MOST_JOINTS {
                break;
            }
            direction = turn(direction, phase.sample_x(numbers.next()), numbers.next());
            let next = walk[joint] + numbers.length() / rate * direction;
            if !setting.is_before_target(next) {
                break;
            }
            walk.push(next);
        }
    }
    paths
}

/// The walk `way` joined to a lamp; `None` where no light comes. Its evenly spread numbers would be those of the walk again, as
/// they go by the path's index: only random ones are independent of them.
fn joined(
    setting: &Setting,
    phase: &PhaseTable,
    (bridge, way): (&mut Bridge, &mut Way),
    first: &[f64; RATES_PER_M.len()],
    numbers: &mut Numbers,
) -> Option<Path> {
    let joint = *way.vertices.last()?;
    let (lamp, end) = setting.lamp_point(numbers.random(), numbers);
    let place = Place::new(joint, end);
    let order = Orders::new(0, place.distance_m()).draw(numbers.random(), numbers.random())?;
    let rolls = quarter_turns(numbers.random());
    let choice = numbers.random();
    if order == 0 {
        bridge.straight();
    } else if !bridge.draw(order, phase, numbers) {
        return None;
    }
    let beams = rolls.map(|roll| lamp.relative_intensity(-bridge.end_direction(&place, roll)));
    let all: f64 = beams.iter().sum();
    if !(all > 0.0) {
        return None;
    }
    let mut left = choice * all;
    let chosen = beams.iter().position(|beam| {
        left -= beam;
        left < 0.0
    });
    let roll = rolls[chosen.unwrap_or(0)];
    for vertex in bridge.interior(&place, roll) {
        if !setting.is_before_target(vertex) {
            return None;
        }
        way.vertices.push(vertex);
    }
    way.vertices.push(end);
    way.measure();
    let light = setting.lamps.len() as f64 * setting.intensity(lamp) * 0.25 * all;
    Some(Path {
        scatterings: (way.vertices.len() - 2) as f32,
        length_m: way.lengths_m.iter().sum(),
        log_weight: (light / way.density(first, phase)).ln(),
        light: [0.0; 2],
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_scene::even_target;
    use super::*;
    use uw_media::phase::{FournierForand, Phase};
    use uw_render::prepare::PreparedLamp;

    use crate::estimate::target_view::TargetView;

    /// No bridge leads through the target, near as its joint may be to it and to whatever side light scatters.
    #[test]
    fn no_bridge_leads_through_the_target() {
        let scene = even_target("II", 0.0183, 0.8);
        let view = TargetView::new(&scene).unwrap();
        let lamps: Vec<_> = scene.lamps.iter().map(PreparedLamp::build).collect();
        let setting = Setting::new(&view, &lamps, 1);
        let phase = Phase::FournierForand(FournierForand::new(1.10, 0.4).unwrap());
        let phase = PhaseTable::new(&phase);
        let sight = view.sight(640.0, 360.0).unwrap();
        let length_m = 0.95 * sight.range_m;
        let camera = view.camera.position_m;
        let joint = camera + length_m * sight.direction;
        let first = FirstFlight {
            setting: &setting,
            sight,
        }
        .densities(length_m);
        let (mut bridge, mut way) = (Bridge::default(), Way::default());
        let mut bent = 0;
        for mut numbers in numbers::of_paths(1, 0, PURPOSE, 4096) {
            way.vertices = vec![camera, joint];
            let path = joined(
                &setting,
                &phase,
                (&mut bridge, &mut way),
                &first,
                &mut numbers,
            );
            if path.is_some_and(|path| path.scatterings > 1.0) {
                bent += 1;
                let all = &way.vertices;
                assert!(all.iter().all(|&v| setting.is_before_target(v)), "{all:?}");
            }
        }
        // Some are left: bridges that scatter, stay before the target and end in a beam.
        assert!(bent > 100, "{bent}");
    }
}
