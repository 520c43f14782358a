//! The vehicle that looks: its camera, lamps and sensor, and the daylight above it.

mod file;
mod level_curve;

pub use file::{Measurement, VehicleError, VehicleFile};
pub use level_curve::LevelCurve;
pub use uw_media::Vignetting;

use serde::{Deserialize, Serialize};
use uw_media::MediaError;
use uw_media::spectral::{Curve, Response, illuminant};

use crate::{Encoding, Rig};

/// The clear sky's own spectra, by the sun's zenith angle.
const CLEAR_SKY: &str = "clear-sky";

/// A vehicle and the daylight; every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vehicle {
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Horizontal field of view, degrees, in (0, 180).
    pub hfov_deg: f64,
    /// Sideways distance of each of the two lamps from the camera, m.
    pub lamp_offset_m: f64,
    /// Intensity of each lamp on its axis at 100 %, W/sr.
    pub lamp_intensity: f64,
    /// Half angle of the lamps' cones, degrees.
    pub lamp_half_angle_deg: f64,
    /// Linear signal per radiance, m² sr/W, for images of the target: one fixed exposure. The default is the one that
    /// the grid of the paper chose (`exposure_grey`), at which the shipped model was trained.
    pub exposure: f64,
    /// Mean linear signal of the shallowest image that looks up; its exposure serves all depths.
    pub up_mean: f64,
    /// Sensor noise of the linear signal y: variance `noise_a`·y + `noise_b`; the default is of the order of a
    /// current small sensor at base gain (assets/water/noise_params.csv).
    pub noise_a: f64,
    /// See `noise_a`.
    pub noise_b: f64,
    /// Zenith angle of the sun in air, degrees.
    pub sun_zenith_deg: f64,
    /// Irradiance of the sun on a plane perpendicular to its beam, W/m², all channels.
    pub sun_irradiance: f64,
    /// Radiance of the sky, W/(m² sr), all channels.
    pub sky_radiance: f64,
    /// How counts of its pictures stand for light; sRGB is not stated in files.
    #[serde(skip_serializing_if = "is_srgb")]
    pub encoding: Encoding,
    /// What the lens leaves of the light away from the middle; `None`: all of it. Views rendered for the vehicle have none, and pictures of
    /// its camera are rid of it when they are read ([`crate::even`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignetting: Option<Vignetting>,
    /// Angle from a lamp's axis in degrees, rising, and intensity over that on it, >= 0; dark beyond the last. `None`: the cosine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lamp_profile: Option<Vec<[f64; 2]>>,
    /// Light that the lamps give at the levels they are set to; `None`: light is in proportion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_curve: Option<LevelCurve>,
    /// Response of the camera by its name; `None` for three boxes. This and the spectra need `bands` by wavelength.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub response: Option<String>,
    /// Name of the lamps' spectrum; `None`: the same at every wavelength of a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lamp_spectrum: Option<String>,
    /// "clear-sky", or `None`: sun and sky the same at every wavelength of a channel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub daylight_spectrum: Option<String>,
}

/// Whether the encoding is the one that is not stated.
fn is_srgb(encoding: &Encoding) -> bool {
    *encoding == Encoding::Srgb
}

/// What a vehicle sees and shines by wavelength.
#[derive(Clone, Debug)]
pub struct Colours {
    /// Response of the camera.
    pub response: Response,
    /// Relative spectrum of the lamps, where they have one.
    pub lamps: Option<Curve>,
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            hfov_deg: 60.0,
            lamp_offset_m: 0.3,
            lamp_intensity: 0.4,
            lamp_half_angle_deg: 50.0,
            exposure: 8.61,
            up_mean: 0.4,
            noise_a: 2e-4,
            noise_b: 1e-6,
            sun_zenith_deg: 30.0,
            sun_irradiance: 1.0,
            sky_radiance: 0.1,
            encoding: Encoding::Srgb,
            vignetting: None,
            lamp_profile: None,
            level_curve: None,
            response: None,
            lamp_spectrum: None,
            daylight_spectrum: None,
        }
    }
}

impl Vehicle {
    /// Camera, sensor and lamps as profiles and models state them; `exposure` in m² sr/W, `None` where every picture has
    /// its own.
    pub fn rig(&self, exposure: Option<f64>) -> Rig {
        Rig {
            hfov_deg: Some(self.hfov_deg),
            exposure_m2_sr_per_w: exposure,
            noise_a: Some(self.noise_a),
            noise_b: Some(self.noise_b),
            lamps: Some(2.0),
            lamp_offset_m: Some(self.lamp_offset_m),
            lamp_intensity_w_per_sr: Some(self.lamp_intensity),
            lamp_half_angle_deg: Some(self.lamp_half_angle_deg),
            ..Rig::of_size([self.width, self.height])
        }
    }

