//! `uw camera-fit lamp`: intensity and cone of a vehicle's lamps from a data sheet.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use uw_media::spectral::{efficacy_lm_per_w, illuminant};
use uw_render::scene::photometry::Photometry;

use super::{Destination, rounded};
use crate::camera_fit::lamp::{LampFit, SPECTRUM, lamp, lamp_of_file};
use crate::cli::error::CliError;
use crate::cli::output;
use uw_calib::vehicle::Measurement;

#[derive(Debug, Args)]
pub(super) struct LampArguments {
    /// Luminous flux of one lamp at 100 %, lm; that of --file where it is left out.
    #[arg(
        long,
        value_name = "L",
        required_unless_present = "file",
        allow_hyphen_values = true
    )]
    lumen: Option<f64>,
    /// Full beam angle under water, degrees: where the intensity is half of that on the axis.
    #[arg(
        long,
        value_name = "A",
        required_unless_present = "file",
        conflicts_with = "file",
        allow_hyphen_values = true
    )]
    beam_angle_deg: Option<f64>,
    /// The maker's photometric file, IES LM-63 (.ies) or EULUMDAT (.ldt), which has the beam and the lumens.
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
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

    /// The lamp, and what it is from.
    fn found(&self, efficacy: f64) -> Result<(LampFit, String), CliError> {
        if let Some(path) = &self.file {
            let name = path.display();
            let file = Photometry::read(path)
                .map_err(|reason| CliError::input(format_args!("{name}: {reason}")))?;
            let found = lamp_of_file(&file, self.lumen, efficacy).map_err(CliError::input)?;
            let lumen = found.power_w * efficacy;
            let uneven = 100.0 * file.uneven;
            return Ok((
                found,
                format!("{name}, {lumen:.0} lm, half planes within {uneven:.0} % of their mean"),
            ));
        }
        // One of the two is required, and the beam angle with the lumens.
        let (lumen, beam) = (
            self.lumen.unwrap_or_default(),
            self.beam_angle_deg.unwrap_or_default(),
        );
        let found = lamp(lumen, beam, efficacy).map_err(CliError::input)?;
        Ok((found, format!("{lumen} lm, beam of {beam} degrees")))
    }

    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let (efficacy, assumed) = self.efficacy()?;
        let (found, beam) = self.found(efficacy)?;
        let from = format!("uw camera-fit lamp: {beam}, {assumed} assumed");
        let measured = |field: &str| {
            let from = from.clone();
            (field.to_owned(), Measurement { error: None, from })
        };
        let mut known = BTreeMap::from(["lamp_intensity", "lamp_half_angle_deg"].map(measured));
        file.vehicle.lamp_intensity = rounded(found.intensity_w_per_sr);
        file.vehicle.lamp_half_angle_deg = found.half_angle_deg;
        file.measured.remove("lamp_profile");
        if found.profile.is_some() {
            known.extend([measured("lamp_profile")]);
        }
        let rows = found.profile.as_ref();
        file.vehicle.lamp_profile =
            rows.map(|rows| rows.iter().map(|row| row.map(rounded)).collect());
        let shape = match &found.profile {
            None => {
                "an intensity that falls with the cosine and ends at half the beam angle".to_owned()
            }
            Some(rows) => format!(
                "the file's beam, {} rows, as it is in air and the same all round the axis",
                rows.len()
            ),
        };
        let lamp = &file.vehicle;
        let told = match json {
            true => json!({
                "lamp_intensity": lamp.lamp_intensity, "lamp_half_angle_deg": lamp.lamp_half_angle_deg,
                "power_w": found.power_w, "efficacy_lm_per_w": efficacy,
            })
            .to_string(),
            false => format!(
                "lamp_intensity       {} W/sr in each channel, of each lamp\nlamp_half_angle_deg  {}\nassumed: {assumed}, so {:.3} W of \
                 light, a third in each channel; {shape}. sun_irradiance \
                 and sky_radiance must then be in W of a channel too",
                lamp.lamp_intensity, lamp.lamp_half_angle_deg, found.power_w
            ),
        };
        self.to.write(file, known)?;
        output::to_stdout(|out| writeln!(out, "{told}"))
    }
}
