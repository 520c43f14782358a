//! What a scene file says of wavelengths: the spectra of water, camera, lights and surfaces.

use uw_media::spectral::{
    self, Curve, ILLUMINANTS, RESPONSES, Response, WaterBands, WaterSpectrum,
};
use uw_media::{Iops, Spectrum};

use super::light::{LAMP_FIELDS, SKY_FIELDS, SUN_FIELDS};
use super::phase::{WATER_FIELDS, read_jerlov, refused};
use super::range::Range;
use super::reader::Table;
use super::value::Value;
use super::{Lamp, Material, SceneError, Spectral, variation};

/// The clear sky's own spectra, by the sun's zenith angle.
const CLEAR_SKY: &str = "clear-sky";
/// Wavelengths that a reflectance must cover, nm.
const SEEN_NM: (f64, f64) = (400.0, 700.0);

/// What a scene says of wavelengths.
pub(super) struct Wavelengths {
    /// The scene by wavelength; `None` where the three channels are all there is.
    pub(super) spectral: Option<Spectral>,
    /// The camera's response.
    pub(super) response: Response,
    /// What is said and does not count in three bands, one sentence each.
    pub(super) warnings: Vec<String>,
}

/// The water by wavelength; `None` where it is known in three bands.
fn read_water(water: &Value<'_>, response: &Response) -> Result<Option<WaterSpectrum>, SceneError> {
    let table = water.as_table(&WATER_FIELDS)?;
    let bands = table.optional("bands");
    if variation::profile_field(&table).is_some() {
        let layers = variation::read_profile(&table, response)?;
        return Ok(layers.and_then(|layers| variation::mean_spectrum(&layers)));
    }
    if let Some(file) = table.optional("spectrum") {
        for field in ["jerlov", "a", "b"] {
            table.refuse(field, "where water.spectrum is given")?;
        }
        if let Some(bands) = &bands
            && bands.as_text()?.parse() != Ok(WaterBands::Spectral)
        {
            return Err(bands.invalid("\"spectral\" where water.spectrum is given"));
        }
        let (text, path) = read_file(&file)?;
        let spectrum = WaterSpectrum::parse(&text);
        return spectrum
            .map(Some)
            .map_err(|error| file.unusable_file(&path, error.to_string()));
    }
    match read_jerlov(&table)? {
        Some(jerlov) => jerlov
            .bands
            .spectrum(jerlov.water)
            .map_err(|error| refused(&jerlov.source, error)),
        None => Ok(None),
    }
}

/// All that is said of wavelengths.
pub(super) fn read(root: &Table<'_>) -> Result<Wavelengths, SceneError> {
    let in_water = root.optional("water");
    let given = spectra(root)?;
    let response = match field_of(root, "camera", &super::camera_table::FIELDS, "response")? {
        Some(value) => {
            let response = read_response(&value)?;
            check_seen(&value, &response)?;
            response
        }
        None => Response::boxes(),
    };
    let of_water = |value| read_water(value, &response);
    let water = in_water.as_ref().map_or(Ok(None), of_water)?;
    let zenith_deg = match field_of(root, "sun", &SUN_FIELDS, "zenith_deg")? {
        Some(value) => value.as_number(Range::finite("degrees"))?,
        None => 0.0,
    };
    let light = |table, fields: &[&str], clear: fn(f64) -> Curve| {
        let spectrum = field_of(root, table, fields, "spectrum")?;
        let read = |value: &Value<'_>| match value.is_text() && value.as_text()? == CLEAR_SKY {
            true => Ok(clear(zenith_deg)),
            false => read_light(value),
        };
        spectrum.as_ref().map(read).transpose()
    };
    let (sun, sky) = (
        light("sun", &SUN_FIELDS, spectral::sunlight)?,
        light("sky", &SKY_FIELDS, spectral::sky_light)?,
    );
    if in_water.is_some() && water.is_none() || in_water.is_none() && given.is_empty() {
        return Ok(Wavelengths {
            spectral: None,
            response,
            warnings: given.iter().map(not_used).collect(),
        });
    }
    if let (Some(table), Some(water)) = (&in_water, &water) {
        let camera = field_of(root, "camera", &super::camera_table::FIELDS, "response")?;
        check_covered(camera.as_ref().unwrap_or(table), water, &response)?;
    }
    let of_lights = |value: &&Value<'_>| {
        let lights = ["sun", "sky", "lamp"];
        lights.iter().any(|of| value.path.starts_with(of))
    };
    let spectral = Spectral {
        sun,
        sky,
        water,
        response: response.clone(),
        lights: (given.iter().filter(of_lights))
            .map(|value| format!("{} {}", value.path, value.written()))
            .collect(),
    };
    Ok(Wavelengths {
        spectral: Some(spectral),
        response,
        warnings: Vec::new(),
    })
}

