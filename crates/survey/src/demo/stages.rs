//! The renders of the demonstration.

use std::fmt::Write;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_calib::{ContrastMeasurement, ImageStats, Profile};
use uw_guidance::Observation;
use uw_render::image::{write_bytes, write_frame};
use uw_render::integrator::RenderError;
use uw_render::scene::Sensor;

use super::{DemoError, Visit, ask::Connection, pairs};
use uw_calib::vehicle::Vehicle;
use uw_twin::environment::{Target, View, WaterBody, scene, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::response::CountResponse;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::measure::{Quality, RenderedView};
use uw_twin::routine::{
    self, CONTRAST_DEPTH_M, CONTRAST_LIGHT_PCT, DISTANCES_M, TARGET_PATHS, UP_DEPTHS_M, UP_SAMPLES,
};

/// Where the vehicle is when it asks: depth in m, distance in m, lamp level in percent.
pub(super) const VISITS: [(f64, f64, f64); 3] =
    [(1.0, 2.5, 100.0), (3.0, 1.0, 0.0), (5.0, 2.0, 33.0)];

/// What all renders share.
pub(super) struct DemoRenders<'a> {
    pub(super) vehicle: Vehicle,
    pub(super) water: WaterBody,
    pub(super) target: Target,
    pub(super) pyramid: TexturePyramid,
    pub(super) response: CountResponse,
    pub(super) seed: u64,
    pub(super) threads: Option<usize>,
    pub(super) folder: &'a Path,
    pub(super) cancel: &'a AtomicBool,
}

