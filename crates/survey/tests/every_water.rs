//! One set of paths in every water against the estimate of images, which takes paths of its own in each water.

use std::f64::consts::TAU;

use uw_media::phase::PhaseTable;
use uw_render::prepare::{Prepared, PreparedLamp};
use uw_render::sampling::directions::turn;
use uw_render::sampling::{Draws, MAX_BATCH};
use uw_render::scene::{Scene, Texture, TextureFilter};
use uw_survey::environment::{Target, View, WaterBody, scene};
use uw_survey::estimate::every_water::{EveryWater, Value};
use uw_survey::estimate::fields::{FieldSampler, Fields};
use uw_survey::estimate::guess::Guess;
use uw_survey::estimate::pyramid::TexturePyramid;
use uw_survey::estimate::radiance::Source;
use uw_survey::estimate::spread::{Scattered, Spread};
use uw_survey::estimate::target_model::{TargetModel, lamps_alone};
use uw_survey::estimate::target_view::TargetView;
use uw_survey::scenery::textures::Pattern;
use uw_survey::vehicle::Vehicle;

/// So dark that light which it sends back and the water returns to it is of no account.
const REFLECTANCE: f32 = 0.02;
/// Image points along the longer edge at which means over the image are taken.
const COLUMNS: usize = 48;
const ROWS: usize = 27;

/// An image of an even target in one water.
struct Setup {
    scene: Scene,
    texture: Texture,
}

/// A mean over an image with its standard error.
#[derive(Clone, Copy, Debug)]
struct Mean {
    value: f64,
    error: f64,
}

impl Mean {
    fn of(groups: &[f64]) -> Self {
        let n = groups.len() as f64;
        let value = groups.iter().sum::<f64>() / n;
        let spread: f64 = groups.iter().map(|g| (g - value).powi(2)).sum();
        Self {
            value,
            error: (spread / (n * (n - 1.0))).sqrt(),
        }
    }
}

impl Setup {
    fn new(jerlov: &str, backscatter_fraction: f64, distance_m: f64) -> Self {
        let texture = Texture {
            width: 1,
            height: 1,
            texels: vec![[REFLECTANCE; 3]].into(),
            filter: TextureFilter::Nearest,
        };
        let target = Target {
            pattern: Pattern::Seabed,
            texture: texture.clone(),
        };
        let water = WaterBody {
            jerlov: jerlov.parse().expect("a water"),
            backscatter_fraction,
        };
        let view = View::Target {
            depth_m: 5.0,
            distance_m,
        };
        let scene = scene(&Vehicle::default(), &water, &target, view).expect("a scene");
        Self {
            scene: lamps_alone(&scene),
            texture,
        }
    }

    fn view(&self) -> TargetView {
        TargetView::new(&self.scene).expect("a target that fills the view")
    }

    fn phase(&self) -> PhaseTable {
        PhaseTable::new(&self.scene.water.as_ref().expect("water").phase)
    }

    fn sets(&self, paths: u32, seed: u64) -> EveryWater {
        let lamps: Vec<_> = self.scene.lamps.iter().map(PreparedLamp::build).collect();
        EveryWater::new(&self.view(), &lamps, &self.phase(), paths, seed)
    }

    /// Absorption and scattering of a channel, 1/m.
    fn water(&self, channel: usize) -> (f64, f64) {
        let iops = &self.scene.water.as_ref().expect("water").iops;
        (iops.a[channel], iops.b[channel])
    }

    /// Veil, irradiance and share of each channel from paths of this water alone.
    fn own(&self, paths_per_group: u32) -> [[Mean; 3]; 3] {
        let pyramid = TexturePyramid::new(&self.texture, 2.0);
        let prepared = Prepared::build(&self.scene);
        let model = TargetModel::new(&self.scene, &prepared, &pyramid, true, 7).expect("a model");
        let source = model.lamps();
        let mut sampler = FieldSampler::new(&source, &prepared, 11).expect("rays");
        sampler.extend_to(paths_per_group).expect("light");
        let fields = sampler.fit().expect("a fit");
        let shares = self.shares(&pyramid);
        std::array::from_fn(|k| {
            let veils: Vec<f64> = fields.veil.iter().map(|v| v[k][0]).collect();
            [Mean::of(&veils), irradiance(&source, &fields, k), shares[k]]
        })
    }

