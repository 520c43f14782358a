//! Whether every view of a grid sees its target alone, found out before anything is rendered.

use uw_render::scene::{Texture, TextureFilter};

use super::{DatasetConfig, DatasetError};
use uw_twin::environment::{Target, View, scene_in};
use uw_twin::estimate::target_view::TargetView;

/// Checks all views of `config`; the error names the first that sees past its target.
pub(super) fn check(config: &DatasetConfig) -> Result<(), DatasetError> {
    let waters = config.waters();
    let Some(water) = waters.first() else {
        return Ok(());
    };
    for pattern in config.patterns() {
        // Where a ray lands does not depend on the picture on the target.
        let texture = Texture {
            width: 1,
            height: 1,
            texels: vec![[0.5; 3]].into(),
            filter: TextureFilter::Nearest,
        };
        let target = Target { pattern, texture };
        for (depth_m, distance_m, tilt_deg) in poses(config) {
            let view = View::Tilted {
                depth_m,
                distance_m,
                tilt_deg,
            };
            let bands = config.water_bands();
            let scene = scene_in(&config.vehicle, water, bands, &target, view)?;
            TargetView::new(&scene).map_err(|e| {
                DatasetError::Config(format!(
                    "{} at depths_m {depth_m}, distances_m {distance_m}, tilts_deg {tilt_deg}: {e}",
                    pattern.name()
                ))
            })?;
        }
    }
    Ok(())
}

/// Depth, distance and tilt of all views.
fn poses(config: &DatasetConfig) -> impl Iterator<Item = (f64, f64, f64)> {
    config.depths_m.iter().flat_map(move |&depth_m| {
        config.distances_m.iter().flat_map(move |&distance_m| {
            let tilts = config.tilts_deg.iter();
            tilts.map(move |&tilt_deg| (depth_m, distance_m, tilt_deg))
        })
    })
}
