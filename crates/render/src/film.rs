//! Stage 4: sums of radiance and of its square per pixel.

mod coarse;
mod error;
mod finite;
mod joined;

pub(crate) use error::FEWEST_SAMPLES;
pub use finite::NotFinite;
use std::sync::Arc;
use uw_media::Spectrum;

use rayon::prelude::*;

use coarse::Coarse;

use crate::denoise::Denoised;
use crate::snow::SnowLayers;

/// Radiance of one source or one way, or the variance of the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmLayer {
    /// All sources at their levels.
    Total,
    /// Sun, sky and emission.
    Ambient,
    /// A lamp, by index, at 100 %.
    Lamp(usize),
    /// Unscattered light.
    Direct,
    /// Light that met no surface.
    Backscatter,
    /// Variance of the pixel mean of the total.
    Variance,
}

/// One row of pixels. Each pixel holds, per channel: the total, the total's squares, ambient, each lamp,
/// direct and backscatter.
#[derive(Clone, Debug)]
pub struct Row {
    /// None before the first batch, so that a film that is never filled takes no memory.
    sums: Vec<Spectrum>,
    /// Number of pixels.
    width: usize,
    /// Sums and squares of the total over all pixels, from which the variance of means follows even where pixels share
    /// walks; none in a film that a graphics adapter has filled.
    lines: Option<[Spectrum; 2]>,
    /// The part of the batch that is being added.
    line: Spectrum,
    /// Number of batches added.
    pub batches: u32,
    /// Number of samples per pixel added.
    pub samples: u64,
}

/// The film: rows that can be filled independently.
#[derive(Clone, Debug)]
pub struct Film {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Rows from the top.
    pub rows: Vec<Row>,
    lamps: usize,
    /// What rows without samples show.
    coarse: Option<Box<Coarse>>,
    /// What marine snow changes.
    snow: Option<Arc<SnowLayers>>,
    /// What is shown in the place of the samples' means.
    denoised: Option<Arc<Denoised>>,
}

/// Fixed entries of a pixel before the lamps: total, squares, ambient, direct, backscatter.
const FIXED: usize = 5;

impl Film {
    /// An empty film for `lamps` lamps.
    pub fn new(width: u32, height: u32, lamps: usize) -> Self {
        let row = Row {
            sums: Vec::new(),
            width: width as usize,
            lines: Some([[0.0; 3]; 2]),
            line: [0.0; 3],
            batches: 0,
            samples: 0,
        };
        Self {
            width,
            height,
            rows: vec![row; height as usize],
            lamps,
            coarse: None,
            snow: None,
            denoised: None,
        }
    }

    /// The film of `batches` batches from what a graphics adapter holds, plane after plane of the picture's size: the
    /// mean of the total, the sum of its squared deviations weighted by samples, the means of ambient, direct,
    /// backscatter and of each lamp.
    pub(crate) fn of_planes(mut self, samples: u64, batches: u32, planes: &[[f32; 3]]) -> Self {
        let stride = FIXED + self.lamps;
        let (width, n) = (self.width as usize, samples as f64);
        let pixels = width * self.rows.len();
        for (y, row) in self.rows.iter_mut().enumerate() {
            row.make_room(self.lamps);
            for (x, sums) in row.sums.chunks_exact_mut(stride).enumerate() {
                let value = |plane: usize| planes[plane * pixels + y * width + x].map(f64::from);
                for (plane, sum) in sums.iter_mut().enumerate() {
                    *sum = value(plane).map(|mean| n * mean);
                }
                let (mean, deviations) = (value(0), value(1));
                sums[1] = std::array::from_fn(|k| deviations[k] + n * mean[k] * mean[k]);
            }
            row.lines = None;
            row.samples = samples;
            row.batches = batches;
        }
        self
    }

    /// Shows marine snow of a picture of the same size in the total, in each lamp's layer and in the backscatter from now
    /// on, or none; samples and their variance stay what they are.
    pub fn show_snow(&mut self, snow: Option<Arc<SnowLayers>>) {
        self.snow = snow;
    }

    /// Number of lamps.
    pub fn lamps(&self) -> usize {
        self.lamps
    }

    /// Shows denoised layers of a picture of the same size in the place of the samples' means from now on, or none; samples
    /// and their variance stay what they are.
    pub fn show_denoised(&mut self, denoised: Option<Arc<Denoised>>) {
        self.denoised = denoised;
    }

    /// What denoising came to, where its layers are shown.
    pub fn denoised(&self) -> Option<&Denoised> {
        self.denoised.as_deref()
    }

    /// Mean radiance (or its variance) of every pixel, row by row from the top. Rows without samples are black, or show
    /// the coarse picture that stands in for them. Of a denoised picture the variance is its estimated squared error.
    pub fn layer(&self, layer: FilmLayer) -> Vec<Spectrum> {
        let denoised = self.denoised.as_ref().and_then(|own| own.layer(layer));
        let mut out = denoised.unwrap_or_else(|| self.sampled(layer));
        if let Some(snow) = &self.snow {
            snow.add_to(layer, &mut out);
        }
        out
    }

    /// The same of the samples alone, without snow and as noisy as they are.
    pub(crate) fn sampled(&self, layer: FilmLayer) -> Vec<Spectrum> {
        let width = self.width as usize;
        let mut out = vec![[0.0; 3]; width * self.rows.len()];
        let rows = out.par_chunks_mut(width.max(1)).zip(&self.rows).enumerate();
        rows.for_each(|(y, (values, row))| match &self.coarse {
            Some(coarse) if row.batches == 0 => coarse.show(y, layer, values),
            _ => row.show(self.lamps, layer, values),
        });
        out
    }

