//! `uw undistortion`: from a camera's pictures to those of an ideal one, as a file for the daemon.

use std::path::{Path, PathBuf};

use clap::Args;
use uw_calib::Encoding;
use uw_calib::vehicle::VehicleFile;

use super::error::{CliError, note};
use super::output;
use crate::treatment::Photographs;
use crate::undistort::port_distances_m;

/// Arguments of `uw undistortion`.
#[derive(Debug, Args)]
#[command(after_help = NEEDS)]
pub(super) struct UndistortionArguments {
    /// Camera that takes the pictures: a scene file, or the name of a shipped one, whose [camera] has their size, lens (distortion or fisheye) and port; or a calibration (*.yaml, *.xml) of ROS, OpenCV, Kalibr or Metashape.
    #[arg(value_name = "NAME|FILE")]
    camera: PathBuf,
    /// Vehicle whose width, height and hfov_deg are those of the ideal camera: a name among assets/vehicles or a file (*.toml).
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    vehicle: String,
    /// File to write (uw-undistortion/1).
    #[arg(short, long)]
    output: PathBuf,
}

const NEEDS: &str = "\
Name the file as `undistortion` under [images] of the daemon's configuration: pictures that `suggest_image` is given are then measured as the ideal
camera would have taken them, which is what `uw calibrate --camera` and `uw fit --camera` make profile and water file for. Behind a port the way differs with
the target's distance; it is kept for nine from 0.3 to 6 m.";

impl UndistortionArguments {
    /// Finds the way and writes it.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let file = VehicleFile::find(&self.vehicle, Path::new(""))
            .map_err(|error| CliError::input(format_args!("--vehicle: {error}")))?;
        let photographs = Photographs {
            camera: Some(self.camera.clone()),
            mask: None,
        };
        let known = (Some(&file.vehicle), None, Encoding::default());
        let (treatment, warnings) = photographs
            .treatment(known, &port_distances_m())
            .map_err(CliError::input)?;
        for warning in warnings {
            note(format_args!("uw: warning: {warning}"));
        }
        let undistortion = treatment
            .undistortion
            .ok_or_else(|| CliError::failed("the camera has no undistortion"))?;
        let made_by = concat!("uw undistortion ", env!("CARGO_PKG_VERSION"));
        let text = undistortion.to_json(made_by).map_err(CliError::failed)?;
        output::to_file(&self.output, |out| write!(out, "{text}"))
    }
}
