//! What the water scatters of a lamp's light towards the camera at a point: once, and on straight ways.

use glam::DVec3;
use uw_media::Spectrum;

use crate::prepare::{Coefficients, Prepared, PreparedLamp, Primitive};

/// Distance from a lamp's edge within which no flakes are, m: its housing keeps them away, and without it flakes at a point
/// lamp would have no finite variance.
const LAMP_CLEAR_M: f64 = 0.05;
/// Wavelengths that stand for a channel. They colour flakes; the mean of the picture does not depend on them.
const WAVELENGTHS: usize = 8;

/// Once-scattered light of one lamp at 100 %.
pub(super) struct Source<'a> {
    scene: &'a Prepared,
    lamp: &'a PreparedLamp,
    bands: Vec<Band<'a>>,
}

/// The water at a wavelength of each channel, or the channels as they are.
struct Band<'a> {
    /// What it counts, the lamp's spectrum included.
    weight: Spectrum,
    b: Spectrum,
    c: Spectrum,
    layers: &'a [Coefficients],
}

impl<'a> Source<'a> {
    /// The light of the lamp of that index; `None` where the water scatters nothing.
    pub(super) fn new(scene: &'a Prepared, lamp: usize) -> Option<Self> {
        let medium = scene.medium.as_ref().filter(|medium| medium.scatters())?;
        let bands = match &scene.spectrum {
            None => vec![Band {
                weight: [1.0; 3],
                b: medium.b,
                c: medium.c,
                layers: scene.layers.as_ref().map_or(&[], |own| &own.coefficients),
            }],
            Some(spectrum) => {
                let step = (spectrum.sets.len() / WAVELENGTHS).max(1);
                let some = spectrum.sets.iter().skip(step / 2).step_by(step);
                let sum = some.clone().fold([0.0; 3], |sum: Spectrum, set| {
                    std::array::from_fn(|k| sum[k] + set.weight[k])
                });
                let band = |set: &'a crate::prepare::AtWavelengths| Band {
                    weight: std::array::from_fn(|k| set.weight[k] / sum[k] * set.lamps[lamp][k]),
                    b: set.b,
                    c: set.c,
                    layers: &set.layers,
                };
                some.map(band).collect()
            }
        };
        Some(Self {
            scene,
            lamp: &scene.lamps[lamp],
            bands,
        })
    }

    /// Radiance towards the camera that is scattered per metre at `point`, W/(m³ sr). Of a disk lamp it is that of the point
    /// of the disk that `uniform`, two numbers in [0, 1], choose: the mean over them is the disk's.
    pub(super) fn at(&self, point: DVec3, uniform: [f64; 2]) -> Spectrum {
        let relative = self.relative(point, uniform);
        let Some((towards_lamp, distance_m, relative)) = relative else {
            return [0.0; 3];
        };
        let scene = self.scene;
        let to_camera = scene.camera.position_m - point;
        let range_m = to_camera.length();
        let way = scene.way(point, towards_lamp, distance_m).and(scene.way(
            point,
            to_camera / range_m,
            range_m,
        ));
        let here = scene.layers.as_ref().map(|own| own.counted_at(point));
        let mut sum = [0.0; 3];
        for band in &self.bands {
            let left = way.transmittance(band.c, band.layers);
            let b = band.scattering(here.as_deref());
            for k in 0..3 {
                sum[k] += band.weight[k] * b[k] * left[k];
            }
        }
        std::array::from_fn(|k| sum[k] * relative * self.lamp.intensity[k])
    }

    /// Direction and distance of the lamp, and what comes of its intensity but for the water's losses and coefficient,
    /// 1/(m² sr); `None` where that is nothing.
    fn relative(&self, point: DVec3, uniform: [f64; 2]) -> Option<(DVec3, f64, f64)> {
        let (scene, lamp) = (self.scene, self.lamp);
        if scene.in_air(point) || point.distance(lamp.position) < lamp.radius + LAMP_CLEAR_M {
            return None;
        }
        let offset = self.place_on_disk(uniform) - point;
        let distance_m = offset.length();
        let towards_lamp = offset / distance_m;
        let intensity = lamp.relative_intensity(-towards_lamp);
        if !(intensity > 0.0) {
            return None;
        }
        // Short of the lamp, which may be set into a surface.
        let reach = distance_m * (1.0 - 1e-9);
        let geometry = &scene.geometry;
        if geometry.occluded(point, towards_lamp, reach, Primitive::None) {
            return None;
        }
        let to_camera = (scene.camera.position_m - point).normalize_or_zero();
        let phase = scene.medium.as_ref()?;
        let cosine = -towards_lamp.dot(to_camera);
        let phase = phase.phase.value((0.5 * (1.0 - cosine)).clamp(0.0, 1.0));
        Some((
            towards_lamp,
            distance_m,
            intensity * phase / (distance_m * distance_m),
        ))
    }

    fn place_on_disk(&self, [u, v]: [f64; 2]) -> DVec3 {
        let lamp = self.lamp;
        if lamp.radius == 0.0 {
            return lamp.position;
        }
        let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
        let radius = lamp.radius * u.sqrt();
        lamp.position + radius * (cos * lamp.tangent.0 + sin * lamp.tangent.1)
    }
}

impl Band<'_> {
    /// Scattering coefficient where nodes and clouds count `here`, 1/m.
    fn scattering(&self, here: Option<&[f64]>) -> Spectrum {
        let Some(here) = here else {
            return self.b;
        };
        let parts = here.iter().zip(self.layers);
        parts.fold([0.0; 3], |sum, (count, own)| {
            std::array::from_fn(|k| sum[k] + count * own.b[k])
        })
    }
}
