//! The native path tracer.

pub(crate) mod ambient_flight;
pub(crate) mod ambient_path;
mod ambient_shared;
mod ambient_surface;
pub(crate) mod ambient_window;
pub(crate) mod bridge;
pub(crate) mod camera_ray;
mod direct_lamps;
pub(crate) mod equiangular;
mod lamp_join;
pub(crate) mod lamp_landing;
mod lamp_path;
mod lamp_pixels;
pub(crate) mod lamp_target;
pub(crate) mod lamp_walk;
pub(crate) mod order;
mod row;
mod score;
pub(crate) mod spectral;
pub(crate) mod sun_line;
pub(crate) mod unfold;
mod unscattered;
pub(crate) mod ways;

pub use row::RowBatch;
pub use score::Scores;
pub use unscattered::{Beam, unscattered_beams};

use glam::DVec3;

use crate::{film::BatchMean, integrator::sampling::Draws, prepare::Prepared};
use camera_ray::CameraRay;
use lamp_pixels::LampPixels;
use lamp_target::LampWorkspace;
use lamp_walk::FirstSegment;

/// Events after which roulette sets in whatever the weight.
const SURE_EVENTS: usize = 1000;
/// Probability of survival per event from then on. Low enough to end a lossless path, high enough that the
/// weights it costs keep a finite variance for mean path lengths up to several hundred events.
const LATE_SURVIVAL: f64 = 0.998;
/// Optical depth (scattering) of the camera ray below which its scattered and unscattered parts are sampled
/// one each: in clear water nearly every free flight would reach the target.
const SPLIT_BELOW: f64 = 0.7;
/// Image points per sample at which the lamps' unscattered light is seen in clear water.
const DIRECT_POINTS: u32 = 4;

/// Which paths a render needs.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Indices of the lamps to trace.
    pub lamps: Vec<usize>,
    /// Whether to trace daylight and emission.
    pub ambient: bool,
    /// Largest number of events on a path.
    pub max_events: usize,
    /// Most neighbouring pixels of a row that share their daylight walks, where the scene lets them; 1 for none.
    pub share_walks: u32,
}

