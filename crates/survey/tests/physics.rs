//! Predictions by physics in a known water, before a target of which nothing was learned, against the estimate's own contrast.

use std::sync::atomic::AtomicBool;

use uw_assets::assets_dir;
use uw_calib::Encoding;
use uw_calib::picture::Counts;
use uw_calib::response::{CountResponse, LinearNoise};
use uw_calib::vehicle::Vehicle;
use uw_guidance::Candidate;
use uw_guidance::physics::{LinearPicture, Place, Predictor, Sight, WaterTables};
use uw_render::scene::Scene;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::estimate::water_tables::{TablePlan, even_texture, water_tables};

const DEPTH_M: f64 = 3.0;
const DISTANCES_M: [f64; 3] = [0.7, 1.2, 2.0];
const LEVELS_PCT: [f64; 2] = [0.0, 60.0];

/// A camera that neither texture nor network of the project was made for, and an exposure at which nothing is clipped.
fn vehicle() -> Vehicle {
    Vehicle {
        width: 480,
        height: 288,
        hfov_deg: 50.0,
        exposure: 3.0,
        ..Vehicle::default()
    }
}

struct Shot {
    at: Candidate,
    picture: LinearPicture,
    contrast: [f64; 3],
}

fn view(body: &WaterBody, target: &Target, distance_m: f64) -> Result<Scene, EnvironmentError> {
    let view = View::Target {
        depth_m: DEPTH_M,
        distance_m,
    };
    scene(&vehicle(), body, target, view)
}

/// Pictures from all distances at all levels, with the contrast that has no noise of paths.
fn shots(body: &WaterBody, target: &Target) -> Vec<Shot> {
    let vehicle = vehicle();
    let sensor = sensor(&vehicle, vehicle.exposure);
    let counts = response::CountResponse::new(&sensor);
    let pyramid = TexturePyramid::new(&target.texture, f64::from(target.pattern.tile_m()));
    let never = AtomicBool::new(false);
    let of_distance = |distance_m: f64| {
        let scene = view(body, target, distance_m).expect("a scene");
        let image = TargetImage::render(&scene, &pyramid, 21, 2048, &never);
        let image = image.expect("rendered").expect("not stopped");
        LEVELS_PCT.map(|light_pct| {
            let picture = image.picture(light_pct);
            let stored = Counts::stored(
                picture.width as usize,
                picture.height as usize,
                sensor.expose(&picture, 4).in_8_bit_counts(),
            );
            Shot {
                at: Candidate {
                    distance_m,
                    light_pct,
                },
                picture: LinearPicture::of_counts(&stored, Encoding::Srgb),
                contrast: image
                    .statistics(&counts, vehicle.exposure, light_pct)
                    .contrast,
            }
        })
    };
    DISTANCES_M.into_iter().flat_map(of_distance).collect()
}

fn tables(body: &WaterBody, pattern: Pattern) -> WaterTables {
    let even = Target {
        pattern,
        texture: even_texture(0.2),
    };
    let plan = TablePlan {
        distances_m: vec![0.6, 0.8, 1.1, 1.5, 2.1],
        depths_m: vec![DEPTH_M],
        reflectance: 0.2,
        paths_per_group: 4096,
        seed: 3,
    };
    water_tables(&plan, |_, distance_m| view(body, &even, distance_m)).expect("tables")
}

/// Mean absolute error over 15 counts of all predictions from all pictures, and the share within 90 % intervals.
fn errors(place: &Place, shots: &[Shot], sights: &[Sight]) -> (f64, f64) {
    let (mut sum, mut within, mut n) = (0.0, 0.0, 0.0);
    for here in shots {
        let now = (&here.at, here.contrast);
        let predictor = Predictor::new(place.clone(), &here.picture, now, sights);
        for there in shots {
            let found = predictor.contrast(&there.at);
            for k in 0..3 {
                let off = (found.counts[k] - there.contrast[k]).abs();
                sum += off / 15.0;
                within += f64::from(u8::from(off < 1.645 * found.error_counts[k]));
                n += 1.0;
            }
        }
    }
    (sum / n, within / n)
}

fn check(water: &str, backscatter_fraction: f64, pattern: Pattern, [alone, told]: [f64; 2]) {
    let body = WaterBody {
        jerlov: water.parse().expect("a water"),
        backscatter_fraction,
    };
    let target = Target::read(pattern, &assets_dir().expect("assets")).expect("a texture");
    let vehicle = vehicle();
    let tables = tables(&body, pattern);
    let noise = LinearNoise {
        a: vehicle.noise_a,
        b: vehicle.noise_b,
    };
    let response = CountResponse::new(Encoding::Srgb, noise);
    let place = Place {
        tables: &tables,
        response: &response,
        exposure: vehicle.exposure,
        daylight: [1.0; 3],
        lamps: [1.0; 3],
        depth_m: DEPTH_M,
        doubt: None,
    };
    let shots = shots(&body, &target);
    let sights: Vec<Sight> = (shots.iter().filter(|shot| shot.at.light_pct == 0.0))
        .map(|shot| Sight::new(&place, &shot.picture, &shot.at))
        .collect();
    let (off, within) = errors(&place, &shots, &[]);
    assert!(
        off < alone && within > 0.7,
        "{water}: {off} off, {within} within 90 % intervals"
    );
    let (off, within) = errors(&place, &shots, &sights);
    assert!(
        off < told && within > 0.8,
        "{water}: {off} off, {within} within 90 % intervals"
    );
}

/// In clear water, where the shipped network is off by 0.23 before an unseen texture (the paper prints 0.09), and in turbid water
/// (0.047 and 0.04): from one picture, and with sights of the target from a calibration's distances.
#[test]
fn contrast_is_predicted_before_a_target_of_which_nothing_was_learned() {
    check("IB-II@0.5", 0.0075, Pattern::ConcretePier, [0.03, 0.006]);
    check("3C-5C@0.5", 0.03, Pattern::CoralRock, [0.015, 0.007]);
}
