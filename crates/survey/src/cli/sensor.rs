//! `uw sensor`: linear radiance -> the numbers a camera stores.

use std::path::{Path, PathBuf};

use clap::Args;
use uw_render::image::{ExrImage, Frame, ImageFormat, write_bytes, write_frame};
use uw_render::scene::Scene;

use super::error::CliError;
use super::{output, scene_file};
use crate::photograph::{Exposed, jpeg};

/// Arguments of `uw sensor`.
#[derive(Debug, Args)]
pub(super) struct SensorArguments {
    /// Linear picture (.exr) with the channels R, G, B.
    input: PathBuf,
    /// Scene file, or name of a shipped scene, whose `[sensor]` to apply; the default sensor where it has none.
    #[arg(value_name = "NAME|FILE")]
    scene: PathBuf,
    /// Picture to write: .png or .tif, or .jpg, as a camera compresses it.
    #[arg(short, long)]
    output: PathBuf,
    /// Quality of a .jpg, on the scale of the IJG's library.
    #[arg(long, default_value_t = 90, value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: u8,
    /// Exposure time that a .jpg states in its EXIF, s; what it does to light is `exposure` of [sensor].
    #[arg(long, value_name = "S")]
    exposure_time_s: Option<f64>,
    /// F-number that goes with it.
    #[arg(long, value_name = "N", requires = "exposure_time_s")]
    f_number: Option<f64>,
    /// ISO that goes with it.
    #[arg(long, value_name = "ISO", requires = "exposure_time_s", value_parser = clap::value_parser!(u16).range(1..))]
    iso: Option<u16>,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl SensorArguments {
    /// Exposes the picture and writes it.
    pub(super) fn run(&self) -> Result<(), CliError> {
        let is_jpeg = is_jpeg(&self.output);
        if !is_jpeg
            && ImageFormat::of(&self.output)
                .ok()
                .is_none_or(|of| of == ImageFormat::Exr)
        {
            let file = self.output.display();
            return Err(CliError::input(format!(
                "{file}: the output must be .png, .tif or .jpg"
            )));
        }
        let exposed = self.exposed(is_jpeg)?;
        output::check_writable(&self.output)?;
        let scene = Scene::read(&scene_file(&self.scene)?).map_err(CliError::input)?;
        let image = ExrImage::read(&self.input).map_err(CliError::input)?;
        let frame = scene
            .sensor
            .unwrap_or_default()
            .expose(&image.picture, self.seed);
        match is_jpeg {
            true => self.write_jpeg(&frame, exposed.as_ref()),
            false => write_frame(&self.output, &frame).map_err(CliError::failed),
        }
    }

    fn write_jpeg(&self, frame: &Frame, exposed: Option<&Exposed>) -> Result<(), CliError> {
        let bytes = jpeg(frame, self.quality, exposed).map_err(CliError::input)?;
        write_bytes(&self.output, &bytes).map_err(CliError::failed)
    }

    /// What the file states of its exposure.
    fn exposed(&self, is_jpeg: bool) -> Result<Option<Exposed>, CliError> {
        let Some(time_s) = self.exposure_time_s else {
            return Ok(None);
        };
        if !is_jpeg {
            return Err(CliError::input("--exposure-time-s goes with a .jpg alone"));
        }
        let within = |option: &str, value: f64, least: f64, most: f64| match (least..=most)
            .contains(&value)
        {
            true => Ok(()),
            false => Err(CliError::input(format_args!(
                "{option} must be from {least} to {most}, got {value}"
            ))),
        };
        within("--exposure-time-s", time_s, 1e-6, 3600.0)?;
        self.f_number
            .map_or(Ok(()), |f| within("--f-number", f, 0.1, 1000.0))?;
        Ok(Some(Exposed {
            time_s,
            f_number: self.f_number,
            iso: self.iso,
        }))
    }
}

fn is_jpeg(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| ending == "jpg" || ending == "jpeg")
}
