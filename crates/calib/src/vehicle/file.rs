//! A vehicle's file (`uw-vehicle/1`, TOML), by its name among the shipped ones or by its path.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::{LevelCurve, Vehicle, Vignetting};
use crate::Encoding;

/// The value of the field `format`.
const FORMAT: &str = "uw-vehicle/1";
/// The table of what was measured.
const MEASURED: &str = "measured";
/// Where the shipped vehicles are.
const SHIPPED: &str = "shipped:vehicles";
/// The name of the vehicle of the program itself, whatever a folder of assets holds.
const DEFAULT_NAME: &str = "default";
/// `assets/vehicles/default.toml`.
const DEFAULT_TEXT: &str = include_str!("../../../../assets/vehicles/default.toml");

/// How a value of a vehicle is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Standard error in the unit of the field, finite and >= 0; `None` where it is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// What it was taken from.
    pub from: String,
}

/// A vehicle and how its values are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleFile {
    /// The values.
    pub vehicle: Vehicle,
    /// By the vehicle's field, for those of which something is known; the table `[measured]`.
    pub measured: BTreeMap<String, Measurement>,
}

/// A vehicle's file cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {message}")]
pub struct VehicleError {
    /// The file, or the name that was asked for.
    pub path: String,
    /// Field, value and what would be right.
    pub message: String,
}

impl VehicleFile {
    /// The vehicle `name_or_file`: a name among `assets/vehicles`, or a file, known by its ending `.toml` and relative to
    /// `folder`.
    ///
    /// # Errors
    /// A name that is not known, and those of [`read`](Self::read).
    pub fn find(name_or_file: &str, folder: &Path) -> Result<Self, VehicleError> {
        if name_or_file.ends_with(".toml") {
            return Self::read(&folder.join(name_or_file));
        }
        if name_or_file == DEFAULT_NAME {
            return Self::parse(DEFAULT_TEXT, DEFAULT_NAME);
        }
        let shipped = uw_assets::SMALL.list(Path::new(SHIPPED));
        match shipped.iter().find(|path| name_of(path) == name_or_file) {
            Some(path) => Self::read(path),
            None => Err(VehicleError {
                path: format!("vehicle {name_or_file:?}"),
                message: format!(
                    "is neither a file (*.toml) nor one of the shipped vehicles ({})",
                    with_default(shipped.iter().map(|path| name_of(path)).collect()).join(", ")
                ),
            }),
        }
    }

    /// Reads and checks a file. Fields that it leaves out are those of [`Vehicle::default`].
    ///
    /// # Errors
    /// A file that cannot be read, another format, a field that is not known or has a value out of its range.
    pub fn read(path: &Path) -> Result<Self, VehicleError> {
        let name = path.display().to_string();
        let text = uw_assets::SMALL
            .read_to_string(path)
            .map_err(|error| VehicleError {
                path: name.clone(),
                message: format!("cannot be read: {error}"),
            })?;
        Self::parse(&text, &name)
    }

    /// The same of a text; `name` is for messages.
    pub fn parse(text: &str, name: &str) -> Result<Self, VehicleError> {
        let wrong = |message| VehicleError {
            path: name.to_owned(),
            message,
        };
        let mut table: Table =
            toml::from_str(text).map_err(|error| wrong(error.to_string().trim().to_owned()))?;
        match table.remove("format") {
            Some(Value::String(format)) if format == FORMAT => {}
            Some(other) => return Err(wrong(format!("format must be \"{FORMAT}\", got {other}"))),
            None => {
                return Err(wrong(format!("format is missing; it must be \"{FORMAT}\"")));
            }
        }
        let measured = table.remove(MEASURED).map_or(Ok(BTreeMap::new()), measured);
        let file = Self {
            vehicle: vehicle(table).map_err(wrong)?,
            measured: measured.map_err(wrong)?,
        };
        file.vehicle.check().map_err(wrong)?;
        Ok(file)
    }

