//! Predictions by physics in the water that is set, against renders.

use std::sync::Arc;
use std::time::{Duration, Instant};

use uw_calib::vehicle::Vehicle;
use uw_guidance::Candidate;
use uw_guidance::physics::{ResidualFrom, Water};
use uw_scenery::textures::Pattern;
use uw_viewer::guidance::sightings::{Sighting, Sightings};
use uw_viewer::guidance::task::{Done, GuidanceJob, Tables, Task, VehiclePosition, Work};
use uw_viewer::guidance::{Check, Look};
use uw_viewer::model::{Coefficients, OpenScene, Settings, WaterBands};

use crate::support::{PATIENCE, repository, small};

const DEPTH_M: f64 = 3.0;

fn at(distance_m: f64) -> VehiclePosition {
    VehiclePosition {
        depth_m: DEPTH_M,
        distance_m,
    }
}

/// What a task brings in the water of `settings`.
fn done(settings: &Settings, work: Work, tables: Tables) -> Vec<Done> {
    let job = GuidanceJob {
        work,
        settings: settings.clone(),
        pattern: Pattern::ConcretePier,
        paths: 512,
        vehicle: Vehicle {
            width: 640,
            height: 360,
            ..Vehicle::default()
        },
        assets: repository().join("assets"),
        tables,
    };
    let mut task = Task::start(job, || ()).expect("a thread");
    let mut all = Vec::new();
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        match task.done() {
            Some(Done::All) => return all,
            Some(Done::Failed(why)) => panic!("{why}"),
            Some(done) => all.push(done),
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    }
    panic!("{work:?} takes too long");
}

fn look(settings: &Settings, distance_m: f64, tables: Tables) -> Arc<Look> {
    let work = Work::Look {
        here: at(distance_m),
    };
    let of_look = |done| match done {
        Done::Looked(look) => Some(look),
        _ => None,
    };
    let mut brought = done(settings, work, tables).into_iter();
    brought.find_map(of_look).expect("a look")
}

fn rendered(settings: &Settings, at: Candidate) -> Check {
    let work = Work::Check {
        there: self::at(at.distance_m),
        light_pct: at.light_pct,
    };
    let of_check = |done| match done {
        Done::Checked(check) => Some(check),
        _ => None,
    };
    let mut brought = done(settings, work, Tables::Unasked).into_iter();
    brought.find_map(of_check).expect("a render")
}

fn sighting(sightings: &mut Sightings, look: &Arc<Look>, light_pct: f64) -> Sighting {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if let Some(found) = sightings.of(look, light_pct, || ()) {
            return found;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("a picture takes too long");
}

/// The opening scene, whose light goes by wavelength.
fn reef() -> Settings {
    let path = repository().join("assets/scenes/reef.toml");
    OpenScene::read(&path).expect("shipped").1
}

/// From one image, nearer, farther and under other lamps.
#[test]
fn physics_predicts_what_is_rendered_in_three_bands_and_by_wavelength() {
    for (name, settings) in [("small", small().1), ("reef", reef())] {
        let look = look(&settings, 1.5, Tables::Make);
        let found = sighting(&mut Sightings::default(), &look, 20.0).present;
        assert_eq!(found.told(), [true; 3], "{name}");
        for (distance_m, light_pct) in [(1.5, 0.0), (1.5, 100.0), (0.9, 20.0), (2.2, 60.0)] {
            let there = Candidate {
                distance_m,
                light_pct,
            };
            let (predicted, check) = (found.contrast(&there), rendered(&settings, there));
            for k in 0..3 {
                let off = (predicted.counts[k] - check.rendered[k]).abs();
                let error = predicted.error_counts[k].hypot(check.error[k]);
                // From one image contrast farther off is known to 0.07 of 15 counts (docs/physics.md).
                assert!(
                    off < 3.0 * error && off < 1.0,
                    "{name}, {distance_m} m, {light_pct} %: {predicted:?} {check:?}"
                );
            }
        }
    }
}

fn tables_of(settings: &Settings) -> Arc<Water> {
    let look = look(settings, 1.0, Tables::Make);
    Arc::clone(look.water.as_ref().expect("tables"))
}

/// Two images of one target tell whether the tables are of this water.
#[test]
fn an_image_from_elsewhere_counts_too_and_tells_of_a_wrong_water() {
    let settings = reef();
    let mut other = settings.clone();
    // The place of 3C on Jerlov's scale.
    let coefficients = Coefficients::Jerlov {
        scale: 6.0,
        bands: WaterBands::Spectral,
    };
    other.water.as_mut().expect("water").coefficients = coefficients;
    let misfit = |water: Arc<Water>| {
        let mut sightings = Sightings::default();
        let far = look(&settings, 2.0, Tables::Known(Arc::clone(&water)));
        let first = sighting(&mut sightings, &far, 20.0);
        assert!(first.residual.is_none() && first.present.earlier_m().is_empty());
        let near = look(&settings, 1.0, Tables::Known(water));
        let second = sighting(&mut sightings, &near, 20.0);
        assert_eq!(second.present.earlier_m(), [2.0]);
        let residual = second.residual.expect("of the first");
        assert_eq!(residual.from, ResidualFrom::Picture);
        residual.misfit
    };
    let (right, wrong) = (misfit(tables_of(&settings)), misfit(tables_of(&other)));
    assert!(right < 1.0 && wrong > 1.0, "{right} {wrong}");
}
