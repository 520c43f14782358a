//! `uw calibrate`: pictures of a calibration routine -> profile.

use std::path::PathBuf;

use clap::Args;

use super::error::CliError;
use super::output;

/// Arguments of `uw calibrate`.
#[derive(Debug, Args)]
pub(super) struct CalibrateArguments {
    /// CSV table of the pictures: file,kind,depth_m,distance_m,light_pct with kind `depth` or `contrast`.
    manifest: PathBuf,
    /// Profile to write (uw-profile/1).
    #[arg(short, long)]
    output: PathBuf,
}

impl CalibrateArguments {
    /// Measures the pictures and writes the profile.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let made_by = concat!("uw calibrate ", env!("CARGO_PKG_VERSION"));
        let profile =
            uw_calib::calibrate_manifest(&self.manifest, made_by).map_err(CliError::input)?;
        profile.write(&self.output).map_err(CliError::failed)
    }
}