/// A field of one of the file's tables.
fn field_of<'d>(
    root: &Table<'d>,
    table: &str,
    fields: &[&str],
    field: &str,
) -> Result<Option<Value<'d>>, SceneError> {
    let Some(value) = root.optional(table) else {
        return Ok(None);
    };
    Ok(value.as_table(fields)?.optional(field))
}

/// What three bands make of a spectrum.
fn not_used(value: &Value<'_>) -> String {
    let instead = match value.path.starts_with("object") {
        true => "counts by its mean over each channel",
        false => "does not count",
    };
    format!(
        "{} {instead}: the water is known in three bands; with water.jerlov and water.bands = \"spectral\", or with \
         water.spectrum, all light goes by wavelength",
        value.path
    )
}

/// All spectra and responses that a scene gives for its lights, surfaces and camera.
fn spectra<'d>(root: &Table<'d>) -> Result<Vec<Value<'d>>, SceneError> {
    let mut found = Vec::new();
    found.extend(field_of(root, "sun", &SUN_FIELDS, "spectrum")?);
    found.extend(field_of(root, "sky", &SKY_FIELDS, "spectrum")?);
    for lamp in root.elements("lamp")? {
        found.extend(lamp.as_table(&LAMP_FIELDS)?.optional("spectrum"));
    }
    for object in root.elements("object")? {
        let object = object.as_table(&super::object::OBJECT_FIELDS)?;
        let reflectance = object.optional("reflectance").filter(Value::is_table);
        if let Some(reflectance) = reflectance {
            let reflectance = reflectance.as_table(&super::object::TEXTURE_FIELDS)?;
            found.extend(reflectance.optional("spectrum"));
        }
    }
    found.extend(field_of(
        root,
        "camera",
        &super::camera_table::FIELDS,
        "response",
    )?);
    Ok(found)
}

/// The text of a file that a value names, and its path.
pub(super) fn read_file(value: &Value<'_>) -> Result<(String, std::path::PathBuf), SceneError> {
    let path = value.as_path()?;
    let text = uw_assets::ALL
        .read_to_string(&path)
        .map_err(|error| value.unusable_file(&path, error.to_string()))?;
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
fn check_seen(place: &Value<'_>, response: &Response) -> Result<(), SceneError> {
    let seen = response.channel_values(None, |_| 1.0);
    match (0..3).find(|&k| seen[k] == 0.0) {
        Some(k) => Err(place.invalid_got(
            "a response above 0 somewhere in each of r, g and b",
            format!("none in {}", ["r", "g", "b"][k]),
        )),
        None => Ok(()),
    }
}

/// The water must be known where the camera sees.
fn check_covered(
    place: &Value<'_>,
    water: &WaterSpectrum,
    response: &Response,
) -> Result<(), SceneError> {
    let (low, high) = water.range_nm();
    let Some((outside, channel)) = response.not_covered((low, high)) else {
        return Ok(());
    };
    Err(place.invalid_got(
        format!(
            "water that is known where the camera sees: its table ends at {low} and {high} nm, and at most {} % of a \
             channel may lie beyond",
            100.0 * Response::MAY_LIE_OUTSIDE
        ),
        format!("{:.1} % of channel {channel}", 100.0 * outside),
    ))
}

impl Wavelengths {
    /// Gives materials with a spectrum its mean over each channel, for whoever sees three bands.
    pub(super) fn mean_reflectances(&self, materials: &mut [Material]) {
        let range_nm = self.spectral.as_ref().map(Spectral::range_nm);
        for material in materials {
            if let Some(curve) = &material.spectrum {
                material.reflectance = self.response.channel_values(range_nm, |nm| curve.at(nm));
            }
        }
    }
}

impl Spectral {
    /// Water by wavelength before a camera, under lights without spectra.
    pub fn of(water: WaterSpectrum, response: Response) -> Self {
        Self {
            water: Some(water),
            response,
            sun: None,
            sky: None,
            lights: Vec::new(),
        }
    }

    /// Wavelengths that count, nm: those of the water's table.
    pub fn range_nm(&self) -> (f64, f64) {
        match &self.water {
            Some(water) => water.range_nm(),
            None => self.response.range_nm(),
        }
    }

    /// Factors that make white white under daylight (D65), green keeping its own.
    pub fn daylight_gains(&self) -> Option<Spectrum> {
        let daylight = spectral::illuminant("d65").ok()?;
        let values = self.response.channel_values(None, |nm| daylight.at(nm));
        values
            .iter()
            .all(|value| *value > 0.0)
            .then(|| values.map(|value| values[1] / value))
    }

    /// Coefficients of the channels near zero range.
    pub fn wideband(&self) -> Iops {
        match &self.water {
            Some(water) => water.near_zero_range(&self.response),
            None => Iops {
                a: [0.0; 3],
                b: [0.0; 3],
            },
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
