//! One view of a target as a picture and as statistics, at any lamp level.

use std::sync::atomic::{AtomicBool, Ordering};

use uw_calib::ImageStats;
use uw_render::image::Picture;
use uw_render::integrator::RenderError;
use uw_render::prepare::Prepared;
use uw_render::scene::Scene;

use super::fields::{FieldSampler, Fields};
use super::pyramid::TexturePyramid;
use super::radiance::{Estimates, RadianceImage, Reflection, Source};
use super::response::CountResponse;
use super::statistics::{Shot, StandardErrors, standard_errors};
use super::target_model::{TargetModel, daylight_alone, lamps_alone};
use super::target_view::BeyondTarget;

/// Why there is no image of a target.
#[derive(Debug, thiserror::Error)]
pub enum TargetImageError {
    /// It would show more than the target.
    #[error(transparent)]
    BeyondTarget(#[from] BeyondTarget),
    /// The renderer failed.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// Radiance of every pixel from daylight and from the lamps at 100 %, in two independent estimates.
#[derive(Clone, Debug)]
pub struct TargetImage {
    /// Daylight.
    pub daylight: RadianceImage,
    /// Lamps at 100 %.
    pub lamps: RadianceImage,
    /// Both from the paths of single groups at a few pixels, for the standard errors.
    groups: [RadianceImage; 2],
}

impl TargetImage {
    /// Renders `scene`, which shows nothing but one quad with the texture of `pyramid`, square to the view.
    /// `Ok(None)` when `cancel` was set.
    ///
    /// # Errors
    /// When the image shows more than the target, or the renderer fails.
    pub fn render(
        scene: &Scene,
        pyramid: &TexturePyramid,
        seed: u64,
        paths_per_group: u32,
        cancel: &AtomicBool,
    ) -> Result<Option<Self>, TargetImageError> {
        let (daylight, lamps) = rayon::join(
            || Prepared::build(&daylight_alone(scene)),
            || Prepared::build(&lamps_alone(scene)),
        );
        let model = TargetModel::new(scene, &lamps, pyramid, true, seed)?;
        let fields = |source: &Source, prepared: &Prepared, seed: u64| {
            if cancel.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let mut sampler = FieldSampler::new(source, prepared, seed)?;
            sampler.extend_to(paths_per_group)?;
            Ok::<_, RenderError>(sampler.fit())
        };
        let image = |source: &Source, fields: &Fields| {
            let reflection = Reflection::new(source, model.lattice(1));
            let of_groups = Reflection::of_groups(source, model.error_lattice());
            [
                RadianceImage::new(source, fields, &reflection, Estimates::Halves),
                RadianceImage::new(source, fields, &of_groups, Estimates::Groups),
            ]
        };
        let (sun, lamp) = (model.daylight(), model.lamps());
        let (of_sun, of_lamps) = rayon::join(
            || Ok(fields(&sun, &daylight, seed)?.map(|f| image(&sun, &f))),
            || {
                let of_lamps = fields(&lamp, &lamps, seed.wrapping_add(1))?;
                Ok(of_lamps.map(|f| image(&lamp, &f)))
            },
        );
        let (of_sun, of_lamps): (Result<_, RenderError>, Result<_, RenderError>) =
            (of_sun, of_lamps);
        let both = of_sun?.zip(of_lamps?);
        Ok(
            both.map(|([daylight, sun_groups], [lamps, lamp_groups])| Self {
                daylight,
                lamps,
                groups: [sun_groups, lamp_groups],
            }),
        )
    }

    /// The image at a lamp level and an exposure (linear signal per radiance).
    fn shot(&self, exposure: f64, light_pct: f64) -> Shot<'_> {
        Shot {
            ambient: &self.daylight,
            lamps: &self.lamps,
            light_pct,
            exposure,
        }
    }

    /// Mean and contrast of the stored image.
    pub fn statistics(
        &self,
        response: &CountResponse,
        exposure: f64,
        light_pct: f64,
    ) -> ImageStats {
        self.shot(exposure, light_pct).statistics(response)
    }

    /// Standard errors of [`Self::statistics`] that the paths of the render leave, 8-bit counts.
    pub fn standard_errors(
        &self,
        response: &CountResponse,
        exposure: f64,
        light_pct: f64,
    ) -> StandardErrors {
        let [ambient, lamps] = &self.groups;
        let shot = Shot {
            ambient,
            lamps,
            light_pct,
            exposure,
        };
        standard_errors(&shot, response)
    }

    /// Radiance, the mean of both estimates.
    pub fn picture(&self, light_pct: f64) -> Picture {
        let lattice = self.daylight.lattice;
        let shot = self.shot(1.0, light_pct);
        let data = (0..lattice.columns() * lattice.rows())
            .map(|i| {
                let (a, b) = (shot.signal(0, i), shot.signal(1, i));
                std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
            })
            .collect();
        Picture {
            width: lattice.columns() as u32,
            height: lattice.rows() as u32,
            data,
        }
    }
}
