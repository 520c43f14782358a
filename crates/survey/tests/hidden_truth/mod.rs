//! Waters, lamps and targets drawn at random, and the calibration pictures that a vehicle takes there.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use uw_assets::assets_dir;
use uw_calib::vehicle::Vehicle;
use uw_media::WaterType;
use uw_media::spectral::{Response, WaterBands};
use uw_render::image::write_frame;
use uw_render::sampling::Draws;
use uw_render::scene::Sensor;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{JerlovWater, MEAN, Target, View, WaterBody, scene_in, sensor};
use uw_twin::estimate::pyramid::TexturePyramid;
use uw_twin::estimate::target_image::TargetImage;
use uw_twin::measure::Quality;
use uw_twin::routine::{UP_SAMPLES, look_up_in};

/// Distances of the pictures, m.
pub const DISTANCES_M: [f64; 6] = [0.5, 0.8, 1.2, 1.8, 2.5, 3.5];
/// Depths of the pictures that look up, m.
pub const UP_DEPTHS_M: [f64; 3] = [1.0, 2.0, 4.0];
/// Depth of the pictures in the dark, m.
pub const ABYSS_M: f64 = 400.0;
/// Lamp level of the pictures with the lamps on, percent.
pub const LIGHT_PCT: f64 = 60.0;
/// Paths per group of a picture: so many that its own noise is below what a fit tells.
const PATHS: u32 = 32_768;

/// A hidden truth.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Absorption per channel, 1/m.
    pub a: [f64; 3],
    /// Scattering per channel, 1/m.
    pub b: [f64; 3],
    /// The water it comes from, and its backscatter fraction.
    pub body: WaterBody,
    /// Lamps' light times exposure over those of the vehicle's file.
    pub gain: f64,
    /// Depth of the vehicle, m.
    pub depth_m: f64,
    /// The target.
    pub pattern: Pattern,
    /// How the water is rendered.
    pub bands: WaterBands,
    /// Paths per group of each picture.
    pub paths: u32,
    /// There is no daylight: the manifest has no pictures with the lamps off, and is of a place deeper than any of it reaches.
    pub dark: bool,
}

impl Truth {
    /// Scene `scene` of a series: water between two types, in three bands with its absorption and scattering shifted on their own;
    /// gain, depth and target.
    pub fn draw(seed: u64, scene: u32, bands: WaterBands) -> Result<Self, Box<dyn Error>> {
        let mut draws = Draws::new(seed, 77, scene, 0, 0);
        let mut u = || draws.uniform();
        let types = WaterType::ALL;
        let place = u() * 8.999;
        let first = place as usize;
        let body = WaterBody {
            jerlov: JerlovWater {
                from: types[first],
                to: types[first + 1],
                share: (100.0 * place.fract()).round() / 100.0,
            },
            backscatter_fraction: 0.006 * (0.05f64 / 0.006).powf(u()),
        };
        let iops = bands.iops(body.jerlov, &Response::boxes())?;
        // By wavelength the types stay as they are.
        let own = f64::from(u8::from(bands == MEAN));
        let mut shift = |most: f64| (own * most * (2.0 * u() - 1.0)).exp();
        let (of_a, of_b) = (shift(0.2), shift(0.4));
        Ok(Self {
            a: iops.a.map(|a| of_a * a),
            b: iops.b.map(|b| of_b * b),
            body,
            gain: 0.5 * 4f64.powf(u()),
            depth_m: 2.0 + 4.0 * u(),
            pattern: Pattern::ALL[(u() * Pattern::ALL.len() as f64) as usize],
            bands,
            paths: PATHS,
            dark: false,
        })
    }

    /// Takes the pictures of a calibration, which `vehicle` is, into `folder`; returns their manifest.
    pub fn take(
        &self,
        folder: &Path,
        vehicle: &Vehicle,
        seed: u64,
    ) -> Result<PathBuf, Box<dyn Error>> {
        let target = Target::read(self.pattern, &assets_dir()?)?;
        let pyramid = TexturePyramid::new(&target.texture, f64::from(target.pattern.tile_m()));
        let never = AtomicBool::new(false);
        let mut manifest = "file,kind,depth_m,distance_m,light_pct\n".to_owned();
        for (i, distance_m) in DISTANCES_M.into_iter().enumerate() {
            let view = View::Target {
                depth_m: self.depth_m,
                distance_m,
            };
            let mut scene = scene_in(vehicle, &self.body, self.bands, &target, view)?;
            if let (Some(water), true) = (&mut scene.water, self.bands == MEAN) {
                (water.iops.a, water.iops.b) = (self.a, self.b);
            }
            if self.dark {
                (scene.sun, scene.sky_radiance) = (None, [0.0; 3]);
            }
            let seed = 1000 * seed + i as u64;
            let image = TargetImage::render(&scene, &pyramid, seed, self.paths, &never)?;
            let image = image.ok_or("stopped")?;
            for (j, light_pct) in [0.0, LIGHT_PCT].into_iter().enumerate() {
                let picture = image.picture(self.gain * light_pct);
                let sensor = behind_lens(sensor(vehicle, vehicle.exposure), vehicle);
                let frame = sensor.expose(&picture, 2 * seed + j as u64);
                let name = format!("d{distance_m}_{light_pct}.png");
                write_frame(&folder.join(&name), &frame)?;
                let depth_m = if self.dark { ABYSS_M } else { self.depth_m };
                if light_pct > 0.0 || !self.dark {
                    writeln!(
                        manifest,
                        "{name},contrast,{depth_m},{distance_m},{light_pct}"
                    )?;
                }
            }
        }
        let path = folder.join("manifest.csv");
        std::fs::write(&path, manifest)?;
        Ok(path)
    }

    /// Takes pictures that look up, whose rows go to the end of `manifest`.
    #[allow(dead_code, reason = "the example has no use for it")]
    pub fn look_up(
        &self,
        manifest: &Path,
        vehicle: &Vehicle,
        seed: u64,
    ) -> Result<(), Box<dyn Error>> {
        let target = Target::read(self.pattern, &assets_dir()?)?;
        let quality = Quality {
            samples_per_half: UP_SAMPLES,
            seed,
            threads: None,
        };
        let never = AtomicBool::new(false);
        let of_view = |vehicle: &Vehicle, view: View| {
            let mut scene = scene_in(vehicle, &self.body, self.bands, &target, view)?;
            if let (Some(water), true) = (&mut scene.water, self.bands == MEAN) {
                (water.iops.a, water.iops.b) = (self.a, self.b);
            }
            Ok::<_, Box<dyn Error>>(scene)
        };
        let (sensor, views) = look_up_in(vehicle, &UP_DEPTHS_M, quality, &never, of_view)?;
        let mut rows = std::fs::read_to_string(manifest)?;
        for (depth_m, view) in &views {
            let frame = behind_lens(sensor, vehicle).expose(&view.picture(0.0), seed);
            let name = format!("up{depth_m}.png");
            write_frame(&manifest.with_file_name(&name), &frame)?;
            writeln!(rows, "{name},depth,{depth_m},,")?;
        }
        std::fs::write(manifest, rows)?;
        Ok(())
    }

    /// Whether the vehicle looks down.
    pub fn is_down(&self) -> Result<bool, Box<dyn Error>> {
        Ok(Target::read(self.pattern, &assets_dir()?)?.is_bottom())
    }
}

/// A vehicle's sensor behind its lens.
fn behind_lens(sensor: Sensor, vehicle: &Vehicle) -> Sensor {
    Sensor {
        vignetting: vehicle.vignetting,
        ..sensor
    }
}
