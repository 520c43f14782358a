//! A water and a target with all views of them, rendered on demand and kept on disk.
//!
//! Daylight and lamps are rendered apart. Renders of one class (leg and distance) take the same number of samples: a
//! pilot render at the first station tells the variance of one sample, and the number is chosen so that the noise of
//! the render stays below a multiple of the noise of the sensor; [`super::reconstruct`] takes most of the rest away.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use uw_calib::Profile;
use uw_render::scene::{Scene, Sensor};
use uw_twin::environment::{self, EnvironmentError, Target, View as Look, WaterBody};
use uw_twin::measure::Quality;
use uw_twin::routine;

use super::config::{OperationConfig, WaterConfig};
use super::render::{Job, Source, render_view};
use super::view::View;
use crate::error::EvalError;

/// Which view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ViewKey {
    /// Depth, mm.
    pub depth_mm: u32,
    /// Station along the leg.
    pub station: usize,
    /// Distance, mm.
    pub distance_mm: u32,
}

impl ViewKey {
    /// The view at a depth and a distance in metres.
    pub fn new(depth_m: f64, station: usize, distance_m: f64) -> Self {
        let millimetres = |m: f64| (1000.0 * m).round() as u32;
        Self {
            depth_mm: millimetres(depth_m),
            station,
            distance_mm: millimetres(distance_m),
        }
    }

    fn file_name(&self) -> String {
        format!(
            "z{:05}_s{:03}_d{:05}.exr",
            self.depth_mm, self.station, self.distance_mm
        )
    }

    fn depth_m(&self) -> f64 {
        f64::from(self.depth_mm) / 1000.0
    }

    fn distance_m(&self) -> f64 {
        f64::from(self.distance_mm) / 1000.0
    }
}

/// A water, a target, a vehicle and the folder of their views.
pub struct Site<'a> {
    config: &'a OperationConfig,
    /// The water's entry in the configuration.
    pub water: &'a WaterConfig,
    body: WaterBody,
    target: &'a Target,
    /// The sensor that looks at the target.
    pub sensor: Sensor,
    folder: PathBuf,
    threads: Option<usize>,
    samples: HashMap<(u32, u32), [u32; 2]>,
    views: HashMap<ViewKey, Arc<View>>,
}

impl<'a> Site<'a> {
    /// A site whose views are kept in `folder`, which is made where it is missing.
    pub fn new(
        config: &'a OperationConfig,
        water: &'a WaterConfig,
        target: &'a Target,
        folder: &Path,
        threads: Option<usize>,
    ) -> Result<Self, EvalError> {
        std::fs::create_dir_all(folder).map_err(|e| EvalError::output(folder, e))?;
        Ok(Self {
            config,
            water,
            body: water.body().map_err(EvalError::Input)?,
            target,
            sensor: environment::sensor(&config.vehicle, config.vehicle.exposure),
            folder: folder.to_path_buf(),
            threads,
            samples: HashMap::new(),
            views: HashMap::new(),
        })
    }

    /// The view, from memory, from disk, or rendered now.
    pub fn view(&mut self, key: ViewKey, cancel: &AtomicBool) -> Result<Arc<View>, EvalError> {
        if let Some(view) = self.views.get(&key) {
            return Ok(Arc::clone(view));
        }
        let path = self.folder.join(key.file_name());
        if !path.exists() {
            self.render(key, cancel)?.write(&path)?;
        }
        // Also a new view is read back: its file holds half floats, and every run shall see the same ones.
        let view = View::read(&path)?;
        let view = Arc::new(view);
        self.views.insert(key, Arc::clone(&view));
        Ok(view)
    }

    /// A view that has been asked for before.
    pub fn known(&self, key: ViewKey) -> Option<&Arc<View>> {
        self.views.get(&key)
    }

    /// Processor time of all views used so far, s, also of those rendered by an earlier run.
    pub fn render_cpu_s(&self) -> f64 {
        self.views.values().map(|v| v.record.cpu_s).sum()
    }

    /// Number of views used so far.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// Mean number of samples per pixel of the views used so far, daylight and lamps together.
    pub fn mean_samples(&self) -> f64 {
        let samples = |v: &Arc<View>| v.record.samples.iter().map(|&n| f64::from(n)).sum::<f64>();
        self.views.values().map(samples).sum::<f64>() / self.views.len().max(1) as f64
    }