    /// The file's text, which [`parse`](Self::parse) reads as the same.
    ///
    /// # Errors
    /// None that is known of: every field has a form in TOML.
    pub fn to_text(&self) -> Result<String, String> {
        #[derive(Serialize)]
        struct Layout<'a> {
            format: &'a str,
            #[serde(flatten)]
            vehicle: &'a Vehicle,
            #[serde(skip_serializing_if = "BTreeMap::is_empty")]
            measured: &'a BTreeMap<String, Measurement>,
        }
        let layout = Layout {
            format: FORMAT,
            vehicle: &self.vehicle,
            measured: &self.measured,
        };
        toml::to_string(&layout).map_err(|error| error.to_string())
    }
}

/// The vehicle of a table without `format` and `measured`.
fn vehicle(table: Table) -> Result<Vehicle, String> {
    for (field, value) in &table {
        if !fields().contains(field) {
            return Err(format!(
                "unknown field {field} (got {value}); known are format, {}, {MEASURED}",
                fields().join(", ")
            ));
        }
        let alone = Table::from_iter([(field.clone(), value.clone())]);
        if let Err(error) = Vehicle::deserialize(Value::Table(alone)) {
            let told = error.to_string();
            let told = told.lines().next().unwrap_or_default();
            return Err(format!("{field} = {value}: {told}"));
        }
    }
    Vehicle::deserialize(Value::Table(table)).map_err(|error| error.to_string())
}

/// The table `[measured]`.
fn measured(value: Value) -> Result<BTreeMap<String, Measurement>, String> {
    let Value::Table(table) = value else {
        return Err(format!(
            "{MEASURED} must be a table of fields, each {{ error = .., from = \"..\" }}, got {value}"
        ));
    };
    let mut known = BTreeMap::new();
    for (field, value) in table {
        if !fields().contains(&field) {
            return Err(format!(
                "{MEASURED}.{field} is no field of a vehicle; those are {}",
                fields().join(", ")
            ));
        }
        let got = value.to_string();
        let entry = Measurement::deserialize(value).map_err(|error| {
            let told = error.to_string();
            format!(
                "{MEASURED}.{field} must be {{ error = .., from = \"..\" }}, got {got}: {}",
                told.lines().next().unwrap_or_default()
            )
        })?;
        if let Some(error) = entry.error
            && !(error >= 0.0 && error.is_finite())
        {
            return Err(format!(
                "{MEASURED}.{field}.error must be finite and >= 0, got {error}"
            ));
        }
        known.insert(field, entry);
    }
    Ok(known)
}

/// The names of a vehicle's fields.
fn fields() -> Vec<String> {
    let all = Vehicle {
        encoding: Encoding::Linear,
        vignetting: Vignetting::new([0.0; 3]).ok(),
        lamp_profile: Some(vec![[0.0, 1.0]]),
        level_curve: LevelCurve::new(vec![[0.0; 2], [100.0; 2]]).ok(),
        response: Some(String::new()),
        lamp_spectrum: Some(String::new()),
        daylight_spectrum: Some(String::new()),
        ..Vehicle::default()
    };
    Table::try_from(&all).map_or_else(|_| Vec::new(), |table| table.keys().cloned().collect())
}