impl DemoRenders<'_> {
    fn quality(&self, samples_per_half: u32, seed: u64) -> Quality {
        Quality {
            samples_per_half,
            seed: self.seed.wrapping_mul(10_007).wrapping_add(seed),
            threads: self.threads,
        }
    }

    fn sensor(&self) -> Sensor {
        sensor(&self.vehicle, self.vehicle.exposure)
    }

    fn look(&self, depth_m: f64, distance_m: f64, seed: u64) -> Result<TargetImage, DemoError> {
        let view = View::Target {
            depth_m,
            distance_m,
        };
        let scene = scene(&self.vehicle, &self.water, &self.target, view)?;
        let seed = self.quality(0, seed).seed;
        TargetImage::render(&scene, &self.pyramid, seed, TARGET_PATHS, self.cancel)
            .map_err(|e| DemoError::Input(e.to_string()))?
            .ok_or(DemoError::Render(RenderError::Incomplete {
                rows: 0,
                total: 0,
            }))
    }

    fn write_target(
        &self,
        name: &str,
        image: &TargetImage,
        light_pct: f64,
    ) -> Result<(), DemoError> {
        let frame = self.sensor().expose(&image.picture(light_pct), self.seed);
        Ok(write_frame(&self.folder.join(name), &frame)?)
    }

    fn measure(&self, image: &TargetImage, light_pct: f64) -> ImageStats {
        image.statistics(&self.response, self.vehicle.exposure, light_pct)
    }

    fn write_picture(
        &self,
        name: &str,
        view: &RenderedView,
        sensor: &Sensor,
        light_pct: f64,
    ) -> Result<(), DemoError> {
        let frame = sensor.expose(&view.picture(light_pct), self.seed);
        Ok(write_frame(&self.folder.join(name), &frame)?)
    }

    /// Renders the routine, writes its pictures with a manifest, and makes the profile.
    pub(super) fn calibrate(&self) -> Result<Profile, DemoError> {
        let quality = self.quality(UP_SAMPLES, 0);
        let (up_sensor, ups) = routine::look_up(
            &self.vehicle,
            &self.water,
            &self.target,
            &UP_DEPTHS_M,
            quality,
            self.cancel,
        )?;
        let mut manifest = "file,kind,depth_m,distance_m,light_pct\n".to_owned();
        for (depth_m, view) in &ups {
            let file = format!("up_{depth_m}m.png");
            self.write_picture(&format!("calibration/{file}"), view, &up_sensor, 0.0)?;
            // Writing to a string cannot fail.
            let _ = writeln!(manifest, "{file},depth,{depth_m},,0");
        }
        let mut contrast = Vec::new();
        for (i, &distance_m) in DISTANCES_M.iter().enumerate() {
            let image = self.look(CONTRAST_DEPTH_M, distance_m, 100 + i as u64)?;
            for light_pct in [0.0, CONTRAST_LIGHT_PCT] {
                let file = format!("target_{distance_m}m_{light_pct}pct.png");
                self.write_target(&format!("calibration/{file}"), &image, light_pct)?;
                contrast.push(ContrastMeasurement {
                    distance_m,
                    light_pct,
                    contrast: self.measure(&image, light_pct).contrast,
                });
                let _ = writeln!(
                    manifest,
                    "{file},contrast,{CONTRAST_DEPTH_M},{distance_m},{light_pct}"
                );
            }
        }
        self.write_text("calibration/manifest.csv", &manifest)?;
        let depth = routine::measure_depths(&up_sensor, &ups);
        let profile = routine::profile(
            &depth,
            &contrast,
            concat!("uw demo ", env!("CARGO_PKG_VERSION")),
        )?
        .with_rig(self.vehicle.rig(Some(self.vehicle.exposure)));
        let path = self.folder.join("profile.json");
        profile.write(&path).map_err(|e| DemoError::Output {
            path: path.display().to_string(),
            reason: e.to_string(),
        })?;
        Ok(profile)
    }

    /// Visits each place: looks, asks the daemon at `address`, follows its suggestion, looks again. Physics needs the picture, a network its
    /// numbers, which here have no noise of paths.
    pub(super) fn visit(
        &self,
        address: SocketAddr,
        by_physics: bool,
        tell: &dyn Fn(&str),
    ) -> Result<Vec<Visit>, DemoError> {
        let mut visits = Vec::new();
        for (i, (depth_m, distance_m, light_pct)) in VISITS.into_iter().enumerate() {
            let seed = 200 + 10 * i as u64;
            let before = self.look(depth_m, distance_m, seed)?;
            let stats = self.measure(&before, light_pct);
            let picture = format!("depth_{depth_m}m_before.png");
            self.write_target(&picture, &before, light_pct)?;
            let observation = Observation {
                depth_m,
                distance_m,
                light_pct,
                mean: stats.mean,
                std: stats.contrast,
                quality: None,
            };
            let mut connection = Connection::to(address)?;
            let picture = by_physics.then_some(&picture[..]);
            let suggestion = connection.suggest(&observation, picture)?;
            for warning in &suggestion.warnings {
                tell(&format!("    warning: {}", warning.message));
            }
            let there = suggestion.distance_m;
            let candidates = [
                (distance_m, light_pct),
                (there, 0.0),
                (there, 100.0),
                (there, suggestion.light_pct),
            ];
            let choices = connection.predict(&observation, &candidates)?;
            let after = self.look(depth_m, suggestion.distance_m, seed + 1)?;
            let contrast_after = self.measure(&after, suggestion.light_pct).contrast;
            let name = format!("depth_{depth_m}m_after.png");
            self.write_target(&name, &after, suggestion.light_pct)?;
            tell(&format!(
                "    {depth_m} m deep: from {distance_m} m at {light_pct} % to {:.2} m at {:.0} %",
                suggestion.distance_m, suggestion.light_pct
            ));
            let visit = Visit {
                depth_m,
                distance_m,
                light_pct,
                contrast_before: stats.contrast,
                suggestion,
                choices,
                contrast_after,
            };
            pairs::write(
                &self.folder.join(format!("depth_{depth_m}m.png")),
                &self.folder.join(format!("depth_{depth_m}m_before.png")),
                &self.folder.join(name),
                &visit,
            )?;
            visits.push(visit);
        }
        Ok(visits)
    }

    fn write_text(&self, name: &str, text: &str) -> Result<(), DemoError> {
        write_text(&self.folder.join(name), text)
    }
}

/// Writes a text file whole or not at all.
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), DemoError> {
    Ok(write_bytes(path, text.as_bytes())?)
}