    fn render(&mut self, key: ViewKey, cancel: &AtomicBool) -> Result<View, EvalError> {
        let samples = self.samples_of_class(key, cancel)?;
        let job = Job {
            samples,
            seed: self.seed(key),
            threads: self.threads,
            cancel,
        };
        render_view(&self.scene(key)?, &self.sensor, &job)
    }

    /// Whether the target is a bottom that the vehicle looks down at.
    pub fn is_bottom(&self) -> bool {
        self.target.is_bottom()
    }

    /// Position across the legs on the target of the leg at a depth, m: the depth itself on an upright target, the lane
    /// over a bottom.
    pub fn across_m(&self, depth_m: f64) -> f64 {
        if self.target.is_bottom() {
            super::track::lane_m(self.config, depth_m)
        } else {
            depth_m
        }
    }

    /// Seed of a view's renders, another one for every view of the operation.
    fn seed(&self, key: ViewKey) -> u64 {
        let water = self.config.water.iter().position(|w| w == self.water);
        let parts = [
            self.config.seed,
            water.unwrap_or(0) as u64,
            u64::from(key.depth_mm),
            key.station as u64,
            u64::from(key.distance_mm),
        ];
        super::seed_of(&parts)
    }

    fn scene(&self, key: ViewKey) -> Result<Scene, EnvironmentError> {
        let look = Look::Target {
            depth_m: key.depth_m(),
            distance_m: key.distance_m(),
        };
        let mut scene = environment::scene(&self.config.vehicle, &self.body, self.target, look)?;
        // The leg's middle lies before the target's middle; over a bottom every leg has its own lane.
        let along_m = super::along_m(self.config, key.depth_m(), key.station);
        let mut shift = along_m * scene.camera.right;
        if self.target.is_bottom() {
            shift += super::track::lane_m(self.config, key.depth_m()) * scene.camera.down;
        }
        scene.camera.position_m += shift;
        scene
            .lamps
            .iter_mut()
            .for_each(|lamp| lamp.position_m += shift);
        Ok(scene)
    }

    fn samples_of_class(
        &mut self,
        key: ViewKey,
        cancel: &AtomicBool,
    ) -> Result<[u32; 2], EvalError> {
        let class = (key.depth_mm, key.distance_mm);
        if let Some(&samples) = self.samples.get(&class) {
            return Ok(samples);
        }
        let quality = self.config.quality;
        if quality.least_samples == quality.most_samples {
            return Ok([quality.most_samples; 2]);
        }
        let pilot = ViewKey { station: 0, ..key };
        let job = Job {
            samples: [quality.pilot_samples; 2],
            seed: !self.seed(pilot),
            threads: self.threads,
            cancel,
        };
        let scene = self.scene(pilot)?;
        let mut samples = [0; 2];
        for source in [Source::Daylight, Source::Lamps] {
            let share = job.noise_share(&scene, source, &self.sensor)?;
            let wanted = f64::from(quality.pilot_samples) * (share / quality.noise_share).powi(2);
            samples[source as usize] =
                (wanted.ceil() as u32).clamp(quality.least_samples, quality.most_samples);
        }
        self.samples.insert(class, samples);
        Ok(samples)
    }

    /// The calibration profile, from views of the first station.
    pub fn profile(&mut self, cancel: &AtomicBool) -> Result<Profile, EvalError> {
        let calibration = &self.config.calibration;
        let mut contrast = Vec::new();
        for &distance_m in &calibration.distances_m {
            let key = ViewKey::new(calibration.contrast_depth_m, 0, distance_m);
            let view = self.view(key, cancel)?;
            for light_pct in [0.0, calibration.light_pct] {
                contrast.push(uw_calib::ContrastMeasurement {
                    distance_m,
                    light_pct,
                    contrast: view.contrast(light_pct),
                });
            }
        }
        let quality = Quality {
            samples_per_half: calibration.up_samples_per_half,
            seed: super::seed_of(&[self.config.seed, 77]),
            threads: self.threads,
        };
        let (sensor, views) = routine::look_up(
            &self.config.vehicle,
            &self.body,
            self.target,
            &calibration.depths_m,
            quality,
            cancel,
        )?;
        let depth = routine::measure_depths(&sensor, &views);
        let made_by = concat!("uweval ", env!("CARGO_PKG_VERSION"));
        Ok(routine::profile(&depth, &contrast, made_by)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_tell_the_view() {
        let key = ViewKey::new(2.33, 7, 0.75);
        assert_eq!(key.file_name(), "z02330_s007_d00750.exr");
        assert_eq!((key.depth_m(), key.distance_m()), (2.33, 0.75));
    }
}
