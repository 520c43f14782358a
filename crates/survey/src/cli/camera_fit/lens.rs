//! `uw camera-fit vignetting` and `even`: what a lens leaves of the light away from the middle, and pictures without it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use uw_render::image::{read_frame, write_frame};

use super::{Destination, find, frames, names, rounded};
use crate::camera_fit::even::even;
use crate::camera_fit::vignetting::fit;
use crate::cli::error::CliError;
use crate::cli::output;
use uw_calib::vehicle::{Measurement, Vignetting};

#[derive(Debug, Args)]
pub(super) struct VignettingArguments {
    /// PNG or TIFF pictures of a plain, evenly lit board that fills the view, half way to full scale, out of focus.
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    #[command(flatten)]
    to: Destination,
}

#[derive(Debug, Args)]
pub(super) struct EvenArguments {
    /// PNG or TIFF picture of the vehicle's camera.
    picture: PathBuf,
    /// The vehicle with vignetting and encoding: a file (uw-vehicle/1).
    #[arg(long, value_name = "NAME|FILE")]
    vehicle: String,
    /// Picture to write (PNG or TIFF).
    #[arg(short, long)]
    output: PathBuf,
}

impl VignettingArguments {
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let frames = frames(&self.pictures)?;
        let wrong =
            |error: String| CliError::input(format_args!("{}: {error}", names(&self.pictures)));
        let found = fit(&frames, file.vehicle.encoding).map_err(|e| wrong(e.to_string()))?;
        let rounded = found.vignetting.coefficients().map(rounded);
        let lens = Vignetting::new(rounded).map_err(wrong)?;
        file.vehicle.vignetting = Some(lens);
        let from = format!(
            "uw camera-fit vignetting: {} pictures of {} x {} pixels; error is that of the light in the corner",
            frames.len(),
            frames[0].width,
            frames[0].height
        );
        let known = Measurement {
            error: Some(super::rounded(found.corner_error)),
            from,
        };
        self.to
            .write(file, BTreeMap::from([("vignetting".to_owned(), known)]))?;
        output::to_stdout(|out| match json {
            true => writeln!(
                out,
                "{}",
                json!({
                    "vignetting": rounded, "errors": found.errors, "corner": lens.share(1.0), "corner_error": found.corner_error,
                    "slope": found.slope, "uneven": found.uneven,
                })
            ),
            false => writeln!(
                out,
                "vignetting  {rounded:?}, standard errors {:.1e} {:.1e} {:.1e}\nlight in the corner over that in the middle {:.4} ± {:.1e}; \
                 the board's light rises by {:+.1} % to the right and {:+.1} % to the lower edge (removed); blocks are off by {:.2} %",
                found.errors[0],
                found.errors[1],
                found.errors[2],
                lens.share(1.0),
                found.corner_error,
                100.0 * found.slope[0],
                100.0 * found.slope[1],
                100.0 * found.uneven
            ),
        })
    }
}

impl EvenArguments {
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let vehicle = find(&self.vehicle)?.vehicle;
        let lens = vehicle.vignetting.ok_or_else(|| {
            CliError::input(format_args!(
                "--vehicle: {} has no vignetting; `uw camera-fit vignetting` measures it",
                self.vehicle
            ))
        })?;
        let frame = read_frame(&self.picture).map_err(CliError::input)?;
        self.check_size(&frame, &vehicle)?;
        let even = even(lens, &frame, vehicle.encoding);
        write_frame(&self.output, &even).map_err(CliError::failed)
    }

    /// A cut or turned picture has its middle elsewhere.
    fn check_size(
        &self,
        frame: &uw_render::image::Frame,
        vehicle: &uw_calib::vehicle::Vehicle,
    ) -> Result<(), CliError> {
        let (got, own) = ([frame.width, frame.height], [vehicle.width, vehicle.height]);
        // Shapes alike within a pixel: the picture may be smaller, not cut.
        let shape = |size: [u32; 2]| f64::from(size[0]) / f64::from(size[1]);
        if (shape(got) / shape(own) - 1.0).abs() > 0.01 {
            return Err(CliError::input(format_args!(
                "{}: {} x {} pixels have another shape than the vehicle's {} x {}; take the whole picture, not cut or turned",
                Path::display(&self.picture),
                got[0],
                got[1],
                own[0],
                own[1]
            )));
        }
        Ok(())
    }
}
