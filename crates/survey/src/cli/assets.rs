//! `uw assets`: the project's own textures and models.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use super::error::CliError;
use super::output;
use uw_scenery::{Options, SceneryError};

/// Arguments of `uw assets`.
#[derive(Debug, Args)]
pub(super) struct AssetsArguments {
    /// Folder for `textures/` and `scenes/`.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Copy all shipped files as they are, scenes, models, profiles and vehicles among them, instead of making textures and models
    /// again. Files that are there already and differ are left, and named in an error before anything is written.
    #[arg(long, conflicts_with_all = ["seed", "main_texture_px", "texture_px", "jpeg_quality"])]
    copy: bool,
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
        if self.copy {
            return self.copy_all();
        }
        let options = Options {
            seed: self.seed,
            main_texture_px: self.main_texture_px,
            texture_px: self.texture_px,
            jpeg_quality: self.jpeg_quality,
        };
        let files = uw_scenery::write_all(&self.output, &options).map_err(|error| match error {
            SceneryError::OutOfRange { .. } => CliError::input(error),
            _ => CliError::failed(error),
        })?;
        list(&files)
    }

    /// Writes what is embedded, where nothing else is, and lists it.
    fn copy_all(&self) -> Result<(), CliError> {
        let files: Vec<_> = (uw_assets::ALL.files())
            .map(|(name, bytes)| (self.output.join(name), bytes))
            .collect();
        let differs = |path: &Path, bytes: &[u8]| {
            path.symlink_metadata().is_ok() && fs::read(path).ok().as_deref() != Some(bytes)
        };
        if let Some((path, _)) = files.iter().find(|(path, bytes)| differs(path, bytes)) {
            return Err(CliError::input(format_args!(
                "{}: is there and differs from the shipped file; give another folder (--output), or move it away",
                path.display()
            )));
        }
        for (path, bytes) in &files {
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder).map_err(|error| {
                    CliError::failed(format_args!("{}: {error}", folder.display()))
                })?;
            }
            output::to_file(path, |out| out.write_all(bytes))?;
        }
        list(&files.into_iter().map(|(path, _)| path).collect::<Vec<_>>())
    }
}

/// Lists files on standard output.
fn list(files: &[PathBuf]) -> Result<(), CliError> {
    output::to_stdout(|out| {
        files
            .iter()
            .try_for_each(|file| writeln!(out, "{}", file.display()))
    })
}
