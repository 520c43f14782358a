//! The small tables of a scene file: water surface, sensor, render defaults.

use uw_media::{ResponseCurve, Spectrum, Vignetting};

use super::range::Range;
use super::reader::Table;
use super::value::Value;
use super::{
    Encoding, Exposure, Noise, RenderSettings, SceneError, Sensor, Spectral, WaterSurface,
    WhiteBalance,
};

const SENSOR_FIELDS: [&str; 7] = [
    "exposure",
    "encoding",
    "bits",
    "noise",
    "white_balance",
    "color_matrix",
    "vignetting",
];
/// Most samples per pixel.
const MAX_SAMPLES: u32 = 1 << 30;

impl Default for RenderSettings {
    /// 64 samples per pixel, unlimited bounces.
    fn default() -> Self {
        Self {
            samples_per_pixel: 64,
            max_bounces: 0,
        }
    }
}

impl Default for Sensor {
    /// Exposure 1, sRGB, 8 bits, no noise: what a picture goes through when the scene has no `[sensor]`.
    fn default() -> Self {
        Self {
            exposure: Exposure::Fixed(1.0),
            encoding: Encoding::Srgb,
            bits: 8,
            noise: None,
            white_balance: WhiteBalance::None,
            color_matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            vignetting: None,
        }
    }
}

/// Reads `[surface]`.
pub(super) fn read_surface(root: &Table<'_>) -> Result<Option<WaterSurface>, SceneError> {
    let Some(table) = root.table("surface", &["height_m", "refractive"])? else {
        return Ok(None);
    };
    Ok(Some(WaterSurface {
        height_m: table.number_or("height_m", Range::finite("m"), 0.0)?,
        refractive: table
            .optional("refractive")
            .map_or(Ok(true), |value| value.as_bool())?,
    }))
}

/// Reads `[sensor]`.
pub(super) fn read_sensor(
    root: &Table<'_>,
    spectral: Option<&Spectral>,
) -> Result<Option<Sensor>, SceneError> {
    let Some(table) = root.table("sensor", &SENSOR_FIELDS)? else {
        return Ok(None);
    };
    let default = Sensor::default();
    let bits = match table.optional("bits") {
        Some(value) => match value.as_whole(8, 16, "").ok() {
            Some(bits) if bits == 8 || bits == 16 => bits,
            _ => return Err(value.invalid("8 or 16")),
        },
        None => default.bits,
    };
    Ok(Some(Sensor {
        exposure: read_exposure(&table)?.unwrap_or(default.exposure),
        encoding: read_encoding(&table)?.unwrap_or(default.encoding),
        bits,
        noise: read_noise(&table)?,
        white_balance: read_white_balance(&table, spectral)?,
        color_matrix: read_color_matrix(&table)?.unwrap_or(default.color_matrix),
        vignetting: read_vignetting(&table)?,
    }))
}

/// `encoding`: "linear", "srgb", or what was measured of a camera, `{ curve = [[counts, light], ..] }`.
fn read_encoding(sensor: &Table<'_>) -> Result<Option<Encoding>, SceneError> {
    let Some(value) = sensor.optional("encoding") else {
        return Ok(None);
    };
    if !value.is_table() {
        let words = [("linear", Encoding::Linear), ("srgb", Encoding::Srgb)];
        return value.as_choice(&words).map(Some);
    }
    let expected = "a list of [counts, light], 8-bit counts and light, both rising";
    let curve = value.as_table(&["curve"])?.required("curve", expected)?;
    if !curve.is_array() {
        return Err(curve.invalid(expected));
    }
    let points = curve.as_elements()?;
    let points = points.iter().map(|point| match point.is_array() {
        true => point.as_numbers(Range::finite("")),
        false => Err(point.invalid(expected)),
    });
    let points = points.collect::<Result<Vec<_>, _>>()?;
    let made = ResponseCurve::new(&points)
        .map_err(|reason| curve.invalid(format!("{expected} ({reason})")))?;
    Ok(Some(Encoding::Curve(made)))
}

