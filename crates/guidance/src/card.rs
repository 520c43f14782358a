//! What a model file says about where its network can be trusted: the range of every input in training, the camera
//! and lamps, the textures, waters and daylight it has seen, and how closely it meets what it knows.
//!
//! All of it is optional, as older files and other people's have none of it.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use uw_calib::Rig;
use uw_calib::json::{FieldError, Object, array};

use crate::features::Feature;

/// What is known about the training of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Card {
    /// Smallest and largest value of each input in training, in the model's order and the inputs' units.
    pub ranges: Option<Vec<[f64; 2]>>,
    /// Camera, sensor and lamps of the pictures it learnt from.
    pub rig: Rig,
    /// What the pictures showed.
    pub training: Training,
}

/// What the pictures showed that a network learnt from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Training {
    /// Rows of the table that ranges and residuals are of.
    pub rows: Option<u64>,
    /// Names of the targets' textures.
    pub textures: Vec<String>,
    /// Jerlov types of the waters, or mixtures of two.
    pub water_types: Vec<String>,
    /// The one sun.
    pub sun: Option<Sun>,
    /// Residuals at the present place.
    pub residual_here: Option<NormalResidual>,
}

/// The sun of the training pictures, or of a water's tables.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sun {
    /// Zenith angle in air, degrees, in [0, 90).
    pub zenith_deg: f64,
    /// Azimuth towards which its light travels, against the horizontal direction in which the camera looks at an upright
    /// target, degrees: 0 has the sun behind the camera, 180 behind the target.
    pub azimuth_deg: f64,
}

impl Sun {
    /// Angle between the directions of two suns' light in air, degrees.
    pub fn apart_deg(&self, other: &Self) -> f64 {
        let [one, two] = [self, other].map(|sun| sun.zenith_deg.to_radians());
        let turn = (self.azimuth_deg - other.azimuth_deg).to_radians();
        let cosine = one.cos() * two.cos() + one.sin() * two.sin() * turn.cos();
        cosine.clamp(-1.0, 1.0).acos().to_degrees()
    }
}

/// Misfits ([`Residual::misfit`](crate::checks::Residual)) of a network over the pictures it learnt from, when nothing
/// is to change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalResidual {
    /// Half of the pictures have less.
    pub median: f64,
    /// 99 of 100 have less.
    pub p99: f64,
}

/// Fields of a model file that belong to the card, besides `min` and `max` of the inputs.
pub(crate) const FIELDS: [&str; 4] = ["camera", "sensor", "lamps", "training"];

impl Card {
    /// The card of a model file with these inputs.
    pub(crate) fn read(document: &Object, inputs: &[&'static Feature]) -> Result<Self, FieldError> {
        Ok(Self {
            ranges: read_ranges(document, inputs)?,
            rig: Rig::read(document)?,
            training: match document.get("training") {
                None => Training::default(),
                Some(_) => Training::read(&document.object("training")?)?,
            },
        })
    }

    /// What cannot be checked for want of a statement, in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.ranges.is_none() {
            warnings.push(
                "the model states no range of its inputs (min and max): advice outside its training goes unnoticed"
                    .to_owned(),
            );
        }
        if self.rig.size_px().is_none() {
            warnings.push(
                "the model states no camera: pictures of another size go unnoticed".to_owned(),
            );
        }
        if self.training.residual_here.is_none() {
            warnings.push(
                "the model states no residuals of its training: where it does not fit it only warns"
                    .to_owned(),
            );
        }
        warnings
    }
}

impl Training {
    fn read(object: &Object) -> Result<Self, FieldError> {
        object.only(&["rows", "textures", "water_types", "sun", "residual_here"])?;
        let rows = match object.get("rows") {
            None => None,
            Some(value) => Some(value.as_u64().ok_or_else(|| {
                FieldError::wrong_type(object.path_of("rows"), "a whole number >= 0", value)
            })?),
        };
        Ok(Self {
            rows,
            textures: words(object, "textures")?,
            water_types: words(object, "water_types")?,
            sun: object
                .get("sun")
                .map(|_| read_sun(&object.object("sun")?))
                .transpose()?,
            residual_here: object
                .get("residual_here")
                .map(|_| read_residual(&object.object("residual_here")?))
                .transpose()?,
        })
    }

    /// As model files have it.
    pub fn to_json(&self) -> Value {
        let mut fields = Map::new();
        if let Some(rows) = self.rows {
            fields.insert("rows".to_owned(), rows.into());
        }
        for (name, words) in [
            ("textures", &self.textures),
            ("water_types", &self.water_types),
        ] {
            if !words.is_empty() {
                fields.insert(name.to_owned(), json!(words));
            }
        }
        if let Some(sun) = self.sun {
            let sun = json!({"zenith_deg": sun.zenith_deg, "azimuth_deg": sun.azimuth_deg});
            fields.insert("sun".to_owned(), sun);
        }
        if let Some(normal) = self.residual_here {
            let normal = json!({"median": normal.median, "p99": normal.p99});
            fields.insert("residual_here".to_owned(), normal);
        }
        Value::Object(fields)
    }
}

fn read_sun(object: &Object) -> Result<Sun, FieldError> {
    object.only(&["zenith_deg", "azimuth_deg"])?;
    let zenith_deg = object.number("zenith_deg")?;
    if !(0.0..90.0).contains(&zenith_deg) {
        let field = object.path_of("zenith_deg");
        let expected = "from 0 to less than 90 degrees";
        return Err(FieldError::out_of_range(field, expected, zenith_deg));
    }
    Ok(Sun {
        zenith_deg,
        azimuth_deg: object.number("azimuth_deg")?,
    })
}

fn read_residual(object: &Object) -> Result<NormalResidual, FieldError> {
    object.only(&["median", "p99"])?;
    let (median, p99) = (object.number("median")?, object.number("p99")?);
    if !(0.0 <= median && median <= p99) {
        let expected = "median and p99 with 0 <= median <= p99";
        let got = format!("{median} and {p99}");
        return Err(FieldError::out_of_range(
            "training.residual_here",
            expected,
            got,
        ));
    }
    Ok(NormalResidual { median, p99 })
}

fn words(object: &Object, name: &str) -> Result<Vec<String>, FieldError> {
    let Some(value) = object.get(name) else {
        return Ok(Vec::new());
    };
    let path = object.path_of(name);
    let word = |(k, item): (usize, &Value)| {
        let text = item.as_str().map(str::to_owned);
        text.ok_or_else(|| FieldError::wrong_type(format!("{path}[{k}]"), "a string", item))
    };
    array(value, &path)?.iter().enumerate().map(word).collect()
}

/// `min` and `max` of every input; all inputs have them or none.
fn read_ranges(
    document: &Object,
    inputs: &[&'static Feature],
) -> Result<Option<Vec<[f64; 2]>>, FieldError> {
    let mut ranges = Vec::new();
    for (k, item) in document.array("inputs")?.iter().enumerate() {
        let input = Object::new(item, format!("inputs[{k}]"))?;
        if input.get("min").is_none() && input.get("max").is_none() {
            continue;
        }
        let (min, max) = (input.number("min")?, input.number("max")?);
        if min > max {
            let expected = format!("at most max ({max})");
            return Err(FieldError::out_of_range(
                input.path_of("min"),
                expected,
                min,
            ));
        }
        ranges.push([min, max]);
    }
    match ranges.len() {
        0 => Ok(None),
        n if n == inputs.len() => Ok(Some(ranges)),
        n => {
            let expected = "with min and max on all of them or on none";
            let got = format!("{n} of {}", inputs.len());
            Err(FieldError::invalid("inputs", expected, got))
        }
    }
}
