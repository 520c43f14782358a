//! Pictures of one connection tell a wrong water: its mean counts where its contrast does not.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use uw_assets::assets_dir;
use uw_calib::picture::Counts;
use uw_calib::vehicle::Vehicle;
use uw_calib::{Encoding, ImageStats};
use uw_guidance::Candidate;
use uw_guidance::physics::file::{WATER_FORMAT, WaterFile, WaterNumbers};
use uw_guidance::physics::{Present, Residual, Water};
use uw_render::scene::{Scene, Texture};
use uw_scenery::textures::Pattern;
use uw_twin::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::estimate::water_tables::{TablePlan, even_texture, sensor_numbers, water_tables};

const DEPTH_M: f64 = 3.0;
/// 1.5 m apart.
const DISTANCES_M: [f64; 2] = [0.6, 2.1];
const LIGHT_PCT: f64 = 40.0;
/// Absorption and scattering of the wrong water over those of the right one.
const WRONG: f64 = 1.35;

fn vehicle() -> Vehicle {
    Vehicle {
        width: 480,
        height: 288,
        hfov_deg: 60.0,
        exposure: 4.0,
        ..Vehicle::default()
    }
}

fn body() -> WaterBody {
    WaterBody {
        jerlov: "1C".parse().expect("a water"),
        backscatter_fraction: 0.0183,
    }
}

fn view(target: &Target, distance_m: f64, times: f64) -> Result<Scene, EnvironmentError> {
    let view = View::Target {
        depth_m: DEPTH_M,
        distance_m,
    };
    let mut scene = scene(&vehicle(), &body(), target, view)?;
    if let Some(water) = &mut scene.water {
        water.iops.a = water.iops.a.map(|a| times * a);
        water.iops.b = water.iops.b.map(|b| times * b);
    }
    Ok(scene)
}

/// A water file of the water with `times` the absorption and scattering.
fn water(pattern: Pattern, times: f64) -> Arc<Water> {
    let even = Target {
        pattern,
        texture: even_texture(0.2),
    };
    let plan = TablePlan {
        distances_m: vec![0.55, 0.75, 1.05, 1.5, 2.2],
        depths_m: vec![DEPTH_M],
        reflectance: 0.2,
        paths_per_group: 4096,
        seed: 3,
    };
    let tables = water_tables(&plan, |_, distance_m| view(&even, distance_m, times));
    Arc::new(Water::new(WaterFile {
        format: WATER_FORMAT.to_owned(),
        made_by: "a test".to_owned(),
        water: WaterNumbers {
            a_per_m: [0.0; 3],
            b_per_m: [0.0; 3],
            backscatter_fraction: 0.0183,
        },
        sensor: sensor_numbers(&vehicle(), Encoding::Srgb),
        tables: tables.expect("tables"),
        sights: Vec::new(),
        fit: None,
    }))
}

/// The target moved by shares of its tile.
fn moved(target: &Target, [right, down]: [f64; 2]) -> Target {
    let texture = &target.texture;
    let (width, height) = (texture.width as usize, texture.height as usize);
    let by = |n: usize, share: f64| (share.rem_euclid(1.0) * n as f64) as usize;
    let (right, down) = (by(width, right), by(height, down));
    let texel = |i: usize| {
        let (x, y) = ((i % width + right) % width, (i / width + down) % height);
        texture.texels.get(y * width + x)
    };
    let texels: Vec<[f32; 3]> = (0..width * height).map(texel).collect();
    Target {
        pattern: target.pattern,
        texture: Texture {
            texels: texels.into(),
            ..texture.clone()
        },
    }
}

struct Shot {
    at: Candidate,
    counts: Counts,
    contrast: [f64; 3],
}

fn shot(target: &Target, distance_m: f64, seed: u64) -> Shot {
    let vehicle = vehicle();
    let pyramid = TexturePyramid::new(&target.texture, f64::from(target.pattern.tile_m()));
    let scene = view(target, distance_m, 1.0).expect("a scene");
    let never = AtomicBool::new(false);
    let image = TargetImage::render(&scene, &pyramid, seed, 2048, &never);
    let picture = (image.expect("rendered").expect("not stopped")).picture(LIGHT_PCT);
    let sensor = sensor(&vehicle, vehicle.exposure);
    let counts = Counts::stored(
        picture.width as usize,
        picture.height as usize,
        sensor.expose(&picture, seed).in_8_bit_counts(),
    );
    let stats = ImageStats::from_counts(counts.width, counts.height, &counts.pixels);
    Shot {
        at: Candidate {
            distance_m,
            light_pct: LIGHT_PCT,
        },
        contrast: stats.expect("statistics").contrast,
        counts,
    }
}

/// What the first picture predicts of the second, by contrast alone and with the mean.
fn residuals(water: &Arc<Water>, before: &Shot, now: &Shot) -> [Residual; 2] {
    let present = |shot: &Shot| {
        let here = (&shot.at, DEPTH_M);
        Present::new(Arc::clone(water), &shot.counts, here, shot.contrast, &[])
    };
    let (before, now) = (present(before), present(now));
    let found = before.residual_at(&now.here(), now.measured());
    let found = found.expect("a residual");
    [found, found.and(before.brightness_at(&now))]
}

/// Each water before three targets, each from two places, backing off and coming nearer with some drift: the right one is never refused, the wrong
/// one always, and not for its contrast.
#[test]
fn attenuation_that_is_wrong_by_a_third_shows_in_the_mean_over_a_metre_and_a_half() {
    let waters = |pattern| [water(pattern, 1.0), water(pattern, WRONG)];
    let (upright, bottom) = (waters(Pattern::ConcretePier), waters(Pattern::Seabed));
    for pattern in [Pattern::ConcretePier, Pattern::Seabed, Pattern::CoralRock] {
        let target = Target::read(pattern, &assets_dir().expect("assets")).expect("a texture");
        let [right, wrong] = match target.is_bottom() {
            true => &bottom,
            false => &upright,
        };
        for seed in 0..2u32 {
            let place = [0.13 + 0.31 * f64::from(seed), 0.57 + 0.23 * f64::from(seed)];
            let drift = [place[0] + 0.02, place[1] - 0.015];
            let seed = u64::from(seed);
            let near = shot(&moved(&target, place), DISTANCES_M[0], 100 + seed);
            let far = shot(&moved(&target, drift), DISTANCES_M[1], 200 + seed);
            for (before, now) in [(&near, &far), (&far, &near)] {
                let told = residuals(right, before, now)[1];
                let name = pattern.name();
                assert!(told.misfit < 1.0, "{name} {seed}: {told:?}");
                let [by_contrast, told] = residuals(wrong, before, now);
                assert!(by_contrast.misfit < 1.0, "{name} {seed}: {by_contrast:?}");
                assert!(told.misfit > 1.0, "{name} {seed}: {told:?}");
            }
        }
    }
}
