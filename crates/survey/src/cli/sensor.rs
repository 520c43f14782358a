//! `uw sensor`: linear radiance -> the numbers a camera stores.

use std::path::PathBuf;

use clap::Args;
use uw_render::image::{ExrImage, ImageFormat, write_frame};
use uw_render::scene::Scene;

use super::error::CliError;
use super::{output, scene_file};

/// Arguments of `uw sensor`.
#[derive(Debug, Args)]
pub(super) struct SensorArguments {
    /// Linear picture (.exr) with the channels R, G, B.
    input: PathBuf,
    /// Scene file, or name of a shipped scene, whose `[sensor]` to apply; the default sensor where it has none.
    #[arg(value_name = "NAME|FILE")]
    scene: PathBuf,
    /// Picture to write: .png or .tif.
    #[arg(short, long)]
    output: PathBuf,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl SensorArguments {
    /// Exposes the picture and writes it.
    pub(super) fn run(&self) -> Result<(), CliError> {
        if ImageFormat::of(&self.output).map_err(CliError::input)? == ImageFormat::Exr {
            let file = self.output.display();
            return Err(CliError::input(format!(
                "{file}: the output must be .png or .tif"
            )));
        }
        output::check_writable(&self.output)?;
        let scene = Scene::read(&scene_file(&self.scene)?).map_err(CliError::input)?;
        let image = ExrImage::read(&self.input).map_err(CliError::input)?;
        let frame = scene
            .sensor
            .unwrap_or_default()
            .expose(&image.picture, self.seed);
        write_frame(&self.output, &frame).map_err(CliError::failed)
    }
}
