//! `uw demo`: the whole way, small.

use std::path::{Path, PathBuf};

use clap::Args;

use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::model_file;
use crate::demo::{self, DemoError, DemoOptions};
use uw_assets::assets_dir;
use uw_calib::vehicle::VehicleFile;
use uw_scenery::textures::Pattern;
use uw_twin::environment::{JerlovWater, WaterBody};

/// Arguments of `uw demo`.
#[derive(Debug, Args)]
pub(super) struct DemoArguments {
    /// Jerlov type of the water, or a mixture such as IB-II@0.4.
    #[arg(long, default_value = "1C")]
    jerlov: String,
    /// Backscatter fraction of the phase function.
    #[arg(long, default_value_t = 0.0183)]
    backscatter_fraction: f64,
    /// What the vehicle looks at: a texture's name.
    #[arg(long, default_value = "hull_red")]
    target: String,
    /// The vehicle: a shipped one's name or a file (uw-vehicle/1).
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    vehicle: String,
    /// Folder for pictures, profile, plot and report: a new or empty one, or that of an earlier demonstration.
    #[arg(short, long, value_name = "DIR", default_value = "demo")]
    output: PathBuf,
    /// Model file, or the name of a shipped one. Default: default.
    #[arg(long, value_name = "NAME|FILE")]
    model: Option<PathBuf>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads; one per core by default.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=4096))]
    threads: Option<u64>,
}

impl DemoArguments {
    pub(super) fn run(&self) -> Result<(), CliError> {
        let jerlov: JerlovWater = self
            .jerlov
            .parse()
            .map_err(|e| CliError::input(format_args!("--jerlov: {e}")))?;
        let pattern = Pattern::from_name(&self.target).ok_or_else(|| {
            let known = Pattern::ALL.map(Pattern::name).join(", ");
            CliError::input(format_args!(
                "--target must be one of {known}, got {:?}",
                self.target
            ))
        })?;
        let options = DemoOptions {
            water: WaterBody {
                jerlov,
                backscatter_fraction: self.backscatter_fraction,
            },
            pattern,
            vehicle: VehicleFile::find(&self.vehicle, Path::new(""))
                .map_err(|e| CliError::input(format_args!("--vehicle: {e}")))?
                .vehicle,
            model: self.model.as_deref().map(model_file).transpose()?,
            seed: self.seed,
            threads: self.threads.map(|n| n as usize),
        };
        let assets = assets_dir().map_err(CliError::input)?;
        let cancel = cancel_flag()?;
        let report = demo::run(&options, &self.output, &assets, &cancel, &|line| note(line))
            .map_err(|e| match e {
                _ if cancel.load(std::sync::atomic::Ordering::Relaxed) => CliError::Interrupted(
                    "interrupted; what was written so far is in the output folder".into(),
                ),
                DemoError::Input(_) | DemoError::Environment(_) => CliError::input(e),
                other => CliError::failed(other),
            })?;
        note(format_args!(
            "Read {}; it explains itself. The pictures depth_*m.png beside it show before and after.",
            report.display()
        ));
        Ok(())
    }
}
