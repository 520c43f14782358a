//! The renders that look up.

use std::time::Instant;

use uw_render::prepare::Prepared;

use super::plan::Upward;
use super::{DatasetError, Workshop};
use uw_twin::environment::{View, scene_in};
use uw_twin::estimate::upward::UpwardSampler;

/// Makes the render, unless it is there and as it was written.
pub(super) fn make(workshop: &Workshop, upward: &Upward) -> Result<(), DatasetError> {
    let render = upward.render();
    let path = render.path(workshop.folder);
    if workshop.watch.read_upward(&path)?.is_some() {
        return Ok(());
    }
    let started = Instant::now();
    let config = workshop.config;
    let target = workshop.target(workshop.patterns[0])?;
    let view = View::Up {
        depth_m: upward.depth_m,
    };
    let bands = config.water_bands();
    let scene = scene_in(&config.vehicle, &upward.water, bands, &target.target, view)?;
    let prepared = Prepared::build(&scene);
    let mut sampler = UpwardSampler::new(&scene, &prepared, render.seed(config.seed))?;
    let mut samples = workshop.effort.least;
    loop {
        if workshop.cancelled() {
            return Err(DatasetError::Stopped);
        }
        sampler.extend_to(samples)?;
        let image = sampler.image();
        // Relative error of the mean as the shallowest image's exposure would show it.
        let exposure = config.vehicle.up_mean / image.mean_radiance().max(1e-30);
        let (mean, error) = image.mean(&workshop.response, exposure);
        let known = (0..3).all(|k| error[k] <= config.accuracy.error_share * mean[k].max(1.0));
        if known || samples >= workshop.effort.most {
            break;
        }
        samples = (2 * samples).min(workshop.effort.most);
    }
    workshop.watch.write_upward(&path, sampler.image())?;
    workshop.times.add_upward(started.elapsed(), samples);
    Ok(())
}
