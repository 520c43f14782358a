//! Files of the film.

use std::borrow::Cow;
use std::path::Path;

use uw_render::{
    film::Film,
    gpu::GpuError,
    image::{ImageError, write_frame},
    layers::{self, RenderLayer},
    scene::Camera,
};

use super::{Export, Mouth, News, Shared, engine::Engine, refine::Stage};

/// Writes the files that were asked for, of the denoised film where that is shown.
///
/// # Errors
/// The graphics adapter fails; the files are still wanted then.
pub(super) fn serve(
    shared: &Shared,
    mouth: &Mouth,
    stage: &Stage,
    engine: &Engine,
    clean: Option<&Film>,
) -> Result<(), GpuError> {
    if shared.inbox().exports.is_empty() {
        return Ok(());
    }
    let film = match clean {
        Some(film) => Cow::Borrowed(film),
        None => engine.film()?,
    };
    let sound = film.check_finite(&stage.scene.lamp_names);
    let (exports, sensor) = {
        let mut inbox = shared.inbox();
        (std::mem::take(&mut inbox.exports), inbox.view.sensor)
    };
    for export in exports {
        if let Err(error) = &sound {
            mouth.say(News::NotExported(error.to_string()));
            continue;
        }
        let written = match &export {
            Export::Exr { path, layers } => write_exr(stage, &film, path, layers.as_deref()),
            Export::Photograph { path, seed } => {
                let frame = sensor.expose(&layers::picture(&film), *seed);
                write_frame(path, &frame)
            }
        };
        mouth.say(match written {
            Ok(()) => News::Exported(export.path().clone()),
            Err(error) => News::NotExported(error.to_string()),
        });
    }
    Ok(())
}

fn write_exr(
    stage: &Stage,
    film: &Film,
    path: &Path,
    wanted: Option<&[RenderLayer]>,
) -> Result<(), ImageError> {
    let all = || RenderLayer::by_names(&["all"], &stage.scene.lamp_names).unwrap_or_default();
    let wanted = wanted.map_or_else(all, <[RenderLayer]>::to_vec);
    let mut image = layers::exr_image(stage.scene, film, &wanted);
    let Camera { width, height, .. } = stage.scene.camera;
    image.attributes = vec![
        ("samples_per_pixel".to_owned(), film.samples().to_string()),
        ("seed".to_owned(), stage.job.seed.to_string()),
        ("size".to_owned(), format!("{width} x {height}")),
    ];
    if let Some(denoised) = film.denoised() {
        image.attributes.extend(denoised.facts.attributes());
    }
    image.write(path)
}
