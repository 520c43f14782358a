//! What a scene file says of wavelengths: `bands = "spectral"`, and the spectra of water, camera, lights and surfaces.

use std::fs;
use std::str::FromStr;

use uw_media::spectral::{self, Curve, ILLUMINANTS, RESPONSES, Response, WaterSpectrum};
use uw_media::{Iops, Spectrum, WaterType};

use super::phase::refused;
use super::reader::Table;
use super::value::Value;
use super::{Lamp, Material, SceneError, Spectral};

/// The bands of scenes by wavelength.
pub(super) const SPECTRAL: &str = "spectral";
/// The same with the spectra that Williamson and Hollins measured.
pub(super) const SPECTRAL_MEASURED: &str = "spectral-measured";
/// Share of a channel's response that may lie outside the water's table.
const OUTSIDE_SHARE: f64 = 0.02;
/// The clear sky's own spectra, by the sun's zenith angle.
const CLEAR_SKY: &str = "clear-sky";
/// Wavelengths that a reflectance must cover, nm.
const SEEN_NM: (f64, f64) = (400.0, 700.0);

/// The water by wavelength, where the scene wants it so: `[water]` with `spectrum`, or with `jerlov` and spectral bands.
pub(super) fn read_water(root: &Table<'_>) -> Result<Option<WaterSpectrum>, SceneError> {
    let Some(water) = root.optional("water") else {
        return Ok(None);
    };
    let table = water.as_table(&super::phase::WATER_FIELDS)?;
    let bands = table.optional("bands");
    if let Some(file) = table.optional("spectrum") {
        for field in ["jerlov", "a", "b"] {
            table.refuse(field, "where water.spectrum is given")?;
        }
        if let Some(bands) = &bands
            && bands.as_text()? != SPECTRAL
        {
            return Err(bands.invalid("\"spectral\" where water.spectrum is given"));
        }
        let (text, path) = read_file(&file)?;
        let spectrum = WaterSpectrum::parse(&text);
        return spectrum
            .map(Some)
            .map_err(|error| file.unusable_file(&path, error.to_string()));
    }
    let (Some(jerlov), Some(bands)) = (table.optional("jerlov"), bands) else {
        return Ok(None);
    };
    let water_type =
        |_| WaterType::from_str(jerlov.as_text()?).map_err(|error| refused(&jerlov, error));
    match bands.as_text()? {
        SPECTRAL => Ok(Some(WaterSpectrum::jerlov(water_type(())?))),
        SPECTRAL_MEASURED => WaterSpectrum::measured(water_type(())?)
            .map(Some)
            .map_err(|error| refused(&bands, error)),
        _ => Ok(None),
    }
}

/// All that is known of wavelengths; `None` where the three channels are all there is.
pub(super) fn read(root: &Table<'_>) -> Result<Option<Spectral>, SceneError> {
    let water = read_water(root)?;
    let camera = root
        .optional("camera")
        .map(|camera| camera.as_table(&super::camera::FIELDS))
        .transpose()?;
    let response = camera
        .as_ref()
        .and_then(|camera| camera.optional("response"));
    if water.is_none() {
        if root.optional("water").is_some() {
            refuse_spectra(root)?;
            return Ok(None);
        }
        if response.is_none() && !has_spectra(root)? {
            return Ok(None);
        }
    }
    let camera_response = match &response {
        Some(value) => read_response(value)?,
        None => Response::boxes(),
    };
    check_seen(response.as_ref(), &camera_response)?;
    if let Some(water) = &water {
        let place = response.or_else(|| root.optional("water"));
        check_covered(place.as_ref(), water, &camera_response)?;
    }
    let zenith_deg = match root.optional("sun") {
        Some(sun) => sun
            .as_table(&super::light::SUN_FIELDS)?
            .optional("zenith_deg")
            .map_or(Ok(0.0), |value| {
                value.as_number(super::range::Range::finite("degrees"))
            })?,
        None => 0.0,
    };
    let of = |table: &str, fields: &[&str], clear: fn(f64) -> Curve| {
        let Some(value) = root.optional(table) else {
            return Ok(None);
        };
        let Some(spectrum) = value.as_table(fields)?.optional("spectrum") else {
            return Ok(None);
        };
        match spectrum.is_text() && spectrum.as_text()? == CLEAR_SKY {
            true => Ok(Some(clear(zenith_deg))),
            false => read_light(&spectrum).map(Some),
        }
    };
    Ok(Some(Spectral {
        sun: of("sun", &super::light::SUN_FIELDS, spectral::sunlight)?,
        sky: of("sky", &super::light::SKY_FIELDS, spectral::sky_light)?,
        water,
        response: camera_response,
        lights: spectra(root)?
            .iter()
            .filter(|value| {
                ["sun", "sky", "lamp"]
                    .iter()
                    .any(|of| value.path.starts_with(of))
            })
            .map(|value| format!("{} {}", value.path, value.written()))
            .collect(),
    }))
}

