//! The vehicle's camera in the water that is set: images of the target, and the calibration routine.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use uw_calib::ContrastMeasurement;
use uw_calib::vehicle::Vehicle;
use uw_guidance::physics::Water;
use uw_media::WaterType;
use uw_render::scene::Scene;
use uw_twin::environment::{EnvironmentError, Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::{
    pyramid::TexturePyramid, response::CountResponse, target_image::TargetImage,
};
use uw_twin::measure::Quality;
use uw_twin::routine::{
    self, CONTRAST_DEPTH_M, CONTRAST_LIGHT_PCT, DISTANCES_M, RoutineError, UP_DEPTHS_M, UP_SAMPLES,
};

use super::look::{Film, Look, Seen, levels_pct};
use super::task::{Calibrated, ContrastErrors, GuidanceJob, Tables, VehiclePosition};

/// Who made a profile.
pub(super) const MADE_BY: &str = concat!("viewer ", env!("CARGO_PKG_VERSION"));

/// Why there are no images in water that differs from place to place: what spreads the sight of the target is known for water
/// of one kind, and the target stands in a world of its own, where the clouds of the scene are not.
pub const VARIES: &str = "The vehicle's images know water that is the same everywhere alone: switch off \"varies with depth\" and \
    remove the clouds in the water panel, or open a profile and a recording.";

/// Takes images; made once per task.
pub struct VehicleCamera<'a> {
    pub(super) job: &'a GuidanceJob,
    pub(super) cancel: &'a AtomicBool,
    target: Target,
    pyramid: TexturePyramid,
    response: CountResponse,
    /// The scene that is set, for its water, sun and sky.
    pub(super) set: Scene,
}

impl<'a> VehicleCamera<'a> {
    /// The camera for `job`.
    ///
    /// # Errors
    /// The target's texture cannot be read, the settings are not valid, or the water differs from place to place.
    pub fn new(job: &'a GuidanceJob, cancel: &'a AtomicBool) -> Result<Self, String> {
        if job.settings.water_varies() {
            return Err(VARIES.to_owned());
        }
        let target = Target::read(job.pattern, &job.assets).map_err(|e| e.to_string())?;
        let tile_m = f64::from(job.pattern.tile_m());
        Ok(Self {
            pyramid: TexturePyramid::new(&target.texture, tile_m),
            response: CountResponse::new(&sensor(&job.vehicle, job.vehicle.exposure)),
            set: job.settings.scene().map_err(|e| e.to_string())?,
            job,
            cancel,
            target,
        })
    }

    fn scene(&self, vehicle: &Vehicle, view: View) -> Result<Scene, RoutineError> {
        Ok(self.scene_of(vehicle, &self.target, view)?)
    }

    /// The scene of a view of `target` in the water that is set.
    pub(super) fn scene_of(
        &self,
        vehicle: &Vehicle,
        target: &Target,
        view: View,
    ) -> Result<Scene, EnvironmentError> {
        // The environment makes camera, lamps and target; its water gives way to the one that is set.
        let stand_in = WaterBody {
            jerlov: WaterType::ALL[0].into(),
            backscatter_fraction: 0.0183,
        };
        let mut made = scene(vehicle, &stand_in, target, view)?;
        made.water = self.set.water.clone();
        made.spectral = self.set.spectral.clone();
        made.sun = self.set.sun;
        made.sky_radiance = self.set.sky_radiance;
        Ok(made)
    }

    /// The image of the target from `place`.
    ///
    /// # Errors
    /// The water hides the target, or the task was ended.
    pub fn image(&self, position: VehiclePosition, seed: u64) -> Result<TargetImage, String> {
        let view = View::Target {
            depth_m: position.depth_m,
            distance_m: position.distance_m,
        };
        let scene = self
            .scene(&self.job.vehicle, view)
            .map_err(|e| e.to_string())?;
        TargetImage::render(&scene, &self.pyramid, seed, self.job.paths, self.cancel)
            .map_err(|e| e.to_string())?
            .ok_or_else(|| {
                format!(
                    "the target cannot be seen from {} m in this water: set clearer water",
                    position.distance_m
                )
            })
    }

