//! The contrasts of a profile without the noise of its pictures, beside the published ones.

use serde::Serialize;
use serde_json::{Value, json};

use crate::json::{FieldError, Object};
use crate::noise::NoiseSource;

/// Contrast of the target from one distance without the sensor's noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CorrectedSample {
    /// Distance along the optical axis, m, > 0.
    pub distance_m: f64,
    /// Contrast per channel, 8-bit counts; near 0 it may be a little below.
    pub k_c: [f64; 3],
    /// What noise alone stays below, 8-bit counts, >= 0.
    pub floor: [f64; 3],
}

/// Both curves; distances whose contrast was derived from other lamp levels are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// Where the noise was taken from.
    pub source: NoiseSource,
    /// With the lamps on, distances increasing.
    pub on: Vec<CorrectedSample>,
    /// With the lamps off, distances increasing.
    pub off: Vec<CorrectedSample>,
}

/// Its name in the profile file.
pub(super) const FIELD: &str = "noise_corrected";

impl Corrected {
    /// Refuses values that no picture has.
    pub(super) fn check(&self) -> Result<(), FieldError> {
        for (name, samples) in [("on", &self.on), ("off", &self.off)] {
            let mut last = 0.0;
            for (i, sample) in samples.iter().enumerate() {
                let at = |field: &str| format!("{FIELD}.{name}[{i}].{field}");
                let distance_m = sample.distance_m;
                if !(distance_m.is_finite() && distance_m > last) {
                    let expected = format!("finite and greater than {last} m");
                    return Err(FieldError::out_of_range(
                        at("distance_m"),
                        expected,
                        distance_m,
                    ));
                }
                last = distance_m;
                if let Some(k) = sample.k_c.iter().position(|v| !v.is_finite()) {
                    return Err(FieldError::out_of_range(at("k_c"), "finite", sample.k_c[k]));
                }
                let wrong = |v: &f64| !(v.is_finite() && *v >= 0.0);
                if let Some(k) = sample.floor.iter().position(wrong) {
                    return Err(FieldError::out_of_range(
                        at("floor"),
                        "finite and >= 0",
                        sample.floor[k],
                    ));
                }
            }
        }
        Ok(())
    }

    pub(super) fn read(document: &Object) -> Result<Option<Self>, FieldError> {
        if document.get(FIELD).is_none() {
            return Ok(None);
        }
        let object = document.object(FIELD)?;
        object.only(&["source", "on", "off"])?;
        let source = match object.text("source")? {
            "picture" => NoiseSource::Picture,
            "sensor" => NoiseSource::Sensor,
            other => {
                let expected = "\"picture\" or \"sensor\"";
                let field = object.path_of("source");
                return Err(FieldError::invalid(field, expected, format!("{other:?}")));
            }
        };
        Ok(Some(Self {
            source,
            on: samples(&object, "on")?,
            off: samples(&object, "off")?,
        }))
    }

    /// The value of its field, one sample a line.
    pub(super) fn to_json(&self) -> String {
        let lines = |samples: &[CorrectedSample]| {
            let rows: Vec<String> = samples.iter().map(|s| json!(s).to_string()).collect();
            format!("[\n  {}\n ]", rows.join(",\n  "))
        };
        format!(
            "{{\"source\": \"{}\", \"on\": {}, \"off\": {}}}",
            self.source.name(),
            lines(&self.on),
            lines(&self.off)
        )
    }
}

fn samples(object: &Object, list: &str) -> Result<Vec<CorrectedSample>, FieldError> {
    let read = |(k, item): (usize, &Value)| {
        let sample = Object::new(item, format!("{FIELD}.{list}[{k}]"))?;
        sample.only(&["distance_m", "k_c", "floor"])?;
        Ok(CorrectedSample {
            distance_m: sample.number("distance_m")?,
            k_c: sample.numbers("k_c")?,
            floor: sample.numbers("floor")?,
        })
    };
    object.array(list)?.iter().enumerate().map(read).collect()
}