    /// Share of scattered rays that reach the target, per channel.
    fn shares(&self, pyramid: &TexturePyramid) -> [Mean; 3] {
        let water = self.scene.water.as_ref().expect("water");
        let view = self.view();
        let light = (&Guess::Even, None);
        let spread = Spread::new(water, &self.phase(), &view, light, pyramid, 13);
        let of_groups: Vec<[f64; 3]> = spread.groups().iter().map(|g| share(g, &view)).collect();
        std::array::from_fn(|k| Mean::of(&of_groups.iter().map(|g| g[k]).collect::<Vec<_>>()))
    }
}

/// Points evenly over an image, pixels.
fn points(view: &TargetView) -> impl Iterator<Item = (f64, f64)> + use<> {
    let (width, height) = view.size_px();
    (0..COLUMNS * ROWS).map(move |i| {
        let (column, row) = ((i % COLUMNS) as f64, (i / COLUMNS) as f64);
        (
            (column + 0.5) / COLUMNS as f64 * width,
            (row + 0.5) / ROWS as f64 * height,
        )
    })
}

fn share(rays: &Scattered, view: &TargetView) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (x, y) in points(view) {
        let sight = view.sight(x, y).expect("the target");
        let at = rays.share(view.incidence(sight.direction));
        (0..3).for_each(|k| sum[k] += at[k] / (COLUMNS * ROWS) as f64);
    }
    sum
}

/// Mean irradiance over π; its error has that of the walks by which the reflected light was divided.
fn irradiance(source: &Source, fields: &Fields, k: usize) -> Mean {
    let basis = Fields::basis(true, source.symmetric);
    let mut weights = vec![0.0; basis.len()];
    let mut phi = vec![0.0; basis.len()];
    for (x, y) in points(source.view) {
        let sight = source.view.sight(x, y).expect("the target");
        let (p, q) = source.view.unit_coordinates(x, y);
        basis.values(p, q, &mut phi);
        let guess = source.guess.at(sight.point)[k] / (COLUMNS * ROWS) as f64;
        weights
            .iter_mut()
            .zip(&phi)
            .for_each(|(w, f)| *w += guess * f);
    }
    let mean = |c: &Vec<f64>| c.iter().zip(&weights).map(|(c, w)| c * w).sum::<f64>();
    let means: Vec<f64> = fields.irradiance.iter().map(|f| mean(&f[k])).collect();
    let mean = Mean::of(&means);
    let view = source.view;
    let (width, height) = view.size_px();
    let centre = view.sight(0.5 * width, 0.5 * height).expect("the target");
    let straight = source.spread.unscattered(&centre).transmittance[k];
    let groups = source.spread.groups().iter();
    let reached: Vec<f64> = groups.map(|g| straight + share(g, view)[k]).collect();
    let reached = Mean::of(&reached);
    Mean {
        value: mean.value,
        error: mean.error.hypot(mean.value * reached.error / reached.value),
    }
}

/// Paths of each quantity in a set.
const PATHS: u32 = 65_536;

/// Quantile of Student's t with the 7 degrees of freedom of eight groups, two-sided, that 63 comparisons exceed anywhere
/// with a probability of 1 %.
const QUANTILE: f64 = 7.2;

/// What remains: lamps that are disks, light that the dark target sends back, and the place at which the estimate of images
/// takes the irradiance.
const MARGIN: f64 = 0.005;