    /// Statistics of the stored image at a lamp level.
    pub fn statistics(&self, image: &TargetImage, light_pct: f64) -> Seen {
        let exposure = self.job.vehicle.exposure;
        Seen {
            stats: image.statistics(&self.response, exposure, light_pct),
            errors: image.standard_errors(&self.response, exposure, light_pct),
        }
    }

    /// What is seen from `here` at every lamp level, for predictions with the tables of `water`.
    ///
    /// # Errors
    /// See [`VehicleCamera::image`].
    pub fn look(&self, here: VehiclePosition, water: Option<Arc<Water>>) -> Result<Look, String> {
        let image = self.image(here, 300)?;
        let at_levels = levels_pct()
            .into_par_iter()
            .map(|light_pct| self.statistics(&image, light_pct))
            .collect();
        Ok(Look::new(here, at_levels, self.film(&image), water))
    }

    fn film(&self, image: &TargetImage) -> Film {
        let vehicle = &self.job.vehicle;
        Film::new(image, sensor(vehicle, vehicle.exposure))
    }

    /// The routine of [`uw_twin::routine`] and the standard errors of its contrasts; `tell` hears how many of its images are done, of how many, and what is
    /// next.
    ///
    /// # Errors
    /// An image cannot be made, the images make no profile, or the task was ended.
    pub fn calibrate(&self, tell: &dyn Fn(usize, usize, String)) -> Result<Calibrated, String> {
        if self.set.sun.is_none() && self.set.sky_radiance == [0.0; 3] {
            return Err(
                "the routine needs daylight: switch on the sun in the water panel".to_owned(),
            );
        }
        let of = UP_DEPTHS_M.len() + DISTANCES_M.len();
        let quality = Quality {
            samples_per_half: UP_SAMPLES,
            seed: 0,
            threads: None,
        };
        let mut done = 0;
        let of_view = |vehicle: &Vehicle, view: View| {
            if let View::Up { depth_m } = view {
                tell(done, of, format!("looking up at {depth_m} m"));
            }
            done += 1;
            self.scene(vehicle, view)
        };
        let (up_sensor, ups) = routine::look_up_in(
            &self.job.vehicle,
            &UP_DEPTHS_M,
            quality,
            self.cancel,
            of_view,
        )
        .map_err(|e| e.to_string())?;
        let (mut contrast, mut errors) = (Vec::new(), ContrastErrors::default());
        let mut films = Vec::new();
        for (i, distance_m) in DISTANCES_M.into_iter().enumerate() {
            tell(
                UP_DEPTHS_M.len() + i,
                of,
                format!("contrast at {distance_m} m"),
            );
            let position = VehiclePosition {
                depth_m: CONTRAST_DEPTH_M,
                distance_m,
            };
            let image = self.image(position, 100 + i as u64)?;
            let of_levels = [(0.0, &mut errors.off), (CONTRAST_LIGHT_PCT, &mut errors.on)];
            for (light_pct, errors) in of_levels {
                let seen = self.statistics(&image, light_pct);
                contrast.push(ContrastMeasurement {
                    distance_m,
                    light_pct,
                    contrast: seen.stats.contrast,
                });
                errors.push((distance_m, seen.errors.contrast));
            }
            if !matches!(self.job.tables, Tables::Unasked) {
                films.push((distance_m, self.film(&image)));
            }
        }
        let depth = routine::measure_depths(&up_sensor, &ups);
        let profile = routine::profile(&depth, &contrast, MADE_BY).map_err(|e| e.to_string())?;
        let vehicle = &self.job.vehicle;
        let profile = profile.with_rig(vehicle.rig(Some(vehicle.exposure)));
        Ok(Calibrated {
            profile: Arc::new(profile),
            errors: Arc::new(errors),
            films,
        })
    }
}
