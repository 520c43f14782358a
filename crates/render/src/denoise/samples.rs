//! Where in their pixels the samples of a film looked: what they saw of textures and edges is no noise.

use glam::DVec2;

use super::look::Look;
use crate::film::Film;
use crate::prepare::Prepared;
use crate::sampling::Draws;
use crate::scene::{OPENING_NUMBERS, on_opening};

/// Most image points of a pixel that are followed; more of them fill the pixel as evenly as one can look.
const MOST_POINTS: u32 = 64;
/// Streams of the numbers of walks and of unscattered lamp light in clear water, and points per sample of the latter, as in
/// `shaders/kernels/lamps`.
const WALK_STREAM: u32 = 0;
const LIT_STREAM: u32 = 2;
const LIT_POINTS: u32 = 4;
/// Optical depth (scattering) below which unscattered lamp light has points of its own, as in `shaders/common/camera`.
const SPLIT_BELOW: f64 = 0.7;

/// A film of a scene and what its random numbers were keyed by.
#[derive(Clone, Copy, Debug)]
pub struct Half<'a> {
    /// The film.
    pub film: &'a Film,
    /// Seed of its random numbers.
    pub seed: u64,
    /// Samples per pixel of each batch, from the first; a row has as many of them as it has batches.
    pub batches: &'a [u32],
}

/// Where a ray through a pixel looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// The image point, from the pixel's upper left corner.
    pub(super) offset: (f64, f64),
    /// The point of the lens's opening, in its radii.
    pub(super) on_opening: DVec2,
}

impl Aim {
    /// From numbers in (0, 1) by their dimension, as samples have it, where the lens `has_opening` or not.
    pub(super) fn of(has_opening: bool, number: impl Fn(usize) -> f64) -> Self {
        let of_opening = || {
            let [u, v] = OPENING_NUMBERS.map(&number);
            on_opening(u, v)
        };
        Self {
            offset: (number(0), number(1)),
            on_opening: has_opening.then(of_opening).unwrap_or_default(),
        }
    }
}

/// Which image points of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Points {
    /// Those of its walks and of daylight.
    Walks,
    /// Those of lamp light that scatters nowhere, where that has points of its own.
    Lit,
}

impl Points {
    /// Those of straight light where there are `lamps`.
    pub(super) fn of_lamps(lamps: usize) -> Self {
        match lamps {
            0 => Self::Walks,
            _ => Self::Lit,
        }
    }
}

impl Half<'_> {
    /// Where the samples of pixel (`x`, `y`) looked; none where there are too many.
    pub(super) fn points(
        &self,
        (x, y): (usize, usize),
        has_opening: bool,
        points: Points,
    ) -> Vec<Aim> {
        let (stream, each) = match points {
            Points::Walks => (WALK_STREAM, 1),
            Points::Lit => (LIT_STREAM, LIT_POINTS),
        };
        let batches = self.film.rows[y].batches as usize;
        let Some(batches) = self.batches.get(..batches) else {
            return Vec::new();
        };
        if batches.iter().sum::<u32>() * each > MOST_POINTS {
            return Vec::new();
        }
        let pixel = y as u32 * self.film.width + x as u32;
        let of_batch = |(batch, samples): (usize, &u32)| {
            let draws = Draws::new(self.seed, pixel, batch as u32, 0, stream);
            (0..samples * each).map(move |index| {
                let own = draws.at(index);
                Aim::of(has_opening, |dimension| own.leading(dimension))
            })
        };
        batches.iter().enumerate().flat_map(of_batch).collect()
    }
}

/// Whether unscattered lamp light has points of its own in the pixel at whose centre `centre` is; unknown in water that varies.
pub(super) fn is_clear(scene: &Prepared, centre: &Look) -> Option<bool> {
    let (Some(medium), Some(wet_m)) = (&scene.medium, centre.wet_m) else {
        return Some(true);
    };
    if !medium.scatters() {
        return Some(true);
    }
    let mean = medium.b.iter().sum::<f64>() / 3.0;
    scene.layers.is_none().then_some(mean * wet_m < SPLIT_BELOW)
}
