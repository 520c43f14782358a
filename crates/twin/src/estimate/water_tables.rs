//! Tables of what a water does to a vehicle's pictures, for predictions by physics (`uw_guidance::physics`).
//!
//! Veil and light come from the renderer's unbiased paths, fitted smooth over the image ([`super::fields`]), the share and spread of
//! scattered rays from walks ([`super::spread`]): all of an image but its target, which is even and grey here.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use uw_calib::Encoding;
use uw_calib::stats::{PATCH_COLUMNS, PATCH_ROWS};
use uw_guidance::card::Sun;
use uw_guidance::physics::WaterTables;
use uw_guidance::physics::file::{SensorNumbers, WaterNumbers};
use uw_guidance::physics::water::{Field, SourceTables, ViewTables};
use uw_media::{Iops, WaterType};
use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::scene::{Scene, Texture, TextureFilter};

use super::fields::{FieldSampler, Fields, GROUPS};
use super::pyramid::TexturePyramid;
use super::radiance::Source;
use super::spread::ScatteredWaves;
use super::target_model::{TargetModel, daylight_alone, lamps_alone};
use super::target_view::{BeyondTarget, Sight};
use crate::environment::{EnvironmentError, Target, View, WaterBody, scene};
use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;

/// Texels of the even target.
const TEXELS: u32 = 16;

/// Where lamps' tables are made in the dark, m: far enough below the surface that nothing of it is seen.
const DARK_DEPTH_M: f64 = 30.0;

/// Mean reflectance that targets are taken to have where nothing is known of them: some of their light comes back to them.
pub const USUAL_REFLECTANCE: f32 = 0.2;

/// Distances from `near_m` to `far_m`, evenly spaced by their logarithm; `views`, at least 2.
pub fn spaced_distances_m(near_m: f64, far_m: f64, views: u32) -> Vec<f64> {
    let step = (far_m / near_m).ln() / f64::from(views - 1);
    (0..views)
        .map(|i| near_m * (f64::from(i) * step).exp())
        .collect()
}

/// What tables are made with.
#[derive(Clone, Debug)]
pub struct TablePlan {
    /// Distances along the optical axis, m, rising, at least two.
    pub distances_m: Vec<f64>,
    /// Depths of daylight, m, rising; none in the dark.
    pub depths_m: Vec<f64>,
    /// Reflectance of the even target.
    pub reflectance: f32,
    /// Paths of each of eight groups, per source and view.
    pub paths_per_group: u32,
    /// Of all random numbers.
    pub seed: u64,
}

impl TablePlan {
    /// Where the lamps' tables are made, m: the surface throws some of their light back.
    fn lamps_depth_m(&self) -> f64 {
        let middle = self.depths_m.get(self.depths_m.len() / 2);
        middle.copied().unwrap_or(DARK_DEPTH_M)
    }
}

/// Why there are no tables.
#[derive(Debug, thiserror::Error)]
pub enum TablesError {
    /// A view would show more than the target.
    #[error("{depth_m} m deep, {distance_m:.2} m away: {source}")]
    BeyondTarget {
        /// Depth, m.
        depth_m: f64,
        /// Distance, m.
        distance_m: f64,
        /// What is wrong.
        source: BeyondTarget,
    },
    /// A scene cannot be made.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The renderer failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The fit has no solution.
    #[error("the paths of a view are too few for a fit")]
    TooFewPaths,
    /// They are not wanted any more.
    #[error("stopped")]
    Stopped,
}

/// Waves on the target, cycles per metre: octaves.
pub fn frequencies_per_m() -> Vec<f64> {
    (-2..=10).map(|octave| 2f64.powi(octave)).collect()
}

/// An even target of `reflectance`.
pub fn even_texture(reflectance: f32) -> Texture {
    Texture {
        width: TEXELS,
        height: TEXELS,
        texels: vec![[reflectance; 3]; (TEXELS * TEXELS) as usize].into(),
        filter: TextureFilter::Bilinear,
    }
}

/// A water of given coefficients before an even target of a vehicle.
#[derive(Clone, Debug)]
pub struct KnownWater {
    /// Absorption and scattering per channel.
    pub iops: Iops,
    /// Share of the light that is scattered back by particles of the usual index.
    pub backscatter_fraction: f64,
    /// The vehicle looks down at the bottom rather than ahead at a wall.
    pub bottom: bool,
    /// Reflectance of the target.
    pub reflectance: f32,
}

