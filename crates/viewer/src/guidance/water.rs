//! The water that is set as physics knows it: tables of what it does to the vehicle's pictures.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use uw_calib::vehicle::Vehicle;
use uw_guidance::Candidate;
use uw_guidance::physics::file::{WATER_FORMAT, WaterNumbers};
use uw_guidance::physics::{LinearPicture, Sight, Water, WaterFile};
use uw_media::phase::PhaseFunction as _;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{Target, View, is_bottom};
use uw_twin::estimate::water_tables::{
    TablePlan, TablesError, USUAL_REFLECTANCE, even_texture, sensor_numbers, spaced_distances_m,
    water_tables_watched,
};
use uw_twin::routine::{CONTRAST_DEPTH_M, CONTRAST_LIGHT_PCT, DISTANCES_M};

use super::camera::{MADE_BY, VehicleCamera};
use super::look::Film;
use crate::model::{Settings, WaterAndSky};

/// Distances of the tables between the nearest and the farthest of the calibration.
const VIEWS: u32 = 8;
/// Depths of their daylight, m; the light at others lies between. A wall ends at the surface, so that those begin deeper from which a camera sees past it.
const DEPTHS_M: [f64; 3] = [1.0, 3.0, 6.0];
/// How far below the surface the picture of a wall has to end, as a share of the depth.
const BELOW_SURFACE: f64 = 0.02;
/// Paths of a view of the tables for each of an image.
const PATHS: u32 = 4;
/// Of the paths of tables, and of the noise of the calibration's images.
const SEED: u64 = 400;

/// A water whose tables are made.
#[derive(Clone, Debug)]
pub struct KnownWater {
    /// What they were made for.
    pub made_for: MadeFor,
    /// The tables.
    pub water: Arc<Water>,
}

/// What tables are made for: with anything else of it other ones are needed.
#[derive(Clone, Debug, PartialEq)]
pub struct MadeFor {
    water_and_sky: WaterAndSky,
    vehicle: Vehicle,
    /// Whether the vehicle looks down at the bottom.
    bottom: bool,
}

impl MadeFor {
    /// The water of `settings` before the camera of `vehicle`.
    pub fn new(settings: &Settings, vehicle: &Vehicle, pattern: Pattern) -> Self {
        Self {
            water_and_sky: settings.water_and_sky(),
            vehicle: vehicle.clone(),
            bottom: is_bottom(pattern),
        }
    }
}

impl VehicleCamera<'_> {
    /// The tables of the water that is set; `tell` hears what share of them is done.
    ///
    /// # Errors
    /// A view shows more than the target, the renderer fails, or the task was ended.
    pub fn water(&self, tell: &(dyn Fn(f64) + Sync)) -> Result<WaterFile, TablesError> {
        let even = Target {
            pattern: self.job.pattern,
            texture: even_texture(USUAL_REFLECTANCE),
        };
        let plan = TablePlan {
            distances_m: spaced_distances_m(
                DISTANCES_M[0],
                DISTANCES_M[DISTANCES_M.len() - 1],
                VIEWS,
            ),
            depths_m: depths_m(&self.job.vehicle, even.is_bottom()),
            reflectance: USUAL_REFLECTANCE,
            paths_per_group: PATHS * self.job.paths,
            seed: SEED,
        };
        let scene = |depth_m: f64, distance_m: f64| {
            let view = View::Target {
                depth_m,
                distance_m,
            };
            self.scene_of(&self.job.vehicle, &even, view)
        };
        let tables = water_tables_watched(&plan, scene, |share| {
            tell(share);
            !self.cancel.load(Ordering::Relaxed)
        })?;
        let vehicle = &self.job.vehicle;
        Ok(WaterFile {
            format: WATER_FORMAT.to_owned(),
            made_by: MADE_BY.to_owned(),
            water: self.numbers(),
            sensor: sensor_numbers(vehicle, vehicle.encoding),
            tables,
            sights: Vec::new(),
            fit: None,
        })
    }

    fn numbers(&self) -> WaterNumbers {
        let iops = self.set.water.as_ref().map(|water| water.iops);
        let phase = self.set.water.as_ref().map(|water| &water.phase);
        WaterNumbers {
            a_per_m: iops.map_or([0.0; 3], |iops| iops.a),
            b_per_m: iops.map_or([0.0; 3], |iops| iops.b),
            backscatter_fraction: phase.map_or(0.0, |phase| phase.backscatter_fraction()),
        }
    }
}

/// Depths of the tables, rising, m.
fn depths_m(vehicle: &Vehicle, is_bottom: bool) -> Vec<f64> {
    let half_view = (0.5 * vehicle.hfov_deg.to_radians()).tan() * f64::from(vehicle.height)
        / f64::from(vehicle.width);
    let farthest_m = DISTANCES_M[DISTANCES_M.len() - 1];
    let least_m = match is_bottom {
        true => 0.0,
        false => half_view * farthest_m / (1.0 - BELOW_SURFACE),
    };
    let mut depths_m: Vec<f64> = DEPTHS_M
        .iter()
        .map(|depth_m| depth_m.max(least_m))
        .collect();
    depths_m.dedup();
    depths_m
}

/// The target as a calibration saw it, from distances in m, lamps off and on.
pub fn sights(file: &WaterFile, films: &[(f64, Film)]) -> Vec<Sight> {
    let response = file.sensor.response();
    let place = file.place(&response, CONTRAST_DEPTH_M);
    let shots: Vec<(&(f64, Film), f64)> = films
        .iter()
        .flat_map(|film| [0.0, CONTRAST_LIGHT_PCT].map(|light_pct| (film, light_pct)))
        .collect();
    let sight = |(i, (film, light_pct)): (usize, &(&(f64, Film), f64))| {
        let (distance_m, film) = film;
        let here = Candidate {
            distance_m: *distance_m,
            light_pct: *light_pct,
        };
        let counts = film.stored(*light_pct, SEED + i as u64);
        let picture = LinearPicture::of_counts(&counts, file.sensor.encoding);
        Sight::new(&place, &picture, &here)
    };
    shots.par_iter().enumerate().map(sight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_begin_where_a_camera_sees_no_more_than_the_wall() {
        assert_eq!(depths_m(&Vehicle::default(), false), DEPTHS_M);
        let mut wide = Vehicle {
            width: 640,
            height: 480,
            hfov_deg: 80.0,
            ..Vehicle::default()
        };
        let found = depths_m(&wide, false);
        let reach_m = 3.0 * 40f64.to_radians().tan() * 0.75;
        assert!(found[0] > reach_m && found[0] < 1.03 * reach_m, "{found:?}");
        assert_eq!(found[1..], [3.0, 6.0]);
        assert_eq!(depths_m(&wide, true), DEPTHS_M);
        wide.hfov_deg = 120.0;
        assert_eq!(depths_m(&wide, false).len(), 2);
    }
}
