//! `uw calibrate`: pictures of a calibration routine -> profile.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use uw_calib::{
    Daylight, DaylightFit, Encoding, RoutineOptions, check_manifest, fit_daylight, from_manifest,
};
use uw_media::{Iops, WaterType};

use super::camera::CameraArguments;
use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::output;
use crate::assets::assets_dir;
use crate::environment::{Target, WATER_INDEX, WaterBody, WaterKind};
use crate::measure::Quality;
use crate::routine::{UP_DEPTHS_M, UP_SAMPLES, look_up, measure_depths};
use crate::scenery::textures::Pattern;
use crate::vehicle::Vehicle;

/// Arguments of `uw calibrate`.
#[derive(Debug, Args)]
#[command(after_help = NEEDS)]
pub(super) struct CalibrateArguments {
    /// CSV table of the pictures: file,kind,depth_m,distance_m,light_pct with kind `depth` or `contrast`.
    manifest: PathBuf,
    /// Profile to write (uw-profile/1).
    #[arg(short, long)]
    output: PathBuf,
    /// Lamp level of K_c on, percent; by default that with pictures from the most distances. Pictures at other levels are
    /// brought there in linear light.
    #[arg(long, value_name = "PCT")]
    light_pct: Option<f64>,
    /// Without pictures that look up: K_z of this Jerlov type (or mixture such as IB-II@0.4), rendered.
    #[arg(long, value_name = "TYPE", conflicts_with = "kd_per_m")]
    jerlov: Option<String>,
    /// Backscatter fraction of the water that is rendered where no picture looks up.
    #[arg(long, default_value_t = 0.0183)]
    backscatter_fraction: f64,
    /// Without pictures that look up: K_z of the water on Jerlov's scale with this diffuse attenuation of daylight, 1/m, red,
    /// green and blue.
    #[arg(long, value_name = "R,G,B", value_delimiter = ',')]
    kd_per_m: Option<Vec<f64>>,
    #[command(flatten)]
    camera: CameraArguments,
}

const NEEDS: &str = "\
What is needed, with one exposure for all pictures of a kind:
  kind contrast, light_pct 0      the target from several distances with the lamps off: K_c off
  kind contrast, light_pct > 0    the same with the lamps on, at one level or several: K_c on
  kind depth                      straight up from several depths: K_z, how daylight falls.
Without pictures that look up, K_z comes from pictures of the target with the lamps off at several depths (depth_m given, one
distance, at least 1 m apart), from --kd-per-m or from --jerlov: it is rendered for the water on Jerlov's scale whose daylight
falls alike. The profile's note then begins with \"approximate:\".";