impl KnownWater {
    /// What `vehicle` sees of the target, in three bands.
    ///
    /// # Errors
    /// There is no such phase function.
    pub fn scene(
        &self,
        vehicle: &Vehicle,
        depth_m: f64,
        distance_m: f64,
    ) -> Result<Scene, EnvironmentError> {
        let view = View::Target {
            depth_m,
            distance_m,
        };
        self.scene_of(vehicle, view)
    }

    /// The same for any view.
    ///
    /// # Errors
    /// As [`KnownWater::scene`].
    pub fn scene_of(&self, vehicle: &Vehicle, view: View) -> Result<Scene, EnvironmentError> {
        let target = Target {
            pattern: match self.bottom {
                true => Pattern::Seabed,
                false => Pattern::HullRed,
            },
            texture: even_texture(self.reflectance),
        };
        // Its coefficients are put in the place of the type's.
        let body = WaterBody {
            jerlov: WaterType::II.into(),
            backscatter_fraction: self.backscatter_fraction,
        };
        let mut scene = scene(vehicle, &body, &target, view)?;
        if let Some(water) = &mut scene.water {
            water.iops = self.iops;
        }
        Ok(scene)
    }

    /// The water as water files have it.
    pub fn numbers(&self) -> WaterNumbers {
        WaterNumbers {
            a_per_m: self.iops.a,
            b_per_m: self.iops.b,
            backscatter_fraction: self.backscatter_fraction,
        }
    }
}

/// The camera of `vehicle` as water files have it, whose counts have an `encoding`.
pub fn sensor_numbers(vehicle: &Vehicle, encoding: Encoding) -> SensorNumbers {
    SensorNumbers {
        width_px: vehicle.width as usize,
        height_px: vehicle.height as usize,
        encoding,
        exposure_m2_sr_per_w: vehicle.exposure,
        noise_a: vehicle.noise_a,
        noise_b: vehicle.noise_b,
        vignetting: vehicle.vignetting,
    }
}

/// The tables of views that `scene` makes from a depth and a distance, both in m; each must show nothing but one quad, square on,
/// with [`even_texture`].
///
/// # Errors
/// A view shows more than the target, or the renderer fails.
pub fn water_tables(
    plan: &TablePlan,
    scene: impl Fn(f64, f64) -> Result<Scene, EnvironmentError> + Sync,
) -> Result<WaterTables, TablesError> {
    water_tables_watched(plan, scene, |_| true)
}

/// The same; `goes_on` hears before each source of each view what share of them is done, in [0, 1), from any thread, and says whether to go on.
///
/// # Errors
/// A view shows more than the target, the renderer fails, or it was to stop.
pub fn water_tables_watched(
    plan: &TablePlan,
    scene: impl Fn(f64, f64) -> Result<Scene, EnvironmentError> + Sync,
    goes_on: impl Fn(f64) -> bool + Sync,
) -> Result<WaterTables, TablesError> {
    let first = scene(plan.lamps_depth_m(), plan.distances_m[0])?;
    let camera = &first.camera;
    let half_view = [
        0.5 * f64::from(camera.width) / camera.focal_px.x,
        0.5 * f64::from(camera.height) / camera.focal_px.y,
    ];
    let begun = AtomicUsize::new(0);
    let of = plan.distances_m.len() * (1 + plan.depths_m.len());
    let begin = || match goes_on(begun.fetch_add(1, Ordering::Relaxed) as f64 / of as f64) {
        true => Ok(()),
        false => Err(TablesError::Stopped),
    };
    let views: Result<Vec<ViewTables>, TablesError> = plan
        .distances_m
        .par_iter()
        .map(|&distance_m| view(plan, distance_m, &scene, &begin))
        .collect();
    Ok(WaterTables {
        half_view,
        frequencies_per_m: frequencies_per_m(),
        depths_m: plan.depths_m.clone(),
        sun: sun(&first).filter(|_| !plan.depths_m.is_empty()),
        views: views?,
    })
}

/// The sun of a scene against where its camera looks, or of one that looks down against the upper edge of its picture.
fn sun(scene: &Scene) -> Option<Sun> {
    let (camera, towards) = (&scene.camera, scene.sun.as_ref()?.travel_direction);
    let is_level = camera.forward.truncate().length() > camera.down.truncate().length();
    let ahead = match is_level {
        true => camera.forward,
        false => -camera.down,
    };
    let azimuth = towards.y.atan2(towards.x) - ahead.y.atan2(ahead.x);
    let (sin, cos) = azimuth.sin_cos();
    Some(Sun {
        zenith_deg: (-towards.z / towards.length())
            .clamp(0.0, 1.0)
            .acos()
            .to_degrees(),
        azimuth_deg: sin.atan2(cos).to_degrees(),
    })
}

