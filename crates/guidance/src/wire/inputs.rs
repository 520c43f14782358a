//! The fields of a request that describe the vehicle's state.

use uw_calib::Processing;
use uw_calib::json::{FieldError, Object, array, number};

use crate::beams::MAX_BEAMS;
use crate::feed::Picture;
use crate::observation::Quality;

/// Names of these fields, for lists of what a request may hold.
pub(super) const FIELDS: [&str; 16] = [
    "depth_m",
    "distance_m",
    "distances_m",
    "light_pct",
    "level_pct",
    "mean",
    "std",
    "width",
    "height",
    "std_corrected",
    "noise_floor",
    "saturated",
    "sun_zenith_deg",
    "sun_azimuth_deg",
    "age_s",
    "time_s",
];

/// Largest age that can be given, s: a year.
const MAX_AGE_S: f64 = 365.0 * 86_400.0;

/// When the values were measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stamp {
    /// As the message arrived.
    #[default]
    Now,
    /// This long before, s, >= 0.
    Age(f64),
    /// At this time, s since 1970 (UTC) on the daemon's own clock.
    Time(f64),
}

/// A distance as it was given.
#[derive(Clone, Debug, PartialEq)]
pub enum Distance {
    /// Along the optical axis, m.
    Axis(f64),
    /// Along each beam, m; `None` without an echo.
    Beams(Vec<Option<f64>>),
}

/// What a request says about the state; what is left out comes from the feed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Depth, m.
    pub depth_m: Option<f64>,
    /// Distance.
    pub distance: Option<Distance>,
    /// The lamps' light, percent of full.
    pub light_pct: Option<f64>,
    /// What the lamps are set to, percent, in the place of `light_pct`.
    pub level_pct: Option<f64>,
    /// Image statistics.
    pub picture: Option<Picture>,
    /// The sun, where it is known. Not kept for later requests.
    pub sun: SunSeen,
    /// When all of these were measured.
    pub stamp: Stamp,
}

/// What of the sun is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SunSeen {
    /// Zenith angle in air, degrees, in [0, 90).
    pub zenith_deg: Option<f64>,
    /// Azimuth towards which its light travels, against the horizontal direction in which the camera looks (of a camera that looks down:
    /// the upper edge of its picture), degrees, in [-360, 360]: 0 has the sun behind the camera.
    pub azimuth_deg: Option<f64>,
}

impl Inputs {
    /// Whether nothing is given but a time.
    pub fn is_empty(&self) -> bool {
        self.depth_m.is_none()
            && self.distance.is_none()
            && self.light_pct.is_none()
            && self.level_pct.is_none()
            && self.picture.is_none()
    }

    /// The fields of a request object.
    pub(super) fn read(object: &Object) -> Result<Self, FieldError> {
        let percent = |name: &str| {
            optional(object, name, |v| {
                ((0.0..=100.0).contains(&v), "from 0 to 100 percent")
            })
        };
        let (light_pct, level_pct) = (percent("light_pct")?, percent("level_pct")?);
        if light_pct.is_some() && level_pct.is_some() {
            return Err(FieldError::invalid(
                object.path_of("level_pct"),
                "absent where light_pct is given",
                "both",
            ));
        }
        Ok(Self {
            depth_m: optional(object, "depth_m", |v| (v >= 0.0, ">= 0 m"))?,
            distance: read_distance(object)?,
            light_pct,
            level_pct,
            picture: read_picture(object)?,
            sun: SunSeen {
                zenith_deg: optional(object, "sun_zenith_deg", |v| {
                    ((0.0..90.0).contains(&v), "from 0 to below 90 degrees")
                })?,
                azimuth_deg: optional(object, "sun_azimuth_deg", |v| {
                    ((-360.0..=360.0).contains(&v), "from -360 to 360 degrees")
                })?,
            },
            stamp: read_stamp(object)?,
        })
    }
}

