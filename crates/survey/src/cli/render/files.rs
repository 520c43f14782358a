//! The files of a render: picture, layers and facts.

use std::path::Path;

use uw_render::denoise::DenoiseFacts;
use uw_render::film::Film;
use uw_render::image::{ImageFormat, write_frame};
use uw_render::integrator::RenderStats;
use uw_render::layers::{RenderLayer, exr_image, picture};
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::RenderArguments;
use super::summary::Facts;
use crate::cli::error::CliError;
use crate::cli::output;

/// A finished render and what it was made from.
pub(super) struct Rendered<'a> {
    pub(super) scene: &'a Scene,
    pub(super) prepared: &'a Prepared,
    pub(super) film: &'a Film,
    pub(super) stats: &'a RenderStats,
}

impl RenderArguments {
    /// Writes the picture and, where they are wanted, the facts.
    pub(super) fn write(
        &self,
        format: ImageFormat,
        layers: &[RenderLayer],
        result: &Rendered<'_>,
    ) -> Result<(), CliError> {
        let written = match format {
            ImageFormat::Exr => {
                let mut image = exr_image(result.prepared, result.film, layers);
                image.attributes = self.attributes(result);
                image.write(&self.output)
            }
            ImageFormat::Png | ImageFormat::Tiff => {
                let sensor = result.scene.sensor.unwrap_or_default();
                let frame = sensor.expose(&picture(result.film), self.seed);
                write_frame(&self.output, &frame)
            }
        };
        written.map_err(CliError::failed)?;
        if let Some(path) = &self.stats {
            output::to_file(path, |file| {
                let facts = Facts {
                    stats: result.stats,
                    changes: self.scene.changes(),
                };
                serde_json::to_writer_pretty(&mut *file, &facts)?;
                writeln!(file)
            })?;
        }
        if result.stats.interrupted {
            return Err(kept(&self.output, result.stats));
        }
        Ok(())
    }

    /// What an EXR file says about its making.
    fn attributes(&self, result: &Rendered<'_>) -> Vec<(String, String)> {
        let stats = result.stats;
        let scene = self.scene.scene.file_name().unwrap_or_default();
        let mut attributes = vec![
            ("uw.version", env!("CARGO_PKG_VERSION").to_owned()),
            ("uw.scene", scene.to_string_lossy().into_owned()),
            ("uw.seed", stats.seed.to_string()),
            ("uw.samples_per_pixel", stats.samples_per_pixel.to_string()),
            ("uw.backend", stats.backend.to_owned()),
        ];
        let changes = self.scene.changes();
        if !changes.is_empty() {
            attributes.push(("uw.changes", changes.join(" ")));
        }
        if let Some(spectral) = &result.scene.spectral {
            attributes.push(("uw.response", spectral.response.name.clone()));
            attributes.push(("uw.lights", spectral.lights.join("; ")));
        }
        if stats.filled_pixels > 0 {
            attributes.push(("uw.filled_pixels", stats.filled_pixels.to_string()));
        }
        let owned = |(name, value): (&str, String)| (name.to_owned(), value);
        let denoised = stats.denoised.iter().flat_map(DenoiseFacts::attributes);
        attributes.into_iter().map(owned).chain(denoised).collect()
    }
}

fn kept(output: &Path, stats: &RenderStats) -> CliError {
    let samples = stats.samples_per_pixel;
    CliError::Interrupted(format!(
        "interrupted: {} holds what was finished, {samples} samples per pixel",
        output.display()
    ))
}
