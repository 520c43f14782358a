//! The native path tracer.

mod ambient_flight;
mod ambient_path;
mod ambient_surface;
mod ambient_window;
mod bridge;
mod camera_ray;
mod equiangular;
mod lamp_join;
mod lamp_path;
mod lamp_pixels;
mod lamp_target;
mod lamp_walk;
mod order;
mod score;
mod spectral;
mod sun_line;
mod unfold;
mod unscattered;
mod ways;

pub use score::Scores;
pub use unscattered::{Beam, unscattered_beams};

use glam::DVec3;

use crate::{
    integrator::sampling::Draws,
    prepare::{Prepared, Primitive},
};
use camera_ray::{CameraRay, End, Segment};
use lamp_pixels::LampPixels;
use lamp_target::LampWorkspace;
use lamp_walk::FirstSegment;
use score::{Source, Way};

/// Events after which roulette sets in whatever the weight.
const SURE_EVENTS: usize = 1000;
/// Probability of survival per event from then on. Low enough to end a lossless path, high enough that the
/// weights it costs keep a finite variance for mean path lengths up to several hundred events.
const LATE_SURVIVAL: f64 = 0.998;
/// Optical depth (scattering) of the camera ray below which its scattered and unscattered parts are sampled
/// one each: in clear water nearly every free flight would reach the target.
const SPLIT_BELOW: f64 = 0.7;

/// Which paths a render needs.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Indices of the lamps to trace.
    pub lamps: Vec<usize>,
    /// Whether to trace daylight and emission.
    pub ambient: bool,
    /// Largest number of events on a path.
    pub max_events: usize,
}

/// Numbers of paths and path vertices made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Walks started at the camera.
    pub paths: u64,
    /// Vertices of walks and bridges.
    pub vertices: u64,
}

/// One worker: buffers that live as long as its thread.
pub struct Worker<'a> {
    scene: &'a Prepared,
    selection: &'a Selection,
    lamp_pixels: LampPixels,
    lamp_work: LampWorkspace,
    ambient_walks: Vec<ambient_path::Walk>,
    scores: Scores,
    /// Work done so far.
    pub work: Work,
}

impl<'a> Worker<'a> {
    /// A worker for `scene`.
    pub fn new(scene: &'a Prepared, selection: &'a Selection) -> Self {
        Self {
            scene,
            selection,
            lamp_pixels: LampPixels::new(scene, &selection.lamps),
            lamp_work: LampWorkspace::new(scene.medium.as_ref()),
            ambient_walks: Vec::new(),
            scores: Scores::new(scene.lamps.iter().map(|l| l.level).collect()),
            work: Work::default(),
        }
    }

    /// The radiance of one sample through pixel (`column`, `row`).
    pub fn sample(&mut self, seed: u64, column: u32, row: u32, batch: u32, index: u32) -> &Scores {
        let camera = &self.scene.camera;
        let pixel = row * camera.width + column;
        let draws = Draws::new(seed, pixel, batch, index, 0);
        let placed = self
            .lamp_pixels
            .place(column, row, draws.leading(0), draws.leading(1));
        let Some((x, y, factor)) = placed else {
            self.scores.clear();
            return &self.scores;
        };
        let (origin, direction) = (camera.position_m, camera.direction(x, y));
        self.radiance(seed, pixel, batch, index, origin, direction);
        if factor != 1.0 {
            self.scores.scale(factor);
        }
        &self.scores
    }

    /// The radiance of one sample that looks from `origin` along the unit vector `direction`. `stream` separates
    /// estimates (a pixel each, say); the first two leading numbers of stream, batch and index are free for the
    /// choice of the direction.
    pub fn radiance(
        &mut self,
        seed: u64,
        stream: u32,
        batch: u32,
        index: u32,
        origin: DVec3,
        direction: DVec3,
    ) -> &Scores {
        self.scores.clear();
        let ray = CameraRay::trace(self.scene, origin, direction);
        self.see_lamps(&ray);
        if !self.selection.lamps.is_empty() && self.selection.max_events > 0 {
            let mut draws = Draws::new(seed, stream, batch, index, 0);
            self.trace_lamps(&ray, &mut draws);
        }
        if self.selection.ambient {
            let mut draws = Draws::new(seed, stream, batch, index, 1);
            self.work.paths += 1;
            self.work.vertices += ambient_path::trace(
                self.scene,
                &ray,
                self.selection.max_events,
                &mut draws,
                &mut self.ambient_walks,
                &mut self.scores,
            );
        }
        &self.scores
    }

    fn trace_lamps(&mut self, ray: &CameraRay, draws: &mut Draws) {
        let split = match (&self.scene.medium, ray.in_water) {
            (Some(medium), Some(segment)) if medium.scatters() => {
                let sigma = medium.by_scattering.sigma[0];
                sigma * segment.length < SPLIT_BELOW
            }
            _ => false,
        };
        let kinds: &[FirstSegment] = if split {
            &[FirstSegment::Through, FirstSegment::Scattered]
        } else {
            &[FirstSegment::Free]
        };
        for &kind in kinds {
            self.work.paths += 1;
            let before = self.lamp_work.vertices;
            lamp_path::trace(
                self.scene,
                &self.selection.lamps,
                ray,
                kind,
                self.selection.max_events,
                draws,
                &mut self.lamp_work,
                &mut self.scores,
            );
            self.work.vertices += self.lamp_work.vertices - before;
        }
    }

    /// Disk lamps that the camera looks at, straight or in the underside of the water surface: their unscattered
    /// light is on no other path.
    fn see_lamps(&mut self, ray: &CameraRay) {
        let Some(segment) = ray.in_water else { return };
        self.see_lamps_along(segment, 0.0, ray.entry_factor);
        let (Some(boundary), End::Boundary(length)) = (&self.scene.boundary, ray.end()) else {
            return;
        };
        let reflectance = boundary.internal_reflectance(segment.direction.z);
        if reflectance == 0.0 {
            return;
        }
        let mut origin = segment.origin + length * segment.direction;
        origin.z = boundary.height;
        let direction = unfold::flip(segment.direction);
        let hit = self
            .scene
            .geometry
            .closest(origin, direction, f64::INFINITY, Primitive::None);
        let reflected = Segment {
            origin,
            direction,
            length: hit.map_or(f64::INFINITY, |h| h.t),
        };
        self.see_lamps_along(reflected, length, reflectance * ray.entry_factor);
    }

    /// Disk lamps on `segment`, which starts `range_m` into the water and whose light arrives with `factor`.
    fn see_lamps_along(&mut self, segment: Segment, range_m: f64, factor: f64) {
        for &i in &self.selection.lamps {
            let lamp = &self.scene.lamps[i];
            let Some((t, radiance)) =
                lamp.radiance_along(segment.origin, segment.direction, segment.length)
            else {
                continue;
            };
            let transmittance = self
                .scene
                .medium
                .as_ref()
                .map_or([1.0; 3], |m| m.transmittance(range_m + t));
            let light = std::array::from_fn(|k| factor * radiance[k] * transmittance[k]);
            self.scores.add(Source::Lamp(i), Way::Direct, light);
        }
    }
}
