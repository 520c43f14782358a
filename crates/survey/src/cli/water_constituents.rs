//! `uw water` from what a water holds.

use clap::Args;
use uw_media::spectral::Constituents;
use uw_twin::environment::PARTICLE_INDEX;

use super::error::CliError;

/// Backscatter fraction from which on it is molecules that scatter most.
const MOLECULAR: f64 = 0.4;

/// Arguments of `uw water` that tell what a water holds.
#[derive(Debug, Args)]
pub(super) struct ConstituentArguments {
    /// Chlorophyll of sea water, mg/m³ (0 to 100), in the place of a water type: a and b by wavelength of what goes with it.
    #[arg(
        long,
        group = "task",
        value_name = "CHL",
        allow_negative_numbers = true
    )]
    chlorophyll_mg_m3: Option<f64>,
    /// Absorption of yellow substance (CDOM) at 440 nm, 1/m (0 to 20). Default: what goes with the chlorophyll.
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    cdom_440_per_m: Option<f64>,
    /// Suspended minerals, g/m³ (0 to 2000). Default: none.
    #[arg(long, value_name = "G_M3", allow_negative_numbers = true)]
    minerals_g_m3: Option<f64>,
}

impl ConstituentArguments {
    /// What the water holds; `None` where it is told in another way.
    pub(super) fn constituents(&self) -> Result<Option<Constituents>, CliError> {
        let beside = [
            ("--cdom-440-per-m", self.cdom_440_per_m),
            ("--minerals-g-m3", self.minerals_g_m3),
        ];
        let Some(chlorophyll_mg_m3) = self.chlorophyll_mg_m3 else {
            return match beside.iter().find(|(_, value)| value.is_some()) {
                Some((name, _)) => Err(CliError::input(format!(
                    "{name} goes with --chlorophyll-mg-m3"
                ))),
                None => Ok(None),
            };
        };
        let minerals_g_m3 = self.minerals_g_m3.unwrap_or(0.0);
        Constituents::new(chlorophyll_mg_m3, self.cdom_440_per_m, minerals_g_m3)
            .map(Some)
            .map_err(CliError::input)
    }
}

/// The phase function of a water whose backscatter fraction is known, as a scene file has it.
pub(super) fn phase_entry(backscatter_fraction: f64) -> String {
    if backscatter_fraction < MOLECULAR {
        format!(
            "{{ model = \"fournier-forand\", n = {PARTICLE_INDEX:.2}, backscatter_fraction = {backscatter_fraction:.4} }}"
        )
    } else {
        "{ model = \"rayleigh\" }".to_owned()
    }
}
