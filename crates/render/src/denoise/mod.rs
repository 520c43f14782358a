//! A clean picture from few samples (docs/denoise.md): layers of a film are regressed on what is known of the first surfaces
//! without noise, and never on anything beyond an edge in depth or of an object. The result is biased; its error is estimated.
//!
//! [`guides`] is what is known ([`look`]: where a ray ends and the light that comes straight from there; [`regions`]: connected
//! surfaces), [`basis`] what a layer is made of, [`regression`] fits it cell by cell ([`solve`]), [`selection`] chooses among the
//! sizes of cells by what each half of the samples says of the other's fit, [`error`] estimates what is wrong. [`halves`] renders.

mod basis;
mod blur;
mod error;
mod guides;
mod halves;
mod look;
mod regions;
mod regression;
mod selection;
mod solve;
#[cfg(test)]
mod tests;

use std::time::Instant;

use serde::Serialize;
use uw_media::Spectrum;

use crate::film::{Film, FilmLayer};
use crate::prepare::Prepared;
use basis::Basis;
use guides::Guides;
pub use halves::{DenoiseError, render};
use regression::Problem;
use selection::Halves;

/// Edges of cells, pixels: each candidate's window is three of them wide.
const CELLS_PX: [usize; 6] = [4, 8, 16, 32, 64, 128];
/// Radius over which the level of the picture is averaged that errors are weighed by, twice, pixels.
const LEVEL_RADIUS_PX: usize = 6;
/// Share of the picture's squared mean that is added to that squared level.
const LEVEL_FLOOR: f64 = 1e-4;

/// Facts about a denoised picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DenoiseFacts {
    /// Estimated relative error of the denoised picture.
    pub relative_error: f64,
    /// The part of it that comes from bias.
    pub relative_bias: f64,
    /// Estimated relative error of the picture before; none of fewer than four samples.
    pub relative_error_before: Option<f64>,
    /// Time that it took, s.
    pub seconds: f64,
}

/// Denoised layers of a picture, W/(m² sr), row by row from the top.
#[derive(Clone, Debug)]
pub struct Denoised {
    layers: Vec<(FilmLayer, Vec<[f32; 3]>)>,
    /// Facts.
    pub facts: DenoiseFacts,
}

impl Denoised {
    /// The values of a layer, where it was denoised.
    pub(crate) fn layer(&self, layer: FilmLayer) -> Option<Vec<Spectrum>> {
        let found = self.layers.iter().find(|(own, _)| *own == layer);
        found.map(|(_, values)| values.iter().map(|v| v.map(f64::from)).collect())
    }
}

/// Denoises what `halves`, two films of `scene` with as many samples each and independent random numbers, show together, on
/// the rayon pool in which it is called. With `sources` the layers of daylight and of each lamp are denoised too.
pub fn denoise(scene: &Prepared, halves: [&Film; 2], sources: bool) -> Denoised {
    let start = Instant::now();
    let guides = Guides::of(scene);
    let blurred = basis::blurred_light(&guides);
    let sampled = |layer| halves.map(|film| single(film.sampled(layer)));
    let total = sampled(FilmLayer::Total);
    let weights = weights(&total, guides.width);
    let fit = |raw: &Halves, basis: &Basis| {
        let problem = Problem {
            guides: &guides,
            blurred: &blurred,
            basis,
            halves: [&raw[0], &raw[1]],
            weights: &weights,
        };
        let largest = guides.width.max(guides.height);
        let cells = CELLS_PX
            .into_iter()
            .filter(|cell| *cell <= CELLS_PX[0].max(largest / 4));
        let fitted = cells.map(|cell| problem.fit(cell));
        selection::select(problem.halves, fitted, &weights, guides.width)
    };
    let (direct, veil) = (sampled(FilmLayer::Direct), sampled(FilmLayer::Backscatter));
    let spread = sum_of([&total, &direct, &veil], [1.0, -1.0, -1.0]);
    let parts = [
        fit(&direct, &Basis::of_straight()),
        fit(&veil, &Basis::of_veil()),
        fit(&spread, &Basis::of_spread()),
    ];
    let whole = sum_of([&parts[0], &parts[1], &parts[2]], [1.0; 3]);
    let error = error::estimate(&whole, &total, guides.width);
    let mut layers = vec![
        (FilmLayer::Total, mean_of(&whole)),
        (FilmLayer::Direct, mean_of(&parts[0])),
        (FilmLayer::Backscatter, mean_of(&parts[1])),
        (FilmLayer::Variance, error.map),
    ];
    if sources {
        let lamps = (0..scene.lamps.len()).map(FilmLayer::Lamp);
        for layer in std::iter::once(FilmLayer::Ambient).chain(lamps) {
            let fitted = fit(&sampled(layer), &Basis::of_source());
            layers.push((layer, mean_of(&fitted)));
        }
    }
    let facts = DenoiseFacts {
        relative_error: (error.variance + error.bias).sqrt(),
        relative_bias: error.bias.sqrt(),
        relative_error_before: None,
        seconds: start.elapsed().as_secs_f64(),
    };
    Denoised { layers, facts }
}

/// One over the squared level around every pixel, per channel.
fn weights(total: &Halves, width: usize) -> Vec<[f32; 3]> {
    let mut weights = vec![[0.0; 3]; total[0].len()];
    for k in 0..3 {
        let halves = total[0].iter().zip(&total[1]);
        let plane: Vec<f32> = halves.map(|(a, b)| 0.5 * (a[k] + b[k])).collect();
        let sum: f64 = plane.iter().map(|&value| f64::from(value)).sum();
        let mean = sum / plane.len().max(1) as f64;
        let level = (0..2).fold(plane, |plane, _| {
            blur::boxed(&plane, width, LEVEL_RADIUS_PX)
        });
        for (weight, level) in weights.iter_mut().zip(level) {
            let square = f64::from(level).powi(2) + LEVEL_FLOOR * mean * mean;
            // Weights of any unit of light stay in the range of single precision.
            weight[k] = if square > 0.0 {
                (mean * mean / square) as f32
            } else {
                0.0
            };
        }
    }
    weights
}

fn single(values: Vec<Spectrum>) -> Vec<[f32; 3]> {
    values.into_iter().map(|v| v.map(|c| c as f32)).collect()
}

fn sum_of(parts: [&Halves; 3], factors: [f32; 3]) -> Halves {
    [0, 1].map(|half| {
        let value = |i: usize| {
            std::array::from_fn(|k| {
                parts
                    .iter()
                    .zip(factors)
                    .map(|(part, f)| f * part[half][i][k])
                    .sum()
            })
        };
        (0..parts[0][half].len()).map(value).collect()
    })
}

/// The mean of both halves; no light is less than none.
fn mean_of(halves: &Halves) -> Vec<[f32; 3]> {
    let pairs = halves[0].iter().zip(&halves[1]);
    let mean =
        |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|k| (0.5 * (a[k] + b[k])).max(0.0));
    pairs.map(mean).collect()
}
