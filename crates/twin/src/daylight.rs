//! K_z of a calibration: from its pictures that look up, or without them rendered for the water on Jerlov's scale whose daylight
//! falls alike.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use uw_assets::AssetError;
use uw_calib::{
    CalibrateError, Daylight, DaylightFit, RoutineOptions, check_manifest, fit_daylight,
};
use uw_media::{Iops, MediaError, WaterType, kirk_attenuation};

use crate::environment::{EnvironmentError, JerlovWater, Target, WATER_INDEX, WaterBody};
use crate::measure::Quality;
use crate::routine::{RoutineError, UP_DEPTHS_M, UP_SAMPLES, look_up, measure_depths};
use uw_assets::assets_dir;
use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;

/// What is known of the water where no picture looks up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// Its type.
    Jerlov(JerlovWater),
    /// Its diffuse attenuation of daylight per channel, 1/m, > 0; see [`attenuation`].
    Attenuation([f64; 3]),
    /// What the manifest's pictures tell.
    Nothing,
}

/// There is no K_z.
#[derive(Debug, thiserror::Error)]
pub enum DaylightError {
    /// The manifest or its pictures cannot be used.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// The water cannot be rendered.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The shipped files cannot be had.
    #[error(transparent)]
    Assets(#[from] AssetError),
    /// A render failed or was stopped.
    #[error(transparent)]
    Routine(#[from] RoutineError),
}

impl From<MediaError> for DaylightError {
    fn from(error: MediaError) -> Self {
        Self::Environment(error.into())
    }
}

/// A diffuse attenuation that was given as numbers, 1/m.
///
/// # Errors
/// They are not three finite numbers above 0.
pub fn attenuation(k_d: &[f64]) -> Result<[f64; 3], String> {
    match k_d {
        [r, g, b] if k_d.iter().all(|v| v.is_finite() && *v > 0.0) => Ok([*r, *g, *b]),
        _ => Err(format!(
            "must be three numbers > 0 (1/m, red, green, blue), got {k_d:?}"
        )),
    }
}

/// A water to be rendered where no picture looks up.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    jerlov: JerlovWater,
    depths_m: Vec<f64>,
    /// How the water was found, for the profile's note.
    from: String,
}

/// The water that has to stand for pictures that look up, of which the manifest at `manifest` has none; `None` where it has some.
///
/// # Errors
/// The manifest or its pictures cannot be used.
pub fn stand_in(
    manifest: &Path,
    options: &RoutineOptions,
    known: Known,
) -> Result<Option<Stand>, DaylightError> {
    if known != Known::Nothing {
        check_manifest(manifest, options, true)?;
    }
    let depths_m = UP_DEPTHS_M.to_vec();
    let stand = match known {
        Known::Jerlov(jerlov) => Stand {
            jerlov,
            depths_m,
            from: String::new(),
        },
        Known::Attenuation(k_d) => {
            let (jerlov, off) = nearest(k_d)?;
            let from = format!(", nearest to a given {}{off}", words(k_d));
            Stand {
                jerlov,
                depths_m,
                from,
            }
        }
        Known::Nothing => match fit_daylight(manifest, options)? {
            Some(fit) => of_fit(&fit, depths_m)?,
            None => return Ok(None),
        },
    };
    Ok(Some(stand))
}

/// The water whose daylight falls as in pictures of the target.
fn of_fit(fit: &DaylightFit, mut depths_m: Vec<f64>) -> Result<Stand, MediaError> {
    let DaylightFit {
        k_d_per_m: k_d,
        pictures,
        depths_m: [least, most],
        ..
    } = *fit;
    let (jerlov, off) = nearest(k_d)?;
    depths_m.retain(|&z| z < most);
    depths_m.push(most);
    Ok(Stand {
        jerlov,
        depths_m,
        from: format!(
            ", nearest to the {} of {pictures} pictures of the target with the lamps off, {least} to {most} m deep{off}",
            words(k_d)
        ),
    })
}

impl Stand {
    /// K_z as the project's routine finds it in this water with a backscatter fraction; `cancel` stops it.
    ///
    /// # Errors
    /// The water cannot be rendered, or a render failed or was stopped.
    pub fn render(
        &self,
        backscatter_fraction: f64,
        cancel: &AtomicBool,
    ) -> Result<Daylight, DaylightError> {
        let Self { jerlov, from, .. } = self;
        let water = WaterBody {
            jerlov: *jerlov,
            backscatter_fraction,
        };
        water.check()?;
        let vehicle = Vehicle::default();
        let target = Target::read(Pattern::HullRed, &assets_dir()?)?;
        let quality = Quality {
            samples_per_half: UP_SAMPLES,
            seed: 1,
            threads: None,
        };
        let (sensor, views) = look_up(&vehicle, &water, &target, &self.depths_m, quality, cancel)?;
        Ok(Daylight::Measured {
            depth: measure_depths(&sensor, &views),
            what: format!(
                "rendered for Jerlov {jerlov} water at a backscatter fraction of {backscatter_fraction}{from}"
            ),
        })
    }
}

fn words(k_d: [f64; 3]) -> String {
    let [r, g, b] = k_d.map(|k| format!("{k:.3}"));
    format!("K_d of {r}, {g}, {b} per m")
}

/// The water on Jerlov's scale, mixtures of neighbours included, with the diffuse attenuation nearest to `k_d` in logarithm,
/// and a remark where that is not near.
fn nearest(k_d: [f64; 3]) -> Result<(JerlovWater, String), MediaError> {
    let mut best = (JerlovWater::from(WaterType::I), f64::INFINITY);
    for water in JerlovWater::scale().into_iter().flatten() {
        let known = diffuse_attenuation(&water.iops()?);
        let off = (0..3).map(|k| (k_d[k].max(LEAST_K_D) / known[k]).ln().powi(2));
        let off = (off.sum::<f64>() / 3.0).sqrt();
        if off < best.1 {
            best = (water, off);
        }
    }
    let (water, off) = best;
    let remark = if off > FAR {
        format!(" (though not near: off by a factor of {:.1})", off.exp())
    } else {
        String::new()
    };
    Ok((water, remark))
}

/// Smallest K_d that is told from none, 1/m: below that of the clearest water.
const LEAST_K_D: f64 = 0.01;
/// Logarithm of the ratio beyond which a water is not near.
const FAR: f64 = 0.35;

/// K_d per channel by Kirk's formula, sqrt(a² + 0.256 a b) over the cosine of the default sun's zenith angle in water, 1/m;
/// within 12 % of the fall of rendered pictures with depth in IB, 1C and 5C.
fn diffuse_attenuation(iops: &Iops) -> [f64; 3] {
    let sine = Vehicle::default().sun_zenith_deg.to_radians().sin() / WATER_INDEX;
    let cosine = (1.0 - sine * sine).sqrt();
    std::array::from_fn(|k| kirk_attenuation(iops.a[k], iops.b[k]) / cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_water_is_found_again_by_its_attenuation() {
        for name in ["I", "IB", "III", "1C", "5C", "9C", "3C-5C@0.5"] {
            let water: JerlovWater = name.parse().expect("a water");
            let k_d = diffuse_attenuation(&water.iops().expect("coefficients"));
            let (found, remark) = nearest(k_d.map(|k| 1.02 * k)).expect("a water");
            let again = diffuse_attenuation(&found.iops().expect("coefficients"));
            for k in 0..3 {
                assert!((again[k] / k_d[k]).ln().abs() < 0.06, "{name} {found}");
            }
            assert_eq!(remark, "");
        }
        let (_, remark) = nearest([0.05, 0.9, 0.05]).expect("a water");
        assert!(remark.contains("not near"), "{remark}");
    }
}
