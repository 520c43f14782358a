//! The light that arrives along one ray, by wavelength.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use uw_media::Spectrum;
use uw_media::spectral::{Curve, Response};

use crate::backend::Device;
use crate::integrator::RenderError;
use crate::prepare::{Geometry, Prepared};
use crate::rays::{RayBatch, Rays, Selection};
use crate::scene::{Scene, Spectral};

/// Width of a band, nm.
pub const BAND_NM: f64 = 10.0;
/// Points of a band at which light and response are taken.
const POINTS: u32 = 10;

/// Light in a narrow band around a wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandRadiance {
    /// Middle of the band, nm.
    pub wavelength_nm: f64,
    /// Radiance, W/(m² sr) as a channel that responds to this band alone would have it.
    pub radiance: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// Radiance that arrives at `eye`, m, from the unit vector `direction`, in bands of 10 nm over all that the camera of a scene
/// by wavelength sees; `samples` paths for each three bands. What several channels see together is their mean, weighted by
/// their responses. Empty of a scene in three bands, and where `stop` was set.
///
/// # Errors
/// The device fails, or light is no number.
pub fn ray_spectrum(
    scene: &Scene,
    geometry: &Arc<Geometry>,
    (eye, direction): (DVec3, DVec3),
    (samples, seed): (u32, u64),
    stop: &AtomicBool,
) -> Result<Vec<BandRadiance>, RenderError> {
    let Some(spectral) = &scene.spectral else {
        return Ok(Vec::new());
    };
    let (low, high) = spectral.range_nm();
    let count = ((high - low) / BAND_NM).floor() as u32;
    let middles: Vec<f64> = (0..count)
        .map(|i| low + BAND_NM * (f64::from(i) + 0.5))
        .filter(|&nm| spectral.seen(nm) > 0.0)
        .collect();
    let mut found = Vec::with_capacity(middles.len());
    for three in middles.chunks(3) {
        if stop.load(Ordering::Acquire) {
            return Ok(Vec::new());
        }
        let bands: [f64; 3] = std::array::from_fn(|k| three[k.min(three.len() - 1)]);
        let narrow = narrow(scene, spectral, bands);
        let geometry = narrow_geometry(geometry, spectral, bands);
        let prepared = Prepared::build_with(&narrow, geometry);
        let (mean, error) = measure(&prepared, eye, direction, samples, seed)?;
        found.extend(
            three
                .iter()
                .enumerate()
                .map(|(k, &wavelength_nm)| BandRadiance {
                    wavelength_nm,
                    radiance: mean[k],
                    standard_error: error[k],
                }),
        );
    }
    Ok(found)
}

/// The scene as channels see it that respond to a narrow band each.
fn narrow(scene: &Scene, spectral: &Spectral, middles_nm: [f64; 3]) -> Scene {
    let light = |triple, spectrum: Option<&Curve>| spectral.light_in(middles_nm, triple, spectrum);
    let mut narrow = scene.clone();
    for lamp in &mut narrow.lamps {
        lamp.intensity = light(lamp.intensity, lamp.spectrum.as_ref());
    }
    if let Some(sun) = &mut narrow.sun {
        sun.irradiance = light(sun.irradiance, spectral.sun.as_ref());
    }
    narrow.sky_radiance = light(scene.sky_radiance, spectral.sky.as_ref());
    narrow.spectral = Some(Spectral {
        response: Response::narrow(middles_nm, BAND_NM),
        ..spectral.clone()
    });
    if let (Some(water), Some(spectral)) = (&mut narrow.water, &narrow.spectral) {
        water.iops = spectral.wideband();
    }
    narrow
}

/// Surfaces that glow, as the same channels see them; the others know their reflectance by wavelength.
fn narrow_geometry(
    geometry: &Arc<Geometry>,
    spectral: &Spectral,
    middles_nm: [f64; 3],
) -> Arc<Geometry> {
    if geometry.largest_emission() == [0.0; 3] {
        return Arc::clone(geometry);
    }
    let emission = |emission| spectral.light_in(middles_nm, emission, None);
    Arc::new(geometry.with_emission(emission))
}

/// Mean and standard error of the radiance along a ray.
fn measure(
    prepared: &Prepared,
    eye: DVec3,
    direction: DVec3,
    samples: u32,
    seed: u64,
) -> Result<(Spectrum, Spectrum), RenderError> {
    let selection = Selection {
        lamps: (0..prepared.lamps.len()).collect(),
        ambient: true,
        max_events: u32::MAX,
    };
    let rays = Rays::new(&Device::CpuSimd, prepared, &selection)?;
    let batch = RayBatch {
        seed,
        key: 0,
        batch: 0,
        first: 0,
    };
    let directions = vec![direction; samples as usize];
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    let mut tracer = rays.tracer();
    for light in tracer.trace(&batch, eye, &directions)?.iter() {
        let total = light.total();
        for k in 0..3 {
            sum[k] += total[k];
            squares[k] += total[k] * total[k];
        }
    }
    let n = f64::from(samples.max(2));
    let mean = sum.map(|sum| sum / n);
    let error =
        std::array::from_fn(|k| ((squares[k] / n - mean[k] * mean[k]).max(0.0) / (n - 1.0)).sqrt());
    Ok((mean, error))
}

impl Spectral {
    /// What the channels together respond to a wavelength, nm.
    fn seen(&self, wavelength_nm: f64) -> f64 {
        let channels = self.response.channels.iter();
        channels.map(|curve| curve.at(wavelength_nm)).sum()
    }

    /// A light of three channels in narrow bands around `middles_nm`.
    fn light_in(
        &self,
        middles_nm: [f64; 3],
        triple: Spectrum,
        spectrum: Option<&Curve>,
    ) -> Spectrum {
        let relative = self.relative_light(spectrum);
        // The response of each channel is one over its whole range in the mean.
        let whole = self.response.areas();
        middles_nm.map(|middle| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for i in 0..POINTS {
                let nm = middle + BAND_NM * ((f64::from(i) + 0.5) / f64::from(POINTS) - 0.5);
                let light = relative([nm; 3]);
                for k in 0..3 {
                    let weight = self.response.channels[k].at(nm) / whole[k];
                    sum += weight * triple[k] * light[k];
                    weights += weight;
                }
            }
            if weights > 0.0 { sum / weights } else { 0.0 }
        })
    }
}
