//! One set of paths for every water against the estimate's own fields and walks, in the water at hand.

use uw_calib::vehicle::Vehicle;
use uw_media::Iops;
use uw_media::phase::PhaseTable;
use uw_render::prepare::{Prepared, PreparedLamp};
use uw_render::scene::{Scene, Texture, TextureFilter};
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, WaterBody, scene};
use uw_twin::estimate::every_water::{
    Derived, EveryPhase, EveryWater, EveryWaterError, GROUPS, Phases, Values,
};
use uw_twin::estimate::fields::{FieldSampler, Fields};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::target_model::{TargetModel, lamps_alone};

/// Reflectance of the target: light going back and forth between it and the water matters.
const REFLECTANCE: f32 = 0.5;
/// Edge of a tile of its texture, m.
const TILE_M: f64 = 2.0;

/// A view in one water.
struct Case {
    scene: Scene,
    prepared: Prepared,
    pyramid: TexturePyramid,
}

impl Case {
    fn new(jerlov: &str, backscatter_fraction: f64, distance_m: f64) -> Self {
        Self::with_iops(jerlov, backscatter_fraction, distance_m, None)
    }

    /// In water of the absorption and scattering given, where they are.
    fn with_iops(
        jerlov: &str,
        backscatter_fraction: f64,
        distance_m: f64,
        iops: Option<Iops>,
    ) -> Self {
        let texture = Texture {
            width: 64,
            height: 64,
            texels: vec![[REFLECTANCE; 3]; 64 * 64].into(),
            filter: TextureFilter::Nearest,
        };
        let pyramid = TexturePyramid::new(&texture, TILE_M);
        let target = Target {
            pattern: Pattern::Seabed,
            texture,
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
        let mut scene = lamps_alone(&scene);
        let water = scene.water.as_mut().expect("water");
        water.iops = iops.unwrap_or(water.iops);
        let prepared = Prepared::build(&scene);
        Self {
            scene,
            prepared,
            pyramid,
        }
    }

    fn iops(&self) -> Iops {
        self.scene.water.as_ref().expect("water").iops
    }

    fn phase(&self) -> &PhaseTable {
        &self.prepared.medium.as_ref().expect("water").phase
    }

    fn lamps(&self) -> Vec<PreparedLamp> {
        self.scene.lamps.iter().map(PreparedLamp::build).collect()
    }

    fn model(&self, seed: u64) -> TargetModel<'_> {
        TargetModel::new(&self.scene, &self.prepared, &self.pyramid, true, seed).expect("a view")
    }

    fn set(&self, paths: usize, seed: u64) -> EveryWater {
        let model = self.model(1);
        EveryWater::new(model.view(), &self.lamps(), self.phase(), paths, seed).expect("a set")
    }
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug)]
struct Measured {
    mean: f64,
    error: f64,
}

impl Measured {
    fn of(groups: &[f64]) -> Self {
        let n = groups.len() as f64;
        let mean = groups.iter().sum::<f64>() / n;
        let spread: f64 = groups.iter().map(|g| (g - mean).powi(2)).sum();
        Self {
            mean,
            error: (spread / (n * (n - 1.0))).sqrt(),
        }
    }

    fn relative(&self) -> f64 {
        self.error / self.mean
    }

    /// Difference in combined standard errors, beyond a relative `margin`.
    fn z(&self, truth: &Self, margin: f64) -> f64 {
        let difference = self.mean - truth.mean;
        let beyond = (difference.abs() - margin * truth.mean.abs()).max(0.0);
        beyond.copysign(difference) / self.error.hypot(truth.error)
    }
}

/// Truth per group and channel: the veil's mean, and the light that comes by way of the target over its reflectance, in the middle, in
/// a corner and on average.
struct Truth {
    veil: Vec<[f64; 3]>,
    middle: Vec<[f64; 3]>,
    corner: Vec<[f64; 3]>,
    mean: Vec<[f64; 3]>,
}

/// Image coordinates near a corner.
const CORNER: (f64, f64) = (0.8, 0.8);