/// Waters from the clearest to the most turbid, three bands each, over all backscatter fractions and distances.
#[test]
fn means_are_those_of_paths_made_for_each_water() {
    let cases = [
        ("I", 0.05, 1.6),
        ("II", 0.0183, 3.0),
        ("III", 0.005, 0.8),
        ("1C", 0.0183, 1.6),
        ("5C", 0.05, 3.0),
        ("9C", 0.05, 0.8),
        ("9C", 0.005, 1.6),
    ];
    for (seed, (jerlov, backscatter_fraction, distance_m)) in (1..).zip(cases) {
        let setup = Setup::new(jerlov, backscatter_fraction, distance_m);
        let sets = setup.sets(PATHS, seed);
        let own = setup.own(4096);
        for (k, own) in own.iter().enumerate() {
            let (a, b) = setup.water(k);
            let at = sets.at(a, b, k);
            let shared = [at.veil, at.irradiance, at.share];
            let names = ["veil", "irradiance", "share"];
            // The accuracy that a set of so many paths is to have.
            let most = [0.03, 0.01, 0.015];
            for (((own, shared), name), most) in own.iter().zip(shared).zip(names).zip(most) {
                let error = own.error.hypot(shared.error);
                let within = QUANTILE * error + MARGIN * own.value;
                assert!(
                    (shared.value - own.value).abs() < within,
                    "{name} {jerlov} {backscatter_fraction} {distance_m} {k}: {shared:?} {own:?}"
                );
                assert!(
                    shared.error < most * shared.value,
                    "{name} {jerlov} {backscatter_fraction} {distance_m} {k}: {shared:?}"
                );
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_the_values() {
    let sets = Setup::new("II", 0.0183, 1.6).sets(4096, 5);
    let step = 1e-4;
    for (a, b) in [(0.02, 0.01), (0.1, 0.7), (0.6, 3.0)] {
        let parts = |a: f64, b: f64| {
            let at = sets.at(a, b, 1);
            [at.veil, at.irradiance, at.share]
        };
        let by_a = (parts(a + step, b), parts(a - step, b));
        let by_b = (parts(a, b + step), parts(a, b - step));
        for (i, here) in parts(a, b).iter().enumerate() {
            let slope = |(up, down): &([Value; 3], [Value; 3])| {
                (up[i].value - down[i].value) / (2.0 * step)
            };
            // Differences are off by a sixth of the third derivative times the step squared: at b = 0.01, k = 3 that is
            // 1e-4 of the first.
            let scale = here.by_a.abs() + here.by_b.abs();
            for (found, expected) in [(here.by_a, slope(&by_a)), (here.by_b, slope(&by_b))] {
                assert!(
                    (found - expected).abs() < 1e-4 * scale,
                    "{a} {b} {i}: {found} {expected}"
                );
            }
        }
    }
}

/// Nothing scatters where there is nothing to scatter.
#[test]
fn water_without_scattering_has_straight_light_alone() {
    let sets = Setup::new("II", 0.0183, 1.6).sets(4096, 5);
    let (clear, thin) = (sets.at(0.1, 0.0, 0), sets.at(0.1, 1e-6, 0));
    assert!(clear.veil.value < 1e-9 * clear.irradiance.value && clear.share.value < 1e-9);
    // The slope at b = 0 is what little scattering adds.
    let slope = thin.veil.value / 1e-6;
    assert!((clear.veil.by_b / slope - 1.0).abs() < 1e-4, "{clear:?}");
    assert!(clear.irradiance.error < 1e-9 * clear.irradiance.value);
}

/// Contrast that scattered rays leave of a texture, from walks with the water's own flights.
fn own_transfer(setup: &Setup, (a, b): (f64, f64), frequencies: &[f64]) -> Vec<f64> {
    let (view, phase) = (setup.view(), setup.phase());
    let (width, height) = view.size_px();
    let mut total = 0.0;
    let mut waves = vec![0.0; frequencies.len()];
    for i in 0..8 * MAX_BATCH {
        let mut draws = Draws::new(17, 0, i / MAX_BATCH, i % MAX_BATCH, 0);
        let (x, y) = (draws.uniform() * width, draws.uniform() * height);
        let sight = view.sight(x, y).expect("the target");
        let (mut place, mut direction) = (view.camera.position_m, sight.direction);
        let (mut length_m, mut scattered) = (0.0, false);
        while length_m < 50.0 {
            let flight = -draws.uniform().ln() / b;
            let to_target = view.range_m(place, direction).unwrap_or(f64::INFINITY);
            place += flight.min(to_target) * direction;
            length_m += flight.min(to_target);
            if to_target <= flight {
                let carried = if scattered {
                    (-a * length_m).exp()
                } else {
                    0.0
                };
                let (dx, dy) = view.offset(sight.point, place);
                total += carried;
                for (wave, f) in waves.iter_mut().zip(frequencies) {
                    *wave += 0.5 * carried * ((TAU * f * dx).cos() + (TAU * f * dy).cos());
                }
                break;
            }
            direction = turn(direction, phase.sample_x(draws.uniform()), draws.uniform());
            scattered = true;
        }
    }
    waves.iter().map(|wave| wave / total).collect()
}

#[test]
fn contrast_left_is_that_of_walks_in_each_water() {
    let setup = Setup::new("II", 0.0183, 1.6);
    let sets = setup.sets(PATHS, 5);
    let frequencies = [0.0, 0.5, 2.0, 8.0, 32.0];
    for (a, b) in [(0.02, 0.2), (0.1, 0.7), (0.5, 3.0)] {
        let own = own_transfer(&setup, (a, b), &frequencies);
        let shared = sets.transfer(a, b, &frequencies);
        for (own, shared) in own.iter().zip(&shared) {
            // Five thousand walks of each that count at least: 0.7 / 70, and three times that of both.
            assert!((own - shared).abs() < 0.042, "{a} {b}: {own} {shared}");
        }
        assert!((shared[0] - 1.0).abs() < 1e-9);
        // At the highest frequency something is lost to see.
        assert!(shared[4] < 0.9, "{shared:?}");
    }
}