fn view(
    plan: &TablePlan,
    distance_m: f64,
    scene: &(impl Fn(f64, f64) -> Result<Scene, EnvironmentError> + Sync),
    begin: &(impl Fn() -> Result<(), TablesError> + Sync),
) -> Result<ViewTables, TablesError> {
    begin()?;
    let pyramid = TexturePyramid::new(&even_texture(plan.reflectance), 1.0);
    let beyond = |depth_m: f64| {
        move |source| TablesError::BeyondTarget {
            depth_m,
            distance_m,
            source,
        }
    };
    let middle_m = plan.lamps_depth_m();
    let middle = scene(middle_m, distance_m)?;
    let prepared = Prepared::build(&lamps_alone(&middle));
    let model = TargetModel::new(&middle, &prepared, &pyramid, true, plan.seed)
        .map_err(beyond(middle_m))?;
    let lamps = source_tables(plan, &middle, &prepared, &model.lamps())?;
    let mut daylight = Vec::new();
    for &depth_m in &plan.depths_m {
        begin()?;
        let scene = scene(depth_m, distance_m)?;
        let model = model.at(&scene, &prepared).map_err(beyond(depth_m))?;
        let alone = Prepared::build(&daylight_alone(&scene));
        daylight.push(source_tables(plan, &scene, &alone, &model.daylight())?);
    }
    Ok(ViewTables {
        distance_m,
        lamps,
        daylight,
    })
}

fn source_tables(
    plan: &TablePlan,
    scene: &Scene,
    prepared: &Prepared,
    source: &Source,
) -> Result<SourceTables, TablesError> {
    let mut sampler = FieldSampler::new(source, prepared, plan.seed)?;
    sampler.extend_to(plan.paths_per_group)?;
    let fields = sampler.fit().ok_or(TablesError::TooFewPaths)?;
    let frequencies = frequencies_per_m();
    let waves = match (&scene.water, &prepared.medium) {
        (Some(water), Some(medium)) => Some(ScatteredWaves::new(
            water,
            &medium.phase,
            source.view,
            (source.guess, None),
            &frequencies,
            plan.seed,
        )),
        _ => None,
    };
    let (veil, irradiance) = fields.mean_of(0, GROUPS);
    let basis = Fields::basis(source.lamps, source.symmetric);
    let polynomial = |coefficients: &[f64], (p, q): (f64, f64)| {
        let mut values = vec![0.0; basis.len()];
        basis.values(p, q, &mut values);
        let terms = values.iter().zip(coefficients);
        terms.map(|(value, c)| value * c).sum::<f64>().max(0.0)
    };
    let (width, height) = source.view.size_px();
    let field = |of: &dyn Fn(usize, f64, f64) -> f64| -> Field {
        std::array::from_fn(|k| {
            let patch = |i: usize| {
                let (column, row) = (i % PATCH_COLUMNS, i / PATCH_COLUMNS);
                let x = width * (column as f64 + 0.5) / PATCH_COLUMNS as f64;
                let y = height * (row as f64 + 0.5) / PATCH_ROWS as f64;
                of(k, x, y)
            };
            (0..PATCH_COLUMNS * PATCH_ROWS).map(patch).collect()
        })
    };
    let view = source.view;
    let at = |x: f64, y: f64| view.unit_coordinates(x, y);
    let sight = |x: f64, y: f64| view.sight(x, y);
    Ok(SourceTables {
        veil: field(&|k, x, y| polynomial(&veil[k], at(x, y))),
        light: field(&|k, x, y| {
            let guess = sight(x, y).map_or(0.0, |s| source.guess.at(s.point)[k]);
            guess * polynomial(&irradiance[k], at(x, y))
        }),
        straight: field(&|k, x, y| {
            sight(x, y).map_or(0.0, |s| source.spread.unscattered(&s).transmittance[k])
        }),
        scattered: field(&|k, x, y| {
            let share = |s: Sight| {
                let cosine = view.incidence(s.direction);
                waves.as_ref().map_or(0.0, |waves| waves.share(cosine)[k])
            };
            sight(x, y).map_or(0.0, share)
        }),
        transfer: match waves {
            Some(waves) => waves.transfer,
            None => std::array::from_fn(|_| vec![1.0; frequencies.len()]),
        },
    })
}