impl CalibrateArguments {
    /// Measures the pictures and writes the profile.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let made_by = concat!("uw calibrate ", env!("CARGO_PKG_VERSION"));
        if let Some(level) = self.light_pct
            && !(level > 0.0 && level <= 100.0)
        {
            return Err(CliError::input(format_args!(
                "--light-pct must be above 0 and at most 100, got {level}"
            )));
        }
        let camera = self.camera.camera()?;
        let encoding = camera.encoding;
        let options = RoutineOptions {
            light_pct: self.light_pct,
            encoding,
            noise: camera.noise,
            rig: camera
                .vehicle
                .as_ref()
                .map(|vehicle| vehicle.rig(Some(vehicle.exposure)))
                .unwrap_or_default(),
            daylight: self.daylight(encoding)?,
        };
        let made = from_manifest(&self.manifest, made_by, &options).map_err(CliError::input)?;
        for warning in &made.warnings {
            note(format_args!("uw: warning: {warning}"));
        }
        made.profile.write(&self.output).map_err(CliError::failed)
    }

    /// Where K_z comes from; the manifest is looked through before anything is rendered.
    fn daylight(&self, encoding: Encoding) -> Result<Daylight, CliError> {
        if self.jerlov.is_some() || self.kd_per_m.is_some() {
            check_manifest(&self.manifest, true).map_err(CliError::input)?;
        }
        if let Some(jerlov) = &self.jerlov {
            let jerlov: WaterKind = jerlov
                .parse()
                .map_err(|e| CliError::input(format_args!("--jerlov: {e}")))?;
            return self.rendered(jerlov, &UP_DEPTHS_M, String::new());
        }
        if let Some(k_d) = &self.kd_per_m {
            let good = |v: &f64| v.is_finite() && *v > 0.0;
            let ([r, g, b], true) = (k_d.as_slice(), k_d.iter().all(good)) else {
                return Err(CliError::input(format_args!(
                    "--kd-per-m must be three numbers > 0 (1/m, red, green, blue), got {k_d:?}"
                )));
            };
            let k_d = [*r, *g, *b];
            let (jerlov, off) = nearest(k_d)?;
            let from = format!(", nearest to a given {}{off}", words(k_d));
            return self.rendered(jerlov, &UP_DEPTHS_M, from);
        }
        let fit = fit_daylight(&self.manifest, encoding).map_err(CliError::input)?;
        let Some(fit) = fit else {
            return Ok(Daylight::Pictures);
        };
        let DaylightFit {
            pictures,
            depths_m: [least, most],
            ..
        } = fit;
        let (jerlov, off) = nearest(fit.k_d_per_m)?;
        let from = format!(
            ", nearest to the {} of {pictures} pictures of the target with the lamps off, {least} to {most} m deep{off}",
            words(fit.k_d_per_m)
        );
        let mut depths_m: Vec<f64> = UP_DEPTHS_M.into_iter().filter(|&z| z < most).collect();
        depths_m.push(most);
        self.rendered(jerlov, &depths_m, from)
    }

    /// K_z as the project's routine finds it in a water of Jerlov's scale; `from` says how that was found.
    fn rendered(
        &self,
        jerlov: WaterKind,
        depths_m: &[f64],
        from: String,
    ) -> Result<Daylight, CliError> {
        let water = WaterBody {
            jerlov,
            backscatter_fraction: self.backscatter_fraction,
        };
        water.check().map_err(CliError::input)?;
        let vehicle = Vehicle::default();
        let assets = assets_dir().map_err(CliError::input)?;
        let target = Target::read(Pattern::HullRed, &assets).map_err(CliError::input)?;
        let quality = Quality {
            samples_per_half: UP_SAMPLES,
            seed: 1,
            threads: None,
        };
        let cancel = cancel_flag()?;
        let (sensor, views) = look_up(&vehicle, &water, &target, depths_m, quality, &cancel)
            .map_err(|e| match cancel.load(Ordering::Relaxed) {
                true => CliError::Interrupted("interrupted; nothing was written".into()),
                false => CliError::input(e),
            })?;
        let fraction = self.backscatter_fraction;
        Ok(Daylight::Measured {
            depth: measure_depths(&sensor, &views),
            what: format!(
                "rendered for Jerlov {jerlov} water at a backscatter fraction of {fraction}{from}"
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
fn nearest(k_d: [f64; 3]) -> Result<(WaterKind, String), CliError> {
    let mut best: Option<(WaterKind, f64)> = None;
    for pair in WaterType::ALL.windows(2) {
        // The ocean's types end where the coast's begin.
        let last = if pair[1] == WaterType::C1 { 0 } else { 10 };
        for tenths in 0..=last {
            let water = match tenths {
                0 => WaterKind::Type(pair[0]),
                10 => WaterKind::Type(pair[1]),
                tenths => WaterKind::Between {
                    from: pair[0],
                    to: pair[1],
                    share: f64::from(tenths) / 10.0,
                },
            };
            let known = diffuse_attenuation(&water.iops().map_err(CliError::failed)?);
            let off = (0..3).map(|k| (k_d[k].max(LEAST_K_D) / known[k]).ln().powi(2));
            let off = (off.sum::<f64>() / 3.0).sqrt();
            if best.is_none_or(|b| off < b.1) {
                best = Some((water, off));
            }
        }
    }
    let (water, off) = best.ok_or_else(|| CliError::failed("there are no water types"))?;
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
/// Kirk's share of scattering in K_d under a high sun (Limnol. Oceanogr. 29 (1984), 350).
const KIRK: f64 = 0.256;

/// K_d per channel by Kirk's formula, sqrt(a² + 0.256 a b) over the cosine of the default sun's zenith angle in water, 1/m;
/// within 12 % of the fall of rendered pictures with depth in IB, 1C and 5C.
fn diffuse_attenuation(iops: &Iops) -> [f64; 3] {
    let sine = Vehicle::default().sun_zenith_deg.to_radians().sin() / WATER_INDEX;
    let cosine = (1.0 - sine * sine).sqrt();
    std::array::from_fn(|k| {
        let (a, b) = (iops.a[k], iops.b[k]);
        (a * a + KIRK * a * b).sqrt() / cosine
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_water_is_found_again_by_its_attenuation() {
        for name in ["I", "IB", "III", "1C", "5C", "9C", "3C-5C@0.5"] {
            let water: WaterKind = name.parse().expect("a water");
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