impl Selection {
    /// Whether pixels of `scene` share walks.
    pub(crate) fn shares(&self, scene: &Prepared) -> bool {
        self.share_walks > 1 && self.ambient && ambient_shared::can_share(scene)
    }
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
    /// The pixel at work and whether the water before it is clear.
    clear_pixel: ((u32, u32), bool),
    lamp_work: LampWorkspace,
    ambient_walks: Vec<ambient_path::Walk>,
    shared_walks: ambient_shared::SharedWalks,
    means: Vec<BatchMean>,
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
            clear_pixel: ((u32::MAX, u32::MAX), false),
            lamp_work: LampWorkspace::new(scene.medium.as_ref()),
            ambient_walks: Vec::new(),
            shared_walks: ambient_shared::SharedWalks::default(),
            means: Vec::new(),
            scores: Scores::new(scene.lamps.iter().map(|l| l.level).collect()),
            work: Work::default(),
        }
    }

    /// The radiance of one sample through pixel (`column`, `row`).
    pub fn sample(&mut self, seed: u64, column: u32, row: u32, batch: u32, index: u32) -> &Scores {
        self.sample_parts(seed, (column, row), batch, index, self.selection.ambient);
        &self.scores
    }

    /// The light of the lamps alone, left in `self.scores`.
    fn sample_without_daylight(
        &mut self,
        seed: u64,
        column: u32,
        row: u32,
        batch: u32,
        index: u32,
    ) {
        self.sample_parts(seed, (column, row), batch, index, false);
    }

    fn sample_parts(
        &mut self,
        seed: u64,
        (column, row): (u32, u32),
        batch: u32,
        index: u32,
        ambient: bool,
    ) {
        self.scores.clear();
        let pixel = row * self.scene.camera.width + column;
        let draws = Draws::new(seed, pixel, batch, index, 0);
        let (u, v) = (draws.leading(0), draws.leading(1));
        let clear = self.is_clear_pixel(column, row);
        if let Some((x, y, factor)) = self.lamp_pixels.place(column, row, u, v) {
            let ray = self.camera_ray(x, y);
            let mut draws = draws;
            self.trace_walks(&ray, ambient, &mut draws);
            if !clear {
                self.add_direct_lamps(&ray, 1.0, &mut draws);
            }
            if factor != 1.0 {
                self.scores.scale(factor);
            }
        }
        if clear && self.wants_lamps() {
            let all = Draws::new(seed, pixel, batch, 0, 2);
            for i in 0..DIRECT_POINTS {
                let mut draws = all.at(index * DIRECT_POINTS + i);
                let (u, v) = (draws.leading(0), draws.leading(1));
                if let Some((x, y, factor)) = self.lamp_pixels.place(column, row, u, v) {
                    let ray = self.camera_ray(x, y);
                    let share = factor / f64::from(DIRECT_POINTS);
                    self.add_direct_lamps(&ray, share, &mut draws);
                }
            }
        }
    }

    /// Whether unscattered light has image points of its own: decided by the centre of the pixel, because a choice
    /// that hung on the sample's own ray would count light twice, or not at all, where rays of one pixel differ.
    fn is_clear_pixel(&mut self, column: u32, row: u32) -> bool {
        let (pixel, clear) = self.clear_pixel;
        if pixel == (column, row) {
            return clear;
        }
        let ray = self.camera_ray(f64::from(column) + 0.5, f64::from(row) + 0.5);
        let clear = self.is_clear(&ray);
        self.clear_pixel = ((column, row), clear);
        clear
    }

    fn camera_ray(&self, x: f64, y: f64) -> CameraRay {
        let camera = &self.scene.camera;
        CameraRay::trace(self.scene, camera.position_m, camera.direction(x, y))
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
        let mut draws = Draws::new(seed, stream, batch, index, 0);
        self.trace_walks(&ray, self.selection.ambient, &mut draws);
        self.add_direct_lamps(&ray, 1.0, &mut draws);
        &self.scores
    }

    fn wants_lamps(&self) -> bool {
        !self.selection.lamps.is_empty()
    }

    /// Lamp light along `ray` that does not scatter in the water, times `share`.
    fn add_direct_lamps(&mut self, ray: &CameraRay, share: f64, draws: &mut Draws) {
        if !self.wants_lamps() {
            return;
        }
        direct_lamps::add_direct(
            self.scene,
            &self.selection.lamps,
            ray,
            self.selection.max_events,
            share,
            draws,
            &mut self.lamp_work,
            &mut self.scores,
        );
    }

    /// Everything along `ray` but the lamp light that scatters nowhere, and without daylight unless `ambient`.
    fn trace_walks(&mut self, ray: &CameraRay, ambient: bool, draws: &mut Draws) {
        if self.wants_lamps() && self.selection.max_events > 0 {
            self.trace_lamps(ray, draws);
        }
        if ambient {
            let mut draws = draws.of_stream(1);
            self.work.paths += 1;
            self.work.vertices += ambient_path::trace(
                self.scene,
                ray,
                self.selection.max_events,
                &mut draws,
                &mut self.ambient_walks,
                &mut self.scores,
            );
        }
    }

    /// Whether the water before the end of `ray` is so clear that its scattered and unscattered light are sampled
    /// apart.
    fn is_clear(&self, ray: &CameraRay) -> bool {
        match (&self.scene.medium, ray.in_water) {
            (Some(medium), Some(segment)) if medium.scatters() => {
                medium.b_mean() * segment.length < SPLIT_BELOW
            }
            _ => true,
        }
    }

    fn trace_lamps(&mut self, ray: &CameraRay, draws: &mut Draws) {
        let kinds: &[FirstSegment] = if !self.scene.needs.scattering {
            &[FirstSegment::Through]
        } else if self.is_clear(ray) {
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
}