/// A number that may be missing, checked by whether it is acceptable and what would be.
fn optional(
    object: &Object,
    name: &str,
    check: impl Fn(f64) -> (bool, &'static str),
) -> Result<Option<f64>, FieldError> {
    if object.get(name).is_none() {
        return Ok(None);
    }
    let value = object.number(name)?;
    match check(value) {
        (true, _) => Ok(Some(value)),
        (false, expected) => Err(FieldError::out_of_range(
            object.path_of(name),
            expected,
            value,
        )),
    }
}

fn read_distance(object: &Object) -> Result<Option<Distance>, FieldError> {
    let axis = optional(object, "distance_m", |v| (v > 0.0, "> 0 m"))?;
    let Some(value) = object.get("distances_m") else {
        return Ok(axis.map(Distance::Axis));
    };
    let path = object.path_of("distances_m");
    if axis.is_some() {
        let expected = "absent where distance_m is given";
        return Err(FieldError::invalid(path, expected, "both"));
    }
    let items = array(value, &path)?;
    if items.is_empty() || items.len() > MAX_BEAMS {
        let expected = format!("a list of 1 to {MAX_BEAMS} ranges");
        return Err(FieldError::out_of_range(path, expected, items.len()));
    }
    let range = |(k, item): (usize, &serde_json::Value)| {
        if item.is_null() {
            return Ok(None);
        }
        let field = format!("{path}[{k}]");
        let range_m = number(item, &field)?;
        if range_m > 0.0 {
            Ok(Some(range_m))
        } else {
            let expected = "> 0 m, or null without an echo";
            Err(FieldError::out_of_range(field, expected, range_m))
        }
    };
    let ranges = items
        .iter()
        .enumerate()
        .map(range)
        .collect::<Result<_, _>>()?;
    Ok(Some(Distance::Beams(ranges)))
}

fn read_picture(object: &Object) -> Result<Option<Picture>, FieldError> {
    let size_px = read_size(object)?;
    if object.get("mean").is_none() && object.get("std").is_none() {
        let alone = |name: &str| {
            let field = object.path_of(name);
            let expected = "absent without mean and std";
            Err(FieldError::invalid(
                field,
                expected,
                format!("{name} alone"),
            ))
        };
        return match PICTURE_FIELDS
            .iter()
            .find(|name| object.get(name).is_some())
        {
            None => Ok(None),
            Some(name) => alone(name),
        };
    }
    let counts = |name: &str| -> Result<[f64; 3], FieldError> {
        let values = object.numbers(name)?;
        match values.iter().position(|v| !(0.0..=255.0).contains(v)) {
            None => Ok(values),
            Some(k) => {
                let field = format!("{}[{k}]", object.path_of(name));
                let expected = "from 0 to 255 8-bit counts";
                Err(FieldError::out_of_range(field, expected, values[k]))
            }
        }
    };
    Ok(Some(Picture {
        mean: counts("mean")?,
        std: counts("std")?,
        size_px,
        quality: read_quality(object)?,
    }))
}

/// What may stand with mean and std.
pub(super) const PICTURE_FIELDS: [&str; 5] = [
    "width",
    "height",
    "std_corrected",
    "noise_floor",
    "saturated",
];

/// Contrast without noise, noise floor and share of clipped pixels; all or none.
fn read_quality(object: &Object) -> Result<Option<Quality>, FieldError> {
    let names = &PICTURE_FIELDS[2..];
    if names.iter().all(|name| object.get(name).is_none()) {
        return Ok(None);
    }
    let quality = Quality {
        std_corrected: object.numbers("std_corrected")?,
        noise_floor: object.numbers("noise_floor")?,
        saturated: object.numbers("saturated")?,
        processing: Processing::default(),
    };
    quality.check()?;
    Ok(Some(quality))
}

/// Width and height of the picture that mean and contrast are of, pixels; both or none.
fn read_size(object: &Object) -> Result<Option<[u32; 2]>, FieldError> {
    let side = |name: &str| {
        let value = object.required(name)?;
        let side = value.as_u64().and_then(|side| u32::try_from(side).ok());
        side.filter(|&side| side > 0).ok_or_else(|| {
            let expected = "a whole number of pixels > 0";
            FieldError::wrong_type(object.path_of(name), expected, value)
        })
    };
    match (object.get("width"), object.get("height")) {
        (None, None) => Ok(None),
        _ => Ok(Some([side("width")?, side("height")?])),
    }
}

fn read_stamp(object: &Object) -> Result<Stamp, FieldError> {
    let age = optional(object, "age_s", |v| {
        ((0.0..=MAX_AGE_S).contains(&v), "from 0 s to a year")
    })?;
    let time = optional(object, "time_s", |v| {
        ((0.0..=1e11).contains(&v), "seconds since 1970")
    })?;
    match (age, time) {
        (None, None) => Ok(Stamp::Now),
        (Some(age_s), None) => Ok(Stamp::Age(age_s)),
        (None, Some(time_s)) => Ok(Stamp::Time(time_s)),
        (Some(_), Some(_)) => Err(FieldError::invalid(
            object.path_of("time_s"),
            "absent where age_s is given",
            "both",
        )),
    }
}