fn truth(case: &Case, paths_per_group: u32, seed: u64) -> Truth {
    let model = case.model(7);
    let source = model.lamps();
    let mut sampler = FieldSampler::new(&source, &case.prepared, seed).expect("a scene");
    sampler.extend_to(paths_per_group).expect("light");
    let fields = sampler.fit().expect("a fit");
    let basis = Fields::basis(true, true);
    let mut phi = vec![0.0; basis.len()];
    let (width, height) = model.view().size_px();
    // Light by way of the target: irradiance of the fit times what the model makes of it.
    let mut seen = |group: usize, (p, q): (f64, f64)| -> [f64; 3] {
        basis.values(p, q, &mut phi);
        let sight = model
            .view()
            .sight(0.5 * (p + 1.0) * width, 0.5 * (q + 1.0) * height);
        let reflected = source.at_point(&sight.expect("the target"));
        std::array::from_fn(|k| {
            let c = &fields.irradiance[group][k];
            let fit: f64 = c.iter().zip(&phi).map(|(c, phi)| c * phi).sum();
            fit * reflected[k] / f64::from(REFLECTANCE)
        })
    };
    let groups = 0..GROUPS;
    Truth {
        veil: groups
            .clone()
            .map(|g| std::array::from_fn(|k| fields.veil[g][k][0]))
            .collect(),
        middle: groups.clone().map(|g| seen(g, (0.0, 0.0))).collect(),
        corner: groups.clone().map(|g| seen(g, CORNER)).collect(),
        mean: groups
            .map(|g| {
                let all: Vec<[f64; 3]> = grid().map(|at| seen(g, at)).collect();
                std::array::from_fn(|k| all.iter().map(|v| v[k]).sum::<f64>() / all.len() as f64)
            })
            .collect(),
    }
}

/// Points evenly over the image.
fn grid() -> impl Iterator<Item = (f64, f64)> {
    let at = |i: usize| (f64::from(i as u32) + 0.5) / 8.0 - 1.0;
    (0..16).flat_map(move |i| (0..16).map(move |j| (at(i), at(j))))
}

/// The same from the shared set.
fn seen_by_set(model: &TargetModel, values: &Values, (p, q): (f64, f64)) -> f64 {
    let (width, height) = model.view().size_px();
    let sight = model
        .view()
        .sight(0.5 * (p + 1.0) * width, 0.5 * (q + 1.0) * height);
    let sight = sight.expect("the target");
    let cosine = model.view().incidence(sight.direction);
    let direct = values.transmittance(sight.range_m).value;
    let gain = values.gain(f64::from(REFLECTANCE)).value;
    gain * values.irradiance(p, q).value * (direct + values.sight.share_at(cosine).value)
}

/// A part of the image, from the shared set and from the estimate.
struct Compared {
    what: String,
    own: Measured,
    truth: Measured,
}

/// Groups of as many independent sets as truths: their number makes the standard errors themselves well known.
const SEEDS: u64 = 3;

/// All parts of the image of `case` in all channels: `paths` of a set, `truth_paths` per group of the estimate.
fn compared(case: &Case, name: &str, paths: usize, truth_paths: u32) -> Vec<Compared> {
    let model = case.model(1);
    let sets: Vec<EveryWater> = (0..SEEDS).map(|s| case.set(paths, 3 + s)).collect();
    let truths: Vec<Truth> = (0..SEEDS)
        .map(|s| truth(case, truth_paths, 11 + s))
        .collect();
    let iops = case.iops();
    let mut all = Vec::new();
    for k in 0..3 {
        let (a, b) = (iops.a[k], iops.b[k]);
        let groups: Vec<Values> = sets.iter().flat_map(|set| set.by_group(a, b)).collect();
        let mut add =
            |what: &str, own: &dyn Fn(&Values) -> f64, of: fn(&Truth) -> &Vec<[f64; 3]>| {
                let own: Vec<f64> = groups.iter().map(own).collect();
                let truth: Vec<f64> = truths.iter().flat_map(of).map(|t| t[k]).collect();
                all.push(Compared {
                    what: format!("{name} a {a:.3} b {b:.4} {what}"),
                    own: Measured::of(&own),
                    truth: Measured::of(&truth),
                });
            };
        let at = |place| {
            let model = &model;
            move |v: &Values| seen_by_set(model, v, place)
        };
        let mean = |v: &Values| grid().map(|at| seen_by_set(&model, v, at)).sum::<f64>() / 256.0;
        add("V", &|v| v.veil.mean().value, |t| &t.veil);
        add("E middle", &at((0.0, 0.0)), |t| &t.middle);
        add("E corner", &at(CORNER), |t| &t.corner);
        add("E mean", &mean, |t| &t.mean);
    }
    all
}

