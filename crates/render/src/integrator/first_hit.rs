//! Layers without noise: what the ray through each pixel's centre meets first.

use glam::DVec3;
use rayon::prelude::*;
use uw_media::Spectrum;

use crate::prepare::{Prepared, Primitive};
use crate::scene::CameraRay;

/// The first surface behind a pixel's centre. Where nothing is met: infinite depth and zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Distance along the optical axis from the centre of projection, m.
    pub depth_m: f64,
    /// The point met, world frame, m.
    pub position_m: [f64; 3],
    /// Unit normal facing the camera, world frame.
    pub normal: [f64; 3],
    /// Reflectance per channel; of a spectral scene the mean over the channel's response.
    pub reflectance: Spectrum,
    /// Transmittance of the water between camera (the outer side of its port) and surface, per channel; of a spectral scene the mean over the channel's
    /// response.
    pub transmittance: Spectrum,
}

/// First hits of all pixels, row by row from the top, along rays that are bent by the camera's
/// port and straight from there (not bent at the water surface).
pub fn first_hits(scene: &Prepared) -> Vec<FirstHit> {
    let camera = &scene.camera;
    let of_row = |row| (0..camera.width).map(move |column| first_hit(scene, column, row));
    let rows = (0..camera.height).into_par_iter();
    rows.flat_map_iter(of_row).collect()
}

fn first_hit(scene: &Prepared, column: u32, row: u32) -> FirstHit {
    let camera = &scene.camera;
    let CameraRay {
        origin_m,
        direction,
    } = camera.ray(f64::from(column) + 0.5, f64::from(row) + 0.5);
    let Some(hit) = scene
        .geometry
        .closest(origin_m, direction, f64::INFINITY, Primitive::None)
    else {
        return FirstHit {
            depth_m: f64::INFINITY,
            position_m: [0.0; 3],
            normal: [0.0; 3],
            reflectance: [0.0; 3],
            transmittance: [0.0; 3],
        };
    };
    let point = scene.geometry.surface_point(&hit, direction);
    let (start, wet) = wet_part(scene, origin_m, direction, hit.t);
    let way = scene.way(start, direction, wet);
    FirstHit {
        depth_m: (origin_m - camera.position_m).dot(camera.forward)
            + hit.t * direction.dot(camera.forward),
        position_m: (origin_m + hit.t * direction).to_array(),
        normal: point.shading_normal.to_array(),
        reflectance: match &scene.spectrum {
            Some(spectrum) => spectrum.reflectance(point.reflectance, point.material),
            None => point.reflectance,
        },
        transmittance: match &scene.spectrum {
            Some(spectrum) => spectrum.transmittance(&way),
            None => scene.transmittance(&way),
        },
    }
}

/// Start and length of the part of the ray that lies below the water surface, m.
fn wet_part(scene: &Prepared, origin: DVec3, direction: DVec3, length: f64) -> (DVec3, f64) {
    let Some(boundary) = scene.boundary else {
        return (origin, length);
    };
    let end = origin + length * direction;
    let (above, end_above) = (origin.z > boundary.height, end.z > boundary.height);
    if above == end_above {
        return (origin, if above { 0.0 } else { length });
    }
    let to_surface = ((boundary.height - origin.z) / direction.z).clamp(0.0, length);
    if above {
        (origin + to_surface * direction, length - to_surface)
    } else {
        (origin, to_surface)
    }
}
