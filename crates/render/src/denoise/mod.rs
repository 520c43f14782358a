//! A clean picture from few samples (docs/denoise.md): layers of a film are regressed on what is known of the first surfaces
//! without noise, and never on anything beyond an edge in depth or of an object. The result is biased; its error is estimated.
//!
//! [`guides`] is what is known ([`look`]: where a ray ends and the light that comes straight from there; [`patch`]: where all rays
//! through a pixel end, from those through its corners; [`regions`]: connected surfaces), [`basis`] what a layer is made of,
//! [`regression`] fits it cell by cell ([`weights`] of pixels; [`cells`]: sums; [`solve`]: coefficients; [`values`]: what they say of
//! pixels), [`selection`] chooses among the sizes of cells by what each half of the samples says of the other's fit, [`error`]
//! estimates what is wrong.
//! [`halves`] renders.

mod basis;
mod blur;
mod cells;
mod error;
mod gather;
mod guides;
mod halves;
mod lanes;
mod look;
mod patch;
mod regions;
mod regression;
mod samples;
mod selection;
mod solve;
#[cfg(test)]
mod tests;
mod values;
mod weights;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use cpu_time::ProcessTime;
use serde::Serialize;
use uw_media::Spectrum;

use crate::film::{Film, FilmLayer};
use crate::prepare::Prepared;
use basis::Basis;
use guides::Guides;
pub use halves::{DenoiseError, other_half, render};
use regression::Problem;
pub use samples::Half;
use selection::{Chosen, Halves};
use weights::Weights;

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
    /// The same of the processor, s.
    pub cpu_s: f64,
}

impl DenoiseFacts {
    /// What a file says of a denoised picture, name by name.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let method = "regression on first surfaces, two halves of the samples; biased";
        let facts = [
            ("uw.denoised", method.to_owned()),
            (
                "uw.denoised_relative_error",
                self.relative_error.to_string(),
            ),
            ("uw.denoised_relative_bias", self.relative_bias.to_string()),
        ];
        facts.map(|(name, value)| (name.to_owned(), value)).into()
    }
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

/// The film of both `halves`, two films of `scene` with as many samples each and independent random numbers, with denoised
/// layers, made on the rayon pool in which it is called. With `sources` those of daylight and of each lamp are denoised too.
/// None where `cancel` was set before it was done.
pub fn denoise(
    scene: &Prepared,
    halves: [Half<'_>; 2],
    sources: bool,
    cancel: &AtomicBool,
) -> Option<Film> {
    let denoised = layers(scene, &halves, sources, cancel)?;
    let mut film = halves[0].film.clone();
    film.join(halves[1].film);
    let relative_error_before = film.relative_error();
    film.show_denoised(Some(Arc::new(Denoised {
        facts: DenoiseFacts {
            relative_error_before,
            ..denoised.facts
        },
        ..denoised
    })));
    Some(film)
}

fn layers(
    scene: &Prepared,
    halves: &[Half<'_>; 2],
    sources: bool,
    cancel: &AtomicBool,
) -> Option<Denoised> {
    let (start, cpu_start) = (Instant::now(), ProcessTime::now());
    let guides = Guides::of(scene, halves, cancel)?;
    let blurred = basis::blurred_light(&guides);
    let sampled = |layer| halves.map(|half| single(half.film.sampled(layer)));
    let total = sampled(FilmLayer::Total);
    let weights = Weights::of(&total, guides.width);
    let fit = |raw: &Halves, basis: &Basis| {
        if raw.iter().flatten().all(|value| *value == [0.0; 3]) {
            return Some(Chosen {
                shown: raw.clone(),
                residuals: raw.clone(),
            });
        }
        let problem = Problem {
            guides: &guides,
            blurred: &blurred,
            basis,
            halves: [&raw[0], &raw[1]],
            weights: [&weights.halves[0], &weights.halves[1]],
            cancel,
        };
        let fitted = problem.fit()?;
        let chosen = selection::select(problem.halves, fitted, &weights.both, guides.width);
        (!cancel.load(Ordering::Relaxed)).then_some(chosen)
    };
    let (direct, veil) = (sampled(FilmLayer::Direct), sampled(FilmLayer::Backscatter));
    let spread = sum_of([&total, &direct, &veil], [1.0, -1.0, -1.0]);
    let parts = [
        fit(&direct, &Basis::of_straight(scene.lamps.len()))?,
        fit(&veil, &Basis::of_veil())?,
        fit(&spread, &Basis::of_spread())?,
    ];
    let whole = together(&parts);
    let error = error::estimate(&whole, guides.width);
    let mut layers = vec![
        (FilmLayer::Total, mean_of(&whole.shown)),
        (FilmLayer::Direct, mean_of(&parts[0].shown)),
        (FilmLayer::Backscatter, mean_of(&parts[1].shown)),
        (FilmLayer::Variance, error.map),
    ];
    if sources {
        let ambient = fit(&sampled(FilmLayer::Ambient), &Basis::of_source(0))?;
        layers.push((FilmLayer::Ambient, mean_of(&ambient.shown)));
        for layer in (0..scene.lamps.len()).map(FilmLayer::Lamp) {
            let fitted = fit(&sampled(layer), &Basis::of_source(scene.lamps.len()))?;
            layers.push((layer, mean_of(&fitted.shown)));
        }
    }
    let facts = DenoiseFacts {
        relative_error: (error.variance + error.bias).sqrt(),
        relative_bias: error.bias.sqrt(),
        relative_error_before: None,
        seconds: start.elapsed().as_secs_f64(),
        cpu_s: cpu_start.elapsed().as_secs_f64(),
    };
    Some(Denoised { layers, facts })
}

fn single(values: Vec<Spectrum>) -> Vec<[f32; 3]> {
    values.into_iter().map(|v| v.map(|c| c as f32)).collect()
}

/// The sum of layers.
fn together(parts: &[Chosen; 3]) -> Chosen {
    let sum = |of: fn(&Chosen) -> &Halves| sum_of([0, 1, 2].map(|i| of(&parts[i])), [1.0; 3]);
    Chosen {
        shown: sum(|part| &part.shown),
        residuals: sum(|part| &part.residuals),
    }
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
