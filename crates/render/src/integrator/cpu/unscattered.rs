//! Light that reaches a point in the water unscattered and from single directions, which no drawn direction meets:
//! the sun's beam and point lamps, directly and by the underside of the water surface.

use glam::DVec3;

use super::{
    sun_line::sun_reaches,
    unfold::{flip, segment_factor},
};
use crate::prepare::{Prepared, PreparedLamp, Primitive};

/// Light that arrives at a point from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Unit direction towards where the light comes from.
    pub towards: DVec3,
    /// Irradiance on a plane perpendicular to the beam, W/m² per channel.
    pub irradiance: [f64; 3],
}

/// The beams at `point` in the water: the sun where there is a water surface, and point lamps at their levels.
pub fn unscattered_beams(scene: &Prepared, point: DVec3) -> Vec<Beam> {
    let lamps = scene.lamps.iter().filter(|lamp| lamp.radius == 0.0);
    lamps
        .flat_map(|lamp| [false, true].map(|mirrored| lamp_beam(scene, lamp, mirrored, point)))
        .chain([sun_beam(scene, point)])
        .flatten()
        .collect()
}

fn sun_beam(scene: &Prepared, point: DVec3) -> Option<Beam> {
    let (sun, boundary) = (scene.sun.as_ref()?, scene.boundary.as_ref()?);
    sun_reaches(scene, sun, boundary, point, Primitive::None).then(|| {
        let way = (boundary.height - point.z).max(0.0) / sun.towards.z;
        attenuated(scene, sun.towards, sun.irradiance, way)
    })
}

fn lamp_beam(scene: &Prepared, lamp: &PreparedLamp, mirrored: bool, point: DVec3) -> Option<Beam> {
    if mirrored && scene.boundary.is_none() {
        return None;
    }
    let source = if mirrored {
        scene.mirror(lamp.position)
    } else {
        lamp.position
    };
    let distance = point.distance(source);
    if !(distance > 0.0) {
        return None;
    }
    let towards = (source - point) / distance;
    let emission = if mirrored { flip(-towards) } else { -towards };
    let relative = lamp.level
        * lamp.relative_intensity(emission)
        * segment_factor(scene, point, source, Primitive::None)
        / (distance * distance);
    let irradiance = lamp.intensity.map(|i| i * relative);
    Some(attenuated(scene, towards, irradiance, distance))
}

fn attenuated(scene: &Prepared, towards: DVec3, irradiance: [f64; 3], way_m: f64) -> Beam {
    let transmittance = scene
        .medium
        .as_ref()
        .map_or([1.0; 3], |m| m.transmittance(way_m));
    Beam {
        towards,
        irradiance: std::array::from_fn(|k| irradiance[k] * transmittance[k]),
    }
}