/// The tables of a scene that may have a spectrum of light, and surfaces that may.
fn spectra<'d>(root: &Table<'d>) -> Result<Vec<Value<'d>>, SceneError> {
    let mut found = Vec::new();
    for (name, fields) in [
        ("sun", &super::light::SUN_FIELDS[..]),
        ("sky", &super::light::SKY_FIELDS[..]),
    ] {
        if let Some(value) = root.optional(name) {
            found.extend(value.as_table(fields)?.optional("spectrum"));
        }
    }
    for lamp in root.elements("lamp")? {
        found.extend(
            lamp.as_table(&super::light::LAMP_FIELDS)?
                .optional("spectrum"),
        );
    }
    for object in root.elements("object")? {
        let object = object.as_table(&super::object::OBJECT_FIELDS)?;
        let reflectance = object.optional("reflectance").filter(Value::is_table);
        if let Some(reflectance) = reflectance {
            let reflectance = reflectance.as_table(&super::object::TEXTURE_FIELDS)?;
            found.extend(reflectance.optional("spectrum"));
        }
    }
    if let Some(camera) = root.optional("camera") {
        found.extend(
            camera
                .as_table(&super::camera::FIELDS)?
                .optional("response"),
        );
    }
    Ok(found)
}

fn has_spectra(root: &Table<'_>) -> Result<bool, SceneError> {
    Ok(!spectra(root)?.is_empty())
}

fn refuse_spectra(root: &Table<'_>) -> Result<(), SceneError> {
    match spectra(root)?.first() {
        None => Ok(()),
        Some(value) => Err(value.invalid(
            "left out where the water is known in three bands; it goes with water.bands = \"spectral\" and jerlov or spectrum",
        )),
    }
}

/// The text of a file that a value names, and its path.
fn read_file(value: &Value<'_>) -> Result<(String, std::path::PathBuf), SceneError> {
    let path = value.as_path()?;
    let text =
        fs::read_to_string(&path).map_err(|error| value.unusable_file(&path, error.to_string()))?;
    Ok((text, path))
}

/// A camera's response: a name, or { file = "camera.csv" }.
fn read_response(value: &Value<'_>) -> Result<Response, SceneError> {
    if value.is_table() {
        let file = value
            .as_table(&["file"])?
            .required("file", "the path of a CSV file with wavelength_nm,r,g,b")?;
        let (text, path) = read_file(&file)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        return Response::parse(&text, &name)
            .map_err(|error| file.unusable_file(&path, error.to_string()));
    }
    if !value.is_text() {
        return Err(value.invalid(format!("{{ file = \"camera.csv\" }} or one of {RESPONSES}")));
    }
    Response::named(value.as_text()?).map_err(|error| refused(value, error))
}

/// A light's relative spectrum: a name, or { file = "lamp.csv" }.
pub(super) fn read_light(value: &Value<'_>) -> Result<Curve, SceneError> {
    if value.is_table() {
        let file = value
            .as_table(&["file"])?
            .required("file", "the path of a CSV file with wavelength_nm,relative")?;
        let (text, path) = read_file(&file)?;
        return spectral::read_columns(&text, ["relative"], None)
            .map(|[curve]| curve)
            .map_err(|error| file.unusable_file(&path, error.to_string()));
    }
    if !value.is_text() {
        return Err(value.invalid(format!("{{ file = \"lamp.csv\" }} or one of {ILLUMINANTS}")));
    }
    spectral::illuminant(value.as_text()?).map_err(|error| refused(value, error))
}

/// A reflectance by wavelength: the path of a CSV file with wavelength_nm,reflectance.
pub(super) fn read_reflectance(value: &Value<'_>) -> Result<Curve, SceneError> {
    let (text, path) = read_file(value)?;
    let unusable = |what: String| value.unusable_file(&path, what);
    let [curve] = spectral::read_columns(&text, ["reflectance"], Some(1.0))
        .map_err(|error| unusable(error.to_string()))?;
    match curve.range_nm() {
        Some((low, high)) if low <= SEEN_NM.0 && high >= SEEN_NM.1 => Ok(curve),
        range => {
            let (low, high) = range.unwrap_or_default();
            Err(unusable(format!(
                "must cover {} to {} nm, got {low} to {high}",
                SEEN_NM.0, SEEN_NM.1
            )))
        }
    }
}