    /// Mean of the total over the picture, per channel.
    pub fn mean(&self) -> Spectrum {
        let total = self.layer(FilmLayer::Total);
        let n = total.len() as f64;
        std::array::from_fn(|k| total.iter().map(|p| p[k]).sum::<f64>() / n)
    }

    /// Variance of [`Film::mean`], per channel; NaN before every row has two batches. A film of the
    /// processor takes it from whole rows.
    pub fn variance_of_mean(&self) -> Spectrum {
        let pixels = f64::from(self.width) * f64::from(self.height);
        let mut sum = [0.0; 3];
        for row in &self.rows {
            let line = row.variance_of_line(self.lamps);
            (0..3).for_each(|k| sum[k] += line[k]);
        }
        sum.map(|s| s / (pixels * pixels))
    }

    /// Fewest samples per pixel over the rows.
    pub fn samples(&self) -> u64 {
        self.rows.iter().map(|r| r.samples).min().unwrap_or(0)
    }
}

impl Row {
    fn make_room(&mut self, lamps: usize) {
        if self.sums.is_empty() {
            self.sums = vec![[0.0; 3]; self.width * (FIXED + lamps)];
        }
    }

    /// Writes the values of a layer, pixel by pixel.
    fn show(&self, lamps: usize, layer: FilmLayer, values: &mut [Spectrum]) {
        for (value, pixel) in values.iter_mut().zip(self.sums.chunks_exact(FIXED + lamps)) {
            *value = self.value(pixel, layer);
        }
    }

    /// Adds the mean of a batch of `samples` samples at `column`; call [`Row::finish_batch`] after the last one.
    pub fn add(&mut self, column: usize, lamps: usize, batch: &BatchMean, samples: u32) {
        self.make_room(lamps);
        let stride = FIXED + lamps;
        let n = f64::from(samples);
        let pixel = &mut self.sums[column * stride..(column + 1) * stride];
        for k in 0..3 {
            self.line[k] += batch.total[k];
            pixel[0][k] += n * batch.total[k];
            pixel[1][k] += n * batch.total[k] * batch.total[k];
            pixel[2][k] += n * batch.ambient[k];
            pixel[3][k] += n * batch.direct[k];
            pixel[4][k] += n * batch.backscatter[k];
            for (i, lamp) in batch.lamps.iter().enumerate() {
                pixel[FIXED + i][k] += n * lamp[k];
            }
        }
    }

    /// Counts a batch that has been added to every pixel of the row.
    pub fn finish_batch(&mut self, samples: u32) {
        let line = std::mem::take(&mut self.line);
        if let Some([sums, squares]) = &mut self.lines {
            let n = f64::from(samples);
            for k in 0..3 {
                sums[k] += n * line[k];
                squares[k] += n * line[k] * line[k];
            }
        }
        self.batches += 1;
        self.samples += u64::from(samples);
    }

    fn value(&self, pixel: &[Spectrum], layer: FilmLayer) -> Spectrum {
        let n = (self.samples as f64).max(1.0);
        let mean = |i: usize| pixel[i].map(|s| s / n);
        match layer {
            FilmLayer::Total => mean(0),
            FilmLayer::Ambient => mean(2),
            FilmLayer::Direct => mean(3),
            FilmLayer::Backscatter => mean(4),
            FilmLayer::Lamp(i) => mean(FIXED + i),
            FilmLayer::Variance => self.variance(pixel[0], pixel[1]),
        }
    }

    /// Variance of the mean over the batches of what has these weighted sums and squares.
    fn variance(&self, sums: Spectrum, squares: Spectrum) -> Spectrum {
        let n = (self.samples as f64).max(1.0);
        let others = f64::from(self.batches) - 1.0;
        std::array::from_fn(|k| {
            let mean = sums[k] / n;
            if others > 0.0 {
                (squares[k] / n - mean * mean).max(0.0) / others
            } else {
                f64::NAN
            }
        })
    }

    /// Variance of the sum of all pixels.
    fn variance_of_line(&self, lamps: usize) -> Spectrum {
        if let Some([sums, squares]) = self.lines {
            return self.variance(sums, squares);
        }
        let mut sum = [0.0; 3];
        for pixel in self.sums.chunks_exact(FIXED + lamps) {
            let variance = self.variance(pixel[0], pixel[1]);
            (0..3).for_each(|k| sum[k] += variance[k]);
        }
        sum
    }
}

/// Mean of one batch of samples of a pixel.
#[derive(Clone, Debug, Default)]
pub struct BatchMean {
    total: Spectrum,
    ambient: Spectrum,
    direct: Spectrum,
    backscatter: Spectrum,
    lamps: Vec<Spectrum>,
}

impl BatchMean {
    /// From the sums over `samples` samples of three channels of each layer, W/(m² sr), in the order of
    /// [`BatchMean::of_layers`].
    pub fn of_sums<T: Copy + Into<f64>>(sums: &[T], samples: u32, levels: &[f64]) -> Self {
        let mean = |sum: T| sum.into() / f64::from(samples);
        let layers: Vec<Spectrum> = sums
            .chunks_exact(3)
            .map(|c| [mean(c[0]), mean(c[1]), mean(c[2])])
            .collect();
        Self::of_layers(&layers, levels)
    }

    /// From the means of layers, W/(m² sr): ambient, direct, backscatter, then each lamp at 100 %, of `levels`
    /// (fractions).
    fn of_layers(layers: &[Spectrum], levels: &[f64]) -> Self {
        let lamps = layers[3..].to_vec();
        let total = std::array::from_fn(|k| {
            let lit = lamps
                .iter()
                .zip(levels)
                .map(|(lamp, level)| level * lamp[k]);
            layers[0][k] + lit.sum::<f64>()
        });
        Self {
            total,
            ambient: layers[0],
            direct: layers[1],
            backscatter: layers[2],
            lamps,
        }
    }
}
