//! `uw camera-fit lamp`: intensity and cone of a vehicle's lamps from a data sheet.

use std::collections::BTreeMap;

use clap::Args;
use serde_json::json;
use uw_media::spectral::illuminant;

use super::{Destination, rounded};
use crate::camera_fit::lamp::{SPECTRUM, efficacy_lm_per_w, lamp};
use crate::cli::error::CliError;
use crate::cli::output;
use crate::vehicle::Measurement;

#[derive(Debug, Args)]
pub(super) struct LampArguments {
    /// Luminous flux of one lamp at 100 %, lm.
    #[arg(long, value_name = "L", allow_hyphen_values = true)]
    lumen: f64,
    /// Full beam angle under water, degrees: where the intensity is half of that on the axis.
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    beam_angle_deg: f64,
    /// Spectrum of its light, which says how many lumens a watt has: led-2700k, led-3000k, led-4100k, led-5000k, led-6600k, halogen, ..
    #[arg(long, value_name = "NAME", default_value = SPECTRUM)]
    spectrum: String,
    /// Lumens per watt of light (not of electric power), where no spectrum says it.
    #[arg(
        long,
        value_name = "K",
        conflicts_with = "spectrum",
        allow_hyphen_values = true
    )]
    efficacy_lm_per_w: Option<f64>,
    #[command(flatten)]
    to: Destination,
}

impl LampArguments {
    /// Lumens per watt, and where they are from.
    fn efficacy(&self) -> Result<(f64, String), CliError> {
        if let Some(given) = self.efficacy_lm_per_w {
            return Ok((given, format!("light of {given} lm/W")));
        }
        let spectrum = illuminant(&self.spectrum)
            .map_err(|error| CliError::input(format_args!("--spectrum: {error}")))?;
        let found = efficacy_lm_per_w(&spectrum).round();
        Ok((found, format!("light of {} ({found} lm/W)", self.spectrum)))
    }

    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let (lumen, beam) = (self.lumen, self.beam_angle_deg);
        let (efficacy, assumed) = self.efficacy()?;
        let found = lamp(lumen, beam, efficacy).map_err(CliError::input)?;
        let from =
            format!("uw camera-fit lamp: {lumen} lm, beam of {beam} degrees, {assumed} assumed");
        let measured = || Measurement {
            error: None,
            from: from.clone(),
        };
        let known = BTreeMap::from([
            ("lamp_intensity".to_owned(), measured()),
            ("lamp_half_angle_deg".to_owned(), measured()),
        ]);
        file.vehicle.lamp_intensity = rounded(found.intensity_w_per_sr);
        file.vehicle.lamp_half_angle_deg = found.half_angle_deg;
        file.vehicle.lamp_profile = None;
        file.measured.remove("lamp_profile");
        let lamp = &file.vehicle;
        let told = match json {
            true => json!({
                "lamp_intensity": lamp.lamp_intensity, "lamp_half_angle_deg": lamp.lamp_half_angle_deg,
                "power_w": found.power_w, "efficacy_lm_per_w": efficacy,
            })
            .to_string(),
            false => format!(
                "lamp_intensity       {} W/sr in each channel, of each lamp\nlamp_half_angle_deg  {}\nassumed: {assumed}, so {:.3} W of \
                 light, a third in each channel; an intensity that falls with the cosine and ends at half the beam angle. sun_irradiance \
                 and sky_radiance must then be in W of a channel too",
                lamp.lamp_intensity, lamp.lamp_half_angle_deg, found.power_w
            ),
        };
        self.to.write(file, known)?;
        output::to_stdout(|out| writeln!(out, "{told}"))
    }
}