/// Every channel must see something.
fn check_seen(place: Option<&Value<'_>>, response: &Response) -> Result<(), SceneError> {
    let seen = response.channel_values(None, |_| 1.0);
    let dark = (0..3).find(|&k| seen[k] == 0.0);
    match (place, dark) {
        (Some(place), Some(k)) => Err(place.invalid_got(
            "a response above 0 somewhere in each of r, g and b",
            format!("none in {}", ["r", "g", "b"][k]),
        )),
        _ => Ok(()),
    }
}

/// The water must be known where the camera sees.
fn check_covered(
    place: Option<&Value<'_>>,
    water: &WaterSpectrum,
    response: &Response,
) -> Result<(), SceneError> {
    let (low, high) = water.range_nm();
    let inside = |nm: f64| f64::from(u8::from((low..=high).contains(&nm)));
    let shares = response.channel_values(None, inside);
    let worst = (0..3)
        .min_by(|&a, &b| shares[a].total_cmp(&shares[b]))
        .unwrap_or(0);
    let outside = 1.0 - shares[worst];
    match place {
        Some(place) if outside > OUTSIDE_SHARE => Err(place.invalid_got(
            format!(
                "water that is known where the camera sees: its table ends at {low} and {high} nm, and at most {} % of a \
                 channel may lie beyond",
                100.0 * OUTSIDE_SHARE
            ),
            format!("{:.1} % of channel {}", 100.0 * outside, ["r", "g", "b"][worst]),
        )),
        _ => Ok(()),
    }
}

impl Spectral {
    /// Wavelengths that count, nm: those of the water's table.
    pub fn range_nm(&self) -> (f64, f64) {
        match &self.water {
            Some(water) => water.range_nm(),
            None => self.response.range_nm(),
        }
    }

    /// Factors that make white white under daylight (D65), green keeping its own.
    pub(super) fn daylight_gains(&self) -> Option<Spectrum> {
        let daylight = spectral::illuminant("d65").ok()?;
        let values = self.response.channel_values(None, |nm| daylight.at(nm));
        values
            .iter()
            .all(|value| *value > 0.0)
            .then(|| values.map(|value| values[1] / value))
    }

    /// Coefficients of the channels near zero range.
    pub fn wideband(&self) -> Iops {
        let Some(water) = &self.water else {
            return Iops {
                a: [0.0; 3],
                b: [0.0; 3],
            };
        };
        let range = Some(water.range_nm());
        Iops {
            a: self.response.channel_values(range, |nm| water.a.at(nm)),
            b: self.response.channel_values(range, |nm| water.b.at(nm)),
        }
    }

    /// What a light with a relative `spectrum` brings at a wavelength of each channel, relative to the channel's mean; 1
    /// without a spectrum.
    pub fn relative_light(&self, spectrum: Option<&Curve>) -> impl Fn([f64; 3]) -> Spectrum {
        let means = spectrum.map(|curve| {
            self.response
                .channel_values(Some(self.range_nm()), |nm| curve.at(nm))
        });
        move |wavelengths_nm| match (spectrum, means) {
            (Some(curve), Some(means)) => std::array::from_fn(|k| match means[k] > 0.0 {
                true => curve.at(wavelengths_nm[k]) / means[k],
                false => 0.0,
            }),
            _ => [1.0; 3],
        }
    }

    /// Gives materials with a spectrum its mean over each channel, for whoever sees three bands.
    pub(super) fn mean_reflectances(&self, materials: &mut [Material]) {
        for material in materials {
            if let Some(curve) = &material.spectrum {
                let range_nm = Some(self.range_nm());
                material.reflectance = self.response.channel_values(range_nm, |nm| curve.at(nm));
            }
        }
    }

    /// A sentence for every channel of a lamp that its spectrum leaves without light.
    pub(super) fn dark_channels(&self, lamps: &[Lamp]) -> Vec<String> {
        let mut found = Vec::new();
        for lamp in lamps {
            let Some(curve) = &lamp.spectrum else {
                continue;
            };
            let means = self
                .response
                .channel_values(Some(self.range_nm()), |nm| curve.at(nm));
            for k in 0..3 {
                if lamp.intensity[k] > 0.0 && !(means[k] > 0.0) {
                    found.push(format!(
                        "lamp {} has no light in channel {} by its spectrum",
                        lamp.name,
                        ["r", "g", "b"][k]
                    ));
                }
            }
        }
        found
    }
}
