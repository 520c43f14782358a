//! Light that reaches a point in the water unscattered and from single directions, which no drawn direction meets:
//! the sun's beam and point lamps, directly and by the underside of the water surface.

use glam::DVec3;
use uw_media::Spectrum;

use crate::prepare::{AirWay, AtWavelengths, Boundary, Prepared, PreparedLamp, Primitive, SunBeam};

/// Light that arrives at a point from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beam {
    /// Unit direction towards where the light comes from.
    pub(super) towards: DVec3,
    /// Irradiance on a plane perpendicular to the beam, W/m² per channel.
    pub(super) irradiance: Spectrum,
}

/// The beams at `point` in the water: the sun where there is a water surface, and point lamps at their levels.
pub(super) fn unscattered_beams(scene: &Prepared, point: DVec3) -> Vec<Beam> {
    let lamps = scene.lamps.iter().enumerate();
    let lamps = lamps.filter(|(_, lamp)| lamp.radius == 0.0);
    let of_lamp = |lamp: (usize, &PreparedLamp)| match scene.boundary.filter(|_| lamp.1.in_air) {
        Some(boundary) => [beam_from_air(scene, lamp, &boundary, point), None],
        None => [false, true].map(|mirrored| lamp_beam(scene, lamp, mirrored, point)),
    };
    lamps
        .flat_map(of_lamp)
        .chain([sun_beam(scene, point)])
        .flatten()
        .collect()
}

fn beam_from_air(
    scene: &Prepared,
    (index, lamp): (usize, &PreparedLamp),
    boundary: &Boundary,
    point: DVec3,
) -> Option<Beam> {
    let way = AirWay::between(boundary, point, lamp.position);
    let relative = lamp.level * lamp.relative_intensity(-way.in_air) * way.spread;
    let is_lit = relative > 0.0 && way.is_open(scene, point, Primitive::None);
    is_lit.then(|| {
        let irradiance = lamp.intensity.map(|i| i * relative);
        attenuated(scene, (point, way.towards), irradiance, way.wet_m, |set| {
            set.lamps[index]
        })
    })
}

fn sun_beam(scene: &Prepared, point: DVec3) -> Option<Beam> {
    let (sun, boundary) = (scene.sun.as_ref()?, scene.boundary.as_ref()?);
    sun_reaches(scene, sun, boundary, point).then(|| {
        let way = (boundary.height - point.z).max(0.0) / sun.towards.z;
        attenuated(scene, (point, sun.towards), sun.irradiance, way, |set| {
            set.sun
        })
    })
}

fn lamp_beam(
    scene: &Prepared,
    (index, lamp): (usize, &PreparedLamp),
    mirrored: bool,
    point: DVec3,
) -> Option<Beam> {
    let mirror = scene.boundary.filter(|_| mirrored);
    if mirrored && mirror.is_none() {
        return None;
    }
    let source = match mirror {
        Some(_) => scene.mirror(lamp.position),
        None => lamp.position,
    };
    let distance = point.distance(source);
    if !(distance > 0.0) {
        return None;
    }
    let towards = (source - point) / distance;
    let emission = match mirror {
        Some(_) => flip(-towards),
        None => -towards,
    };
    let relative = lamp.level
        * lamp.relative_intensity(emission)
        * reached_share(scene, point, towards, distance, mirror.as_ref())
        / (distance * distance);
    let irradiance = lamp.intensity.map(|i| i * relative);
    Some(attenuated(
        scene,
        (point, towards),
        irradiance,
        distance,
        |set| set.lamps[index],
    ))
}

/// Light at `point` after `way_m` in the water whose spectrum, relative to its channels, is `light`.
fn attenuated(
    scene: &Prepared,
    (point, towards): (DVec3, DVec3),
    irradiance: Spectrum,
    way_m: f64,
    light: impl Fn(&AtWavelengths) -> Spectrum,
) -> Beam {
    let way = scene.way(point, towards, way_m);
    let transmittance = match &scene.spectrum {
        Some(spectrum) => spectrum.mean(|set| {
            let (light, left) = (light(set), set.transmittance_of(&way));
            std::array::from_fn(|k| light[k] * left[k])
        }),
        None => scene.transmittance(&way),
    };
    Beam {
        towards,
        irradiance: std::array::from_fn(|k| irradiance[k] * transmittance[k]),
    }
}

/// Reflects the vertical component of a direction.
fn flip(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, direction.y, -direction.z)
}

/// Share of a lamp's light that comes along a line of `length`, or by the underside of the water surface: 0 where a
/// surface blocks it.
fn reached_share(
    scene: &Prepared,
    point: DVec3,
    towards: DVec3,
    length: f64,
    mirror: Option<&Boundary>,
) -> f64 {
    // Short of the lamp, which may be set into a surface.
    let is_clear = |origin, direction, length: f64| {
        let reach = length * (1.0 - 1e-12);
        !scene
            .geometry
            .occluded(origin, direction, reach, Primitive::None)
    };
    let Some(boundary) = mirror else {
        return f64::from(u8::from(is_clear(point, towards, length)));
    };
    let to_surface = ((boundary.height - point.z) / towards.z).clamp(0.0, length);
    let from_surface = point + to_surface * towards;
    let reaches = is_clear(point, towards, to_surface)
        && is_clear(from_surface, flip(towards), length - to_surface);
    boundary.internal_reflectance(towards.z.abs()) * f64::from(u8::from(reaches))
}

/// Whether the sun's beam reaches `point` in the water.
fn sun_reaches(scene: &Prepared, sun: &SunBeam, boundary: &Boundary, point: DVec3) -> bool {
    let geometry = &scene.geometry;
    let to_surface = (boundary.height - point.z).max(0.0) / sun.towards.z;
    if geometry.occluded(point, sun.towards, to_surface, Primitive::None) {
        return false;
    }
    let mut exit = point + to_surface * sun.towards;
    exit.z = boundary.height;
    let in_air = scene.features.geometry_in_air
        && geometry.occluded(exit, sun.towards_in_air, f64::INFINITY, Primitive::None);
    !in_air
}
