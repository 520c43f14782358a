//! Camera, sensor and lamps with which pictures were taken.
//!
//! Contrast depends on the number of pixels, on the exposure and on the lamps. Models and profiles say for which
//! they hold, so that a picture of another camera is told from one that fits. Everything is optional: what is not
//! stated is not compared.

use serde_json::{Map, Value};

use crate::json::{FieldError, Object};

/// Two stated numbers that differ by no more than this share are the same.
const SAME_SHARE: f64 = 0.02;

/// What is known of a camera, its sensor and its lamps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rig {
    /// Width of the pictures, pixels, whole, > 0.
    pub width_px: Option<f64>,
    /// Height of the pictures, pixels, whole, > 0.
    pub height_px: Option<f64>,
    /// Horizontal field of view, degrees, > 0.
    pub hfov_deg: Option<f64>,
    /// Linear signal per radiance, m² sr/W, > 0.
    pub exposure_m2_sr_per_w: Option<f64>,
    /// Variance of the linear signal y is `noise_a`·y + `noise_b`; >= 0.
    pub noise_a: Option<f64>,
    /// See `noise_a`.
    pub noise_b: Option<f64>,
    /// Number of lamps, whole, >= 0.
    pub lamps: Option<f64>,
    /// Sideways distance of the lamps from the camera, m, >= 0.
    pub lamp_offset_m: Option<f64>,
    /// Intensity of each lamp on its axis at 100 %, W/sr, > 0.
    pub lamp_intensity_w_per_sr: Option<f64>,
    /// Half angle of the lamps' cones, degrees, > 0.
    pub lamp_half_angle_deg: Option<f64>,
}

/// What a number has to be.
#[derive(Clone, Copy)]
enum Kind {
    /// A whole number of at least this.
    Whole(f64),
    Positive,
    NotNegative,
}

/// Object and name of a number in files, what it has to be, and the number.
type Entry<'a> = (&'static str, &'static str, Kind, &'a mut Option<f64>);

/// A number that two rigs state differently.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Where it stands in files, such as `camera.width_px`.
    pub field: String,
    /// The first rig's.
    pub first: f64,
    /// The second rig's.
    pub second: f64,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} {} against {}", self.field, self.first, self.second)
    }
}

impl Rig {
    /// Names of the objects that hold a rig in files.
    pub const SECTIONS: [&str; 3] = ["camera", "sensor", "lamps"];

    /// A rig of which only the size of the pictures is known, pixels.
    pub fn of_size([width_px, height_px]: [u32; 2]) -> Self {
        Self {
            width_px: Some(f64::from(width_px)),
            height_px: Some(f64::from(height_px)),
            ..Self::default()
        }
    }

    fn entries(&mut self) -> [Entry<'_>; 10] {
        use Kind::{NotNegative, Positive, Whole};
        [
            ("camera", "width_px", Whole(1.0), &mut self.width_px),
            ("camera", "height_px", Whole(1.0), &mut self.height_px),
            ("camera", "hfov_deg", Positive, &mut self.hfov_deg),
            (
                "sensor",
                "exposure_m2_sr_per_w",
                Positive,
                &mut self.exposure_m2_sr_per_w,
            ),
            ("sensor", "noise_a", NotNegative, &mut self.noise_a),
            ("sensor", "noise_b", NotNegative, &mut self.noise_b),
            ("lamps", "count", Whole(0.0), &mut self.lamps),
            ("lamps", "offset_m", NotNegative, &mut self.lamp_offset_m),
            (
                "lamps",
                "intensity_w_per_sr",
                Positive,
                &mut self.lamp_intensity_w_per_sr,
            ),
            (
                "lamps",
                "half_angle_deg",
                Positive,
                &mut self.lamp_half_angle_deg,
            ),
        ]
    }

    /// The objects `camera`, `sensor` and `lamps` of a document, each of which may be missing.
    pub fn read(document: &Object) -> Result<Self, FieldError> {
        let mut rig = Self::default();
        for section in Self::SECTIONS {
            if document.get(section).is_none() {
                continue;
            }
            let object = document.object(section)?;
            let mut known = Vec::new();
            for (of, name, kind, value) in rig.entries() {
                if of != section {
                    continue;
                }
                known.push(name);
                if object.get(name).is_some() {
                    *value = Some(kind.check(&object, name)?);
                }
            }
            object.only(&known)?;
        }
        Ok(rig)
    }