    /// The camera's response and the lamps' spectrum.
    ///
    /// # Errors
    /// A name that is not known.
    pub fn colours(&self) -> Result<Colours, MediaError> {
        Ok(Colours {
            response: (self.response.as_deref())
                .map_or_else(|| Ok(Response::boxes()), Response::named)?,
            lamps: self.lamp_spectrum.as_deref().map(illuminant).transpose()?,
        })
    }

    /// The same without what counts by wavelength alone.
    pub fn in_three_bands(&self) -> Self {
        Self {
            response: None,
            lamp_spectrum: None,
            daylight_spectrum: None,
            ..self.clone()
        }
    }

    /// The first field that counts by wavelength alone, if one is given.
    pub fn needs_wavelengths(&self) -> Option<&'static str> {
        let given = [
            ("response", self.response.is_some()),
            ("lamp_spectrum", self.lamp_spectrum.is_some()),
            ("daylight_spectrum", self.daylight_spectrum.is_some()),
        ];
        given
            .iter()
            .find(|(_, given)| *given)
            .map(|(field, _)| *field)
    }

    fn check_profile(&self) -> Result<(), String> {
        let Some(rows) = &self.lamp_profile else {
            return Ok(());
        };
        let wrong = |what: String| {
            Err(format!(
                "vehicle.lamp_profile must be two or more pairs of an angle in [0, 180] degrees, rising from 0, and a relative intensity \
                 >= 0, not all 0; got {what}"
            ))
        };
        if rows.len() < 2 {
            return wrong(format!("{} pairs", rows.len()));
        }
        if rows[0][0] != 0.0 {
            return wrong(format!("{} degrees first", rows[0][0]));
        }
        let right =
            |row: &[f64; 2]| (0.0..=180.0).contains(&row[0]) && row[1] >= 0.0 && row[1].is_finite();
        if let Some(row) = rows.iter().find(|row| !right(row)) {
            return wrong(format!("{row:?}"));
        }
        if let Some(pair) = rows.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return wrong(format!("{:?} after {:?}", pair[1], pair[0]));
        }
        match rows.iter().any(|row| row[1] > 0.0) {
            true => Ok(()),
            false => wrong("darkness".to_owned()),
        }
    }

    /// Checks every value; the error names the field, the value and what would be right.
    pub fn check(&self) -> Result<(), String> {
        let positive = [
            ("hfov_deg", self.hfov_deg, 179.0),
            ("lamp_intensity", self.lamp_intensity, f64::MAX),
            ("lamp_half_angle_deg", self.lamp_half_angle_deg, 180.0),
            ("exposure", self.exposure, f64::MAX),
            ("up_mean", self.up_mean, 1.0),
        ];
        for (field, value, most) in positive {
            if !(value > 0.0 && value <= most) {
                return Err(format!(
                    "vehicle.{field} must be in (0, {most}], got {value}"
                ));
            }
        }
        let not_negative = [
            ("lamp_offset_m", self.lamp_offset_m),
            ("noise_a", self.noise_a),
            ("noise_b", self.noise_b),
            ("sun_irradiance", self.sun_irradiance),
            ("sky_radiance", self.sky_radiance),
        ];
        for (field, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(format!(
                    "vehicle.{field} must be finite and >= 0, got {value}"
                ));
            }
        }
        self.check_profile()?;
        if let Some(Err(error)) = self.response.as_deref().map(Response::named) {
            return Err(format!("vehicle.response: {error}"));
        }
        if let Some(Err(error)) = self.lamp_spectrum.as_deref().map(illuminant) {
            return Err(format!("vehicle.lamp_spectrum: {error}"));
        }
        if let Some(other) = self
            .daylight_spectrum
            .as_deref()
            .filter(|s| *s != CLEAR_SKY)
        {
            return Err(format!(
                "vehicle.daylight_spectrum must be \"{CLEAR_SKY}\" or left out, got {other:?}"
            ));
        }
        if !(0.0..90.0).contains(&self.sun_zenith_deg) {
            return Err(format!(
                "vehicle.sun_zenith_deg must be in [0, 90), got {}",
                self.sun_zenith_deg
            ));
        }
        if self.width < 10 || self.height < 6 || self.width > 8192 || self.height > 8192 {
            return Err(format!(
                "vehicle.width and height must be 10 x 6 to 8192 x 8192 pixels, got {} x {}",
                self.width, self.height
            ));
        }
        Ok(())
    }
}