/// The name of a shipped vehicle's file; nothing for another file.
fn name_of(path: &Path) -> String {
    let stem = path
        .file_stem()
        .filter(|_| path.extension().is_some_and(|e| e == "toml"));
    stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// The names in order, the one that needs no folder among them.
fn with_default(mut names: Vec<String>) -> Vec<String> {
    names.retain(|name| !name.is_empty());
    names.push(DEFAULT_NAME.to_owned());
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_default_is_the_default() {
        let shipped = VehicleFile::find("default", Path::new("")).expect("shipped");
        assert_eq!(shipped, VehicleFile::default());
        // It states every field that a vehicle has without spectra.
        let table: Table = toml::from_str(DEFAULT_TEXT).expect("TOML");
        let stated = Table::try_from(Vehicle::default()).expect("a table");
        for (field, value) in stated {
            assert_eq!(table.get(&field), Some(&value), "{field}");
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut file = VehicleFile::default();
        file.vehicle.noise_a = 3.25e-4;
        file.vehicle.response = Some("canon5d2".into());
        file.vehicle.encoding = Encoding::Linear;
        file.vehicle.vignetting = Vignetting::new([-0.3, 0.05, -0.01]).ok();
        file.vehicle.lamp_profile = Some(vec![[0.0, 1.0], [30.5, 0.25]]);
        let known = |error, from: &str| Measurement {
            error,
            from: from.into(),
        };
        file.measured = BTreeMap::from([
            ("noise_a".to_owned(), known(Some(1.5e-6), "two frames")),
            ("lamp_intensity".to_owned(), known(None, "a data sheet")),
        ]);
        let text = file.to_text().expect("text");
        assert_eq!(VehicleFile::parse(&text, "v").expect("read"), file);
        // Of a measured curve rounding may change the last digit.
        let points = [[20.0, 1.0], [120.0, 9.0], [250.0, 40.0]];
        let curve = uw_media::ResponseCurve::new(&points).expect("a curve");
        file.vehicle.encoding = Encoding::Curve(curve);
        let text = file.to_text().expect("text");
        let again = VehicleFile::parse(&text, "v")
            .expect("read")
            .vehicle
            .encoding;
        for counts in [1.0, 20.0, 77.0, 120.0, 250.0, 255.0] {
            let off = again.light(counts) / file.vehicle.encoding.light(counts) - 1.0;
            assert!(off.abs() < 1e-12, "{counts}: {off}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refused = [
            ("", "v.toml: format is missing"),
            (
                "format = \"uw-scene/1\"",
                "must be \"uw-vehicle/1\", got \"uw-scene/1\"",
            ),
            (
                "noise_c = 1",
                "unknown field noise_c (got 1); known are format, ",
            ),
            ("noise_a = \"low\"", "noise_a = \"low\": invalid type"),
            ("width = 12.5", "width = 12.5: invalid type"),
            (
                "noise_b = -1e-6",
                "noise_b must be finite and >= 0, got -0.000001",
            ),
            ("hfov_deg = nan", "hfov_deg must be in (0, 179], got NaN"),
            ("response = \"canon\"", "vehicle.response"),
            (
                "encoding = \"gamma\"",
                "encoding = \"gamma\": unknown variant `gamma`, expected one of `srgb`, `linear`, `curve`",
            ),
            (
                "encoding = { curve = [[10.0, 0.2], [20.0, 0.1]] }",
                "must rise from point to point, got [20, 0.1] after [10, 0.2]",
            ),
            (
                "vignetting = [-2.0, 0.0, 0.0]",
                "leaves 0.048 of the light at 0.69 of the way",
            ),
            ("vignetting = 0.3", "vignetting = 0.3: "),
            (
                "lamp_profile = [[0.0, 1.0], [20.0, 0.5], [10.0, 0.1]]",
                "got [10.0, 0.1] after [20.0, 0.5]",
            ),
            (
                "lamp_profile = [[5.0, 1.0], [20.0, 0.5]]",
                "got 5 degrees first",
            ),
            ("lamp_profile = [[0.0, 0.0], [20.0, 0.0]]", "got darkness"),
            ("measured = 3", "measured must be a table"),
            (
                "measured.noise = { from = \"x\" }",
                "measured.noise is no field",
            ),
            (
                "measured.noise_a = { error = -1.0, from = \"x\" }",
                "measured.noise_a.error must be",
            ),
            ("measured.noise_a = { error = 1.0 }", "missing field `from`"),
            ("noise_a = ", "v.toml: TOML parse error"),
        ];
        for (line, words) in refused {
            let format = match line.starts_with("format") || line.is_empty() {
                true => "",
                false => "format = \"uw-vehicle/1\"\n",
            };
            let told = VehicleFile::parse(&format!("{format}{line}"), "v.toml");
            let told = told.expect_err(line).to_string();
            assert!(told.contains(words), "{line}: {told}");
            assert!(told.starts_with("v.toml: "), "{line}: {told}");
        }
        let told = VehicleFile::find("yacht", Path::new("")).expect_err("no such vehicle");
        assert!(told.to_string().contains("default"), "{told}");
        let told = VehicleFile::find("none.toml", Path::new("/tmp")).expect_err("no such file");
        assert!(
            told.to_string().contains("/tmp/none.toml: cannot be read"),
            "{told}"
        );
    }
}