    /// The objects that [`Rig::read`] reads; empty ones are left out.
    pub fn to_json(&self) -> Map<String, Value> {
        let mut document = Map::new();
        for (section, name, kind, value) in { *self }.entries() {
            let Some(value) = *value else { continue };
            let value = match kind {
                Kind::Whole(_) => Value::from(value as u64),
                Kind::Positive | Kind::NotNegative => Value::from(value),
            };
            let object = document
                .entry(section)
                .or_insert_with(|| Value::Object(Map::new()));
            object[name] = value;
        }
        document
    }

    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Width and height of the pictures, pixels, where both are stated.
    pub fn size_px(&self) -> Option<[f64; 2]> {
        Some([self.width_px?, self.height_px?])
    }

    /// What both state and state differently: sizes and numbers of lamps exactly, all else by more than 2 %.
    pub fn differences(&self, other: &Self) -> Vec<Difference> {
        let (mut first, mut second) = (*self, *other);
        let both = first.entries().into_iter().zip(second.entries());
        both.filter_map(|((section, name, kind, x), (.., y))| {
            let (x, y) = ((*x)?, (*y)?);
            let same = match kind {
                Kind::Whole(_) => x == y,
                Kind::Positive | Kind::NotNegative => {
                    (x - y).abs() <= SAME_SHARE * x.abs().max(y.abs())
                }
            };
            (!same).then(|| Difference {
                field: format!("{section}.{name}"),
                first: x,
                second: y,
            })
        })
        .collect()
    }
}

impl Kind {
    fn check(self, object: &Object, name: &str) -> Result<f64, FieldError> {
        let value = object.number(name)?;
        let (right, expected) = match self {
            Self::Whole(least) => (
                value >= least && value.fract() == 0.0 && value <= f64::from(u32::MAX),
                format!("a whole number >= {least}"),
            ),
            Self::Positive => (value > 0.0, "> 0".to_owned()),
            Self::NotNegative => (value >= 0.0, ">= 0".to_owned()),
        };
        match right {
            true => Ok(value),
            false => Err(FieldError::out_of_range(
                object.path_of(name),
                expected,
                value,
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn rig(document: Value) -> Result<Rig, FieldError> {
        Rig::read(&Object::new(&document, "").unwrap())
    }

    #[test]
    fn what_is_written_is_read_and_what_is_unstated_is_left_out() {
        let full = Rig {
            width_px: Some(1280.0),
            height_px: Some(720.0),
            hfov_deg: Some(60.0),
            exposure_m2_sr_per_w: Some(8.61),
            noise_a: Some(2e-4),
            noise_b: Some(0.0),
            lamps: Some(2.0),
            lamp_offset_m: Some(0.3),
            lamp_intensity_w_per_sr: Some(0.4),
            lamp_half_angle_deg: Some(50.0),
        };
        assert_eq!(rig(Value::Object(full.to_json())).unwrap(), full);
        let size = Rig::of_size([240, 135]);
        assert_eq!(
            Value::Object(size.to_json()),
            json!({"camera": {"width_px": 240, "height_px": 135}})
        );
        assert!(rig(json!({})).unwrap().is_empty());
    }

    #[test]
    fn only_what_both_state_is_compared() {
        let model = rig(
            json!({"camera": {"width_px": 1280, "height_px": 720, "hfov_deg": 60},
                               "sensor": {"exposure_m2_sr_per_w": 8.61}}),
        )
        .unwrap();
        assert_eq!(model.differences(&Rig::default()), []);
        assert_eq!(model.differences(&Rig::of_size([1280, 720])), []);
        let near = rig(json!({"camera": {"hfov_deg": 60.5}})).unwrap();
        assert_eq!(model.differences(&near), []);
        let small =
            rig(json!({"camera": {"width_px": 1279}, "sensor": {"exposure_m2_sr_per_w": 8}}))
                .unwrap();
        let told: Vec<String> = model
            .differences(&small)
            .iter()
            .map(Difference::to_string)
            .collect();
        assert_eq!(
            told,
            [
                "camera.width_px 1280 against 1279",
                "sensor.exposure_m2_sr_per_w 8.61 against 8"
            ]
        );
    }

    #[test]
    fn wrong_values_are_named() {
        let cases = [
            (json!({"camera": {"width_px": 12.5}}), "camera.width_px"),
            (json!({"camera": {"width": 12}}), "camera.width"),
            (
                json!({"lamps": {"half_angle_deg": 0}}),
                "lamps.half_angle_deg",
            ),
            (json!({"sensor": 1}), "sensor"),
        ];
        for (document, field) in cases {
            assert_eq!(rig(document).unwrap_err().field, field);
        }
    }
}