/// Bound of |z| for the 132 comparisons below at 1 % altogether (Šidák), of Student's t with 23 degrees of freedom: standard
/// errors come from 24 groups on either side.
const MOST_Z: f64 = 4.8;
/// What polynomials over the image, E taken at the image point rather than where scattered rays land, and reflections back and
/// forth may leave; relative.
const MARGIN: f64 = 0.005;
/// Largest standard errors of a set of 20,000 paths; relative, twice what they are in the worst case.
const MOST_VEIL_ERROR: f64 = 0.04;
const MOST_LIGHT_ERROR: f64 = 0.06;

/// One set of paths gives the veil and the light that comes by way of the target in clear and in turbid water, near and far, at
/// any backscatter, as paths made for each water do. (9C beyond 1.6 m is left out: the estimate's own paths are too noisy.)
#[test]
fn parts_of_the_image_are_those_of_paths_made_for_each_water() {
    let cases = [
        ("I", 0.0183, 0.8),
        ("I", 0.05, 4.0),
        ("II", 0.005, 1.6),
        ("II", 0.05, 4.0),
        ("III", 0.0183, 1.6),
        ("1C", 0.05, 0.8),
        ("5C", 0.0183, 4.0),
        ("9C", 0.0183, 0.8),
        ("9C", 0.005, 1.6),
        // Scattering to all sides: bridges that lead through the target, and detours, weigh.
        ("5C", 0.3, 0.8),
        ("9C", 0.3, 0.4),
    ];
    for (jerlov, fraction, distance_m) in cases {
        let case = Case::new(jerlov, fraction, distance_m);
        let name = format!("{jerlov} B {fraction} {distance_m} m");
        for Compared { what, own, truth } in compared(&case, &name, 20_000, 2048) {
            let z = own.z(&truth, MARGIN);
            assert!(z.abs() < MOST_Z, "{what}: {own:?} {truth:?} z {z:.1}");
            let of_one_set = own.relative() * (SEEDS as f64).sqrt();
            let most = match what.ends_with(" V") {
                true => Some(MOST_VEIL_ERROR),
                false => what.ends_with("mean").then_some(MOST_LIGHT_ERROR),
            };
            assert!(most.is_none_or(|m| of_one_set < m), "{what}: {of_one_set}");
        }
    }
}

/// Where light diffuses, some of it would get to the target by way of the water behind it, were bridges and walks to
/// lead through the target: irradiance and veil would be brighter by 4 % and more (standard errors: 0.5 %).
#[test]
fn no_light_comes_through_the_target() {
    let iops = Iops {
        a: [0.3; 3],
        b: [2.0, 4.0, 5.0],
    };
    let case = Case::with_iops("II", 0.4, 0.8, Some(iops));
    for Compared { what, own, truth } in compared(&case, "diffuse", 40_000, 4096) {
        let z = own.z(&truth, MARGIN);
        assert!(z.abs() < MOST_Z, "{what}: {own:?} {truth:?} z {z:.1}");
    }
}

/// Nothing scatters where there is nothing to scatter.
#[test]
fn water_without_scattering_has_straight_light_alone() {
    let set = Case::new("II", 0.0183, 1.6).set(4096, 5);
    let (clear, thin) = (set.at(0.1, 0.0), set.at(0.1, 1e-6));
    let straight = clear.unscattered.mean().value;
    for (none, little) in [
        (clear.veil.mean(), thin.veil.mean()),
        (clear.scattered.mean(), thin.scattered.mean()),
        (clear.sight.share_at(0.95), thin.sight.share_at(0.95)),
    ] {
        assert!(none.value.abs() < 1e-8 * straight, "{none:?}");
        // The slope at b = 0 is what little scattering adds.
        let slope = little.value / 1e-6;
        assert!((none.by_b / slope - 1.0).abs() < 1e-4, "{none:?} {slope}");
    }
}

/// Every number of a set.
fn all_values(values: &Values) -> Vec<Derived> {
    let fields = [&values.veil, &values.scattered];
    let corners = fields.map(|field| [field.mean(), field.at(0.7, -0.4)]);
    let unscattered = [values.unscattered.mean(), values.unscattered.at(0.7, -0.4)];
    let others = [
        values.returned,
        values.gain(0.3),
        values.sight.share_at(0.9),
        values.transmittance(1.3),
        values.irradiance(0.2, 0.1) * values.gain(0.3),
    ];
    let all = corners
        .into_iter()
        .flatten()
        .chain(unscattered)
        .chain(others);
    all.chain(values.sight.transfer.iter().copied()).collect()
}

