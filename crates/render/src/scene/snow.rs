//! `[water.snow]`: marine snow, and what of `[camera]` blurs its flakes alone.

use glam::DVec3;

use super::range::Range;
use super::reader::Table;
use super::{Blur, SceneError, Snow, camera_table, phase};

const FIELDS: [&str; 7] = [
    "share",
    "slope",
    "diameter_mm",
    "per_litre",
    "drift_m_s",
    "time_s",
    "seed",
];
/// Fields of `[camera]` that act on flakes alone.
pub(super) const BLUR_FIELDS: [&str; 2] = ["exposure_s", "velocity_m_s"];
/// Flakes in a litre by default, such as coastal surveys count of those of half a millimetre and more.
const DEFAULT_PER_LITRE: f64 = 20.0;
/// Default share of the once-scattered lamp light.
const DEFAULT_SHARE: f64 = 0.1;
/// Default slope of the sizes; images of natural waters give 3 to 3.6.
const DEFAULT_SLOPE: f64 = 3.3;
/// Default smallest and largest diameter, mm.
const DEFAULT_DIAMETER_MM: [f64; 2] = [0.3, 5.0];
/// Millimetres in a metre.
const MM: f64 = 1e3;
/// Litres in a cubic metre.
const LITRES: f64 = 1e3;
/// Largest speed along an axis, m/s: what floats and drives.
const SPEED: Range = Range::closed(-1e3, 1e3, "m/s");
/// Times at which flakes have moved by no more than their places can tell, s.
const TIME: Range = Range::closed(-1e6, 1e6, "s");

/// The snow of a scene, and warnings of what has no effect.
pub(super) fn read(root: &Table<'_>) -> Result<(Option<Snow>, Vec<String>), SceneError> {
    let blur = read_blur(root)?;
    let snow = match root.table("water", &phase::WATER_FIELDS)? {
        Some(water) => water.table("snow", &FIELDS)?,
        None => None,
    };
    let snow = snow.map(|table| read_snow(&table, blur.unwrap_or_default()));
    let snow = snow.transpose()?;
    let warning = blur.map(|_| match &snow {
        Some(_) => {
            "exposure_s and velocity_m_s of camera blur the flakes of water.snow alone; all else stays sharp"
        }
        None => {
            "exposure_s and velocity_m_s of camera have no effect without [water.snow], whose flakes they blur"
        }
    });
    Ok((snow, warning.map(str::to_owned).into_iter().collect()))
}

fn read_snow(table: &Table<'_>, blur: Blur) -> Result<Snow, SceneError> {
    let usual = Snow::default();
    let diameter = Range::closed(1e-3, 1e2, "mm");
    let diameter_m = match table.optional("diameter_mm") {
        None => usual.diameter_m,
        Some(value) => {
            let [smallest, largest]: [f64; 2] = value.as_numbers(diameter)?;
            if largest < smallest {
                return Err(value.invalid("[smallest, largest] diameter in mm"));
            }
            [smallest / MM, largest / MM]
        }
    };
    let per_litre = Range::closed(1e-6, 1e6, "flakes");
    Ok(Snow {
        share: table.number_or("share", Range::closed(0.0, 1.0, ""), usual.share)?,
        slope: table.number_or("slope", Range::closed(0.0, 10.0, ""), usual.slope)?,
        diameter_m,
        per_m3: LITRES * table.number_or("per_litre", per_litre, DEFAULT_PER_LITRE)?,
        drift_m_s: velocity(table, "drift_m_s")?,
        time_s: table.number_or("time_s", TIME, 0.0)?,
        seed: table
            .optional("seed")
            .map_or(Ok(usual.seed), |value| value.as_whole(0, u32::MAX, ""))?,
        blur,
    })
}

/// The blur of flakes; `None` where nothing of it is given, or nothing that moves or opens anything.
fn read_blur(root: &Table<'_>) -> Result<Option<Blur>, SceneError> {
    let Some(table) = root.table("camera", &camera_table::FIELDS)? else {
        return Ok(None);
    };
    let blur = Blur {
        exposure_s: table.number_or("exposure_s", Range::closed(0.0, 3600.0, "s"), 0.0)?,
        velocity_m_s: velocity(&table, "velocity_m_s")?,
    };
    Ok((blur != Blur::default()).then_some(blur))
}

/// A velocity, m/s; none where it is left out.
fn velocity(table: &Table<'_>, field: &str) -> Result<DVec3, SceneError> {
    let value = table.optional(field);
    let numbers = value.map_or(Ok([0.0; 3]), |value| value.as_numbers(SPEED))?;
    Ok(DVec3::from_array(numbers))
}

impl Default for Snow {
    /// What scene files have where they say nothing of it.
    fn default() -> Self {
        Self {
            share: DEFAULT_SHARE,
            slope: DEFAULT_SLOPE,
            diameter_m: DEFAULT_DIAMETER_MM.map(|mm| mm / MM),
            per_m3: LITRES * DEFAULT_PER_LITRE,
            drift_m_s: DVec3::ZERO,
            time_s: 0.0,
            seed: 1,
            blur: Blur::default(),
        }
    }
}