/// `vignetting`: the three coefficients of a vehicle's file.
fn read_vignetting(sensor: &Table<'_>) -> Result<Option<Vignetting>, SceneError> {
    let Some(value) = sensor.optional("vignetting") else {
        return Ok(None);
    };
    let coefficients = value.as_numbers(Range::finite(""))?;
    let lens = Vignetting::new(coefficients);
    lens.map(Some).map_err(|_| {
        value.invalid("k1, k2, k3 of which 1 + k1 r^2 + k2 r^4 + k3 r^6 is from 0.05 to 1.5 for r from 0 to 1")
    })
}

/// `color_matrix`: three rows of three numbers.
fn read_color_matrix(sensor: &Table<'_>) -> Result<Option<[Spectrum; 3]>, SceneError> {
    let Some(value) = sensor.optional("color_matrix") else {
        return Ok(None);
    };
    let expected = "three rows of three numbers, the factors of r, g and b in each channel";
    if !value.is_array() {
        return Err(value.invalid(expected));
    }
    let [red, green, blue] = &value.as_elements()?[..] else {
        return Err(value.invalid(expected));
    };
    let row = |value: &Value<'_>| value.as_numbers(Range::finite(""));
    Ok(Some([row(red)?, row(green)?, row(blue)?]))
}

/// `white_balance`: "none", "gray", "d65" (what white is under daylight without water), or three factors.
fn read_white_balance(
    sensor: &Table<'_>,
    spectral: Option<&Spectral>,
) -> Result<WhiteBalance, SceneError> {
    let Some(value) = sensor.optional("white_balance") else {
        return Ok(WhiteBalance::None);
    };
    if value.is_array() {
        return Ok(WhiteBalance::Gains(value.as_numbers(Range::positive(""))?));
    }
    if !value.is_text() {
        return Err(value.invalid("\"none\", \"d65\", \"gray\" or [r, g, b]"));
    }
    let d65 = spectral.and_then(Spectral::daylight_gains);
    let d65 = d65.map_or(WhiteBalance::None, WhiteBalance::Gains);
    value.as_choice(&[
        ("none", WhiteBalance::None),
        ("d65", d65),
        ("gray", WhiteBalance::Gray),
    ])
}

fn read_exposure(sensor: &Table<'_>) -> Result<Option<Exposure>, SceneError> {
    let Some(value) = sensor.optional("exposure") else {
        return Ok(None);
    };
    if value.is_table() {
        let table = value.as_table(&["auto_mean"])?;
        return Ok(Some(Exposure::AutoMean(
            table.number("auto_mean", Range::above(0.0, 1.0, ""))?,
        )));
    }
    Ok(Some(Exposure::Fixed(
        value.as_number(Range::positive("1 per W/(m² sr)"))?,
    )))
}

fn read_noise(sensor: &Table<'_>) -> Result<Option<Noise>, SceneError> {
    let Some(table) = sensor.table("noise", &["a", "b"])? else {
        return Ok(None);
    };
    let part = |field| table.number_or(field, Range::non_negative(""), 0.0);
    Ok(Some(Noise {
        a: part("a")?,
        b: part("b")?,
    }))
}

/// Reads `[render]`.
pub(super) fn read_render(root: &Table<'_>) -> Result<RenderSettings, SceneError> {
    let default = RenderSettings::default();
    let Some(table) = root.table("render", &["samples_per_pixel", "max_bounces"])? else {
        return Ok(default);
    };
    let whole = |field: &str, low, high, default| {
        table
            .optional(field)
            .map_or(Ok(default), |value| value.as_whole(low, high, ""))
    };
    Ok(RenderSettings {
        samples_per_pixel: whole(
            "samples_per_pixel",
            1,
            MAX_SAMPLES,
            default.samples_per_pixel,
        )?,
        max_bounces: whole("max_bounces", 0, u32::MAX, default.max_bounces)?,
    })
}