fn phases() -> Phases {
    Phases::new(1.10, &[0.004, 0.009, 0.02, 0.045, 0.09]).expect("phase functions")
}

fn every_phase(case: &Case) -> EveryPhase {
    let model = case.model(1);
    let frequencies = [1.0, 10.0];
    EveryPhase::new(
        model.view(),
        &case.lamps(),
        &phases(),
        &frequencies,
        4096,
        5,
    )
    .expect("sets")
}

/// Derivatives are those of the same paths, so that differences meet them but for rounding and their own third order.
#[test]
fn derivatives_are_those_of_differences() {
    let every = every_phase(&Case::new("II", 0.0183, 1.6));
    for (a, b, fraction) in [(0.05, 0.4, 0.0183), (0.4, 0.004, 0.03), (0.3, 2.0, 0.006)] {
        let values = all_values(&every.at(a, b, fraction));
        let difference = |step: [f64; 3]| -> Vec<f64> {
            let at = |sign: f64| {
                let [a, b] = [a + sign * step[0], b + sign * step[1]];
                all_values(&every.at(a, b, fraction * (sign * step[2]).exp()))
            };
            let width = 2.0 * step.iter().sum::<f64>();
            let pairs = at(1.0).into_iter().zip(at(-1.0));
            pairs
                .map(|(up, down)| (up.value - down.value) / width)
                .collect()
        };
        let by_a = difference([1e-4, 0.0, 0.0]);
        let by_b = difference([0.0, 1e-4 * b, 0.0]);
        let by_backscatter = difference([0.0, 0.0, 1e-4]);
        for (i, value) in values.iter().enumerate() {
            let pairs = [
                (value.by_a, by_a[i], 1.0),
                (value.by_b, by_b[i], b),
                (value.by_ln_backscatter, by_backscatter[i], 1.0),
            ];
            for (exact, found, scale) in pairs {
                let error = (exact - found).abs();
                // Of the derivative, or where that is small, of the value over the coefficient's own scale.
                let most = 1e-6 * (exact.abs() + value.value.abs() / scale);
                assert!(
                    error < most,
                    "{a} {b} {fraction} number {i}: {exact} {found}"
                );
            }
        }
    }
}

/// Between the fractions that sets were made for, a polynomial meets what a set made with the same random numbers gives: far
/// better than the standard error of either.
#[test]
fn backscatter_fractions_in_between_are_met() {
    for (jerlov, fraction) in [("II", 0.03), ("5C", 0.013)] {
        let case = Case::new(jerlov, fraction, 1.6);
        let (every, set) = (every_phase(&case), case.set(4096, 5));
        let iops = case.iops();
        for k in 0..3 {
            let (a, b) = (iops.a[k], iops.b[k]);
            let (between, made) = (every.at(a, b, fraction), set.at(a, b));
            let pairs = [
                ("veil", between.veil.mean(), made.veil.mean(), 0.02),
                (
                    "light",
                    between.mean_irradiance(),
                    made.mean_irradiance(),
                    0.005,
                ),
                (
                    "share",
                    between.sight.share_at(0.95),
                    made.sight.share_at(0.95),
                    0.01,
                ),
            ];
            for (what, between, made, most) in pairs {
                let error = between.value / made.value - 1.0;
                assert!(
                    error.abs() < most,
                    "{jerlov} {fraction} {k} {what}: {error}"
                );
            }
        }
    }
}

#[test]
fn sets_that_cannot_be_made_say_why() {
    let case = Case::new("II", 0.0183, 1.6);
    let model = case.model(1);
    let set = |lamps: &[PreparedLamp], paths| {
        EveryWater::new(model.view(), lamps, case.phase(), paths, 1).map(|_| ())
    };
    let mut lamps = case.lamps();
    assert!(matches!(
        set(&lamps, 10),
        Err(EveryWaterError::Few { paths: 10, .. })
    ));
    assert_eq!(set(&[], 4096), Err(EveryWaterError::Dark));
    lamps[1].intensity[2] *= 0.5;
    assert_eq!(set(&lamps, 4096), Err(EveryWaterError::Colours { lamp: 1 }));
    assert!(matches!(
        Phases::new(1.10, &[0.02, 0.01]).map(|_| ()),
        Err(EveryWaterError::Backscatter { .. })
    ));
    assert!(Phases::new(1.10, &[0.02, 0.7]).is_err());
}
