//! `uw assets`: the project's own textures and models.

use std::path::PathBuf;

use clap::Args;

use super::error::CliError;
use super::output;
use crate::scenery::{self, Options, SceneryError};

/// Arguments of `uw assets`.
#[derive(Debug, Args)]
pub(super) struct AssetsArguments {
    /// Folder for `textures/` and `scenes/`.
    #[arg(short, long)]
    output: PathBuf,
    /// Seed of all patterns and models; that of the shipped files is the default.
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u32,
    /// Width and height of the textures that models carry, texels.
    #[arg(long, default_value_t = Options::default().main_texture_px)]
    main_texture_px: u32,
    /// Width and height of the other textures, texels.
    #[arg(long, default_value_t = Options::default().texture_px)]
    texture_px: u32,
    /// Quality of the pictures inside models, 1 to 100.
    #[arg(long, default_value_t = Options::default().jpeg_quality)]
    jpeg_quality: u8,
}

impl AssetsArguments {
    /// Makes the files and lists them.
    pub(super) fn run(&self) -> Result<(), CliError> {
        let options = Options {
            seed: self.seed,
            main_texture_px: self.main_texture_px,
            texture_px: self.texture_px,
            jpeg_quality: self.jpeg_quality,
        };
        let files = scenery::write_all(&self.output, &options).map_err(|error| match error {
            SceneryError::OutOfRange { .. } => CliError::input(error),
            _ => CliError::failed(error),
        })?;
        output::to_stdout(|out| {
            files
                .iter()
                .try_for_each(|file| writeln!(out, "{}", file.display()))
        })
    }
}
