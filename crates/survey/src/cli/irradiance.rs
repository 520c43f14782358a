//! `uw irradiance`: scene file -> irradiances at depths, as a table with standard errors.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, value_parser};
use uw_render::irradiance::{self, DepthIrradiance, IrradianceError, IrradiancePlan};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::device::DeviceArguments;
use super::error::{CliError, note};
use super::numbers::significant;
use super::progress::ProgressDisplay;
use super::{interrupt, output, scene_file};

const CHANNELS: [&str; 3] = ["r", "g", "b"];
const DIGITS: usize = 9;

/// Arguments of `uw irradiance`.
#[derive(Debug, Args)]
pub(super) struct IrradianceArguments {
    /// Scene file (uw-scene/1), or name of a shipped scene, with a water surface.
    #[arg(value_name = "NAME|FILE")]
    scene: PathBuf,
    /// Depths below the surface in metres, at the camera's horizontal position; 0 is just below the surface.
    #[arg(long, required = true, value_delimiter = ',', value_name = "Z,..", allow_hyphen_values = true, value_parser = depth)]
    depths_m: Vec<f64>,
    /// Directions per depth and hemisphere.
    #[arg(long, default_value_t = 1 << 16, value_parser = value_parser!(u32).range(2..=1 << 30))]
    samples: u32,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    device: DeviceArguments,
    /// Table: depth_m, channel, quantity (E_d, E_u, E_od, E_ou in W/m²; L_u in W/(m² sr)), value, standard_error.
    #[arg(short, long)]
    output: PathBuf,
    /// No progress on standard error.
    #[arg(long)]
    quiet: bool,
}

fn depth(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a finite number >= 0 m".to_owned()),
    }
}

impl IrradianceArguments {
    /// Measures, then writes the table. With `json` standard error holds nothing but an error object.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let cancel = interrupt::cancel_flag()?;
        let scene = Scene::read(&scene_file(&self.scene)?).map_err(CliError::input)?;
        if !json {
            scene
                .warnings
                .iter()
                .for_each(|warning| note(format_args!("uw: warning: {warning}")));
        }
        let plan = IrradiancePlan {
            depths_m: self.depths_m.clone(),
            samples: self.samples,
            seed: self.seed,
            threads: self.device.threads(),
            max_bounces: scene.render.max_bounces,
        };
        let display = ProgressDisplay::start(self.quiet || json, true);
        let observe = |share| display.update(Some(share), || "measuring".to_owned());
        let device = self.device.open()?;
        let prepared = Prepared::build(&scene);
        let measured = irradiance::measure(&device, &prepared, &plan, &cancel, &observe);
        display.finish();
        let table = measured.map_err(|error| self.no_table(&error))?;
        output::to_file(&self.output, |file| write_table(file, &table))
    }

    fn no_table(&self, error: &IrradianceError) -> CliError {
        match error {
            IrradianceError::Interrupted => {
                CliError::Interrupted(format!("interrupted: {error}; nothing has been written"))
            }
            IrradianceError::Threads(_) | IrradianceError::Gpu(_) | IrradianceError::Render(_) => {
                CliError::failed(error)
            }
            _ => CliError::input(format!("{}: {error}", self.scene.display())),
        }
    }
}

fn write_table(file: &mut dyn Write, table: &[DepthIrradiance]) -> io::Result<()> {
    writeln!(file, "depth_m,channel,quantity,value,standard_error")?;
    for row in table {
        for (k, channel) in CHANNELS.iter().enumerate() {
            for (quantity, estimate) in row.quantities() {
                writeln!(
                    file,
                    "{},{channel},{quantity},{},{}",
                    row.depth_m,
                    significant(estimate.value[k], DIGITS),
                    significant(estimate.standard_error[k], DIGITS)
                )?;
            }
        }
    }
    Ok(())
}
