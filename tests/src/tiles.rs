//! Pictures as tiles of 20 × 20 pixels with standard errors, and z-scores between them.

use uw_render::film::{Film, FilmLayer};

/// Edge of a tile, pixels.
pub const TILE: usize = 20;

/// Means of tiles and their standard errors, row by row, per channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiles {
    /// Mean radiance.
    pub mean: Vec<[f64; 3]>,
    /// Standard error of the mean; 0 where a reference has none.
    pub standard_error: Vec<[f64; 3]>,
}

impl Tiles {
    /// Tiles of the total of a film, whose variances come from its batches.
    pub fn of(film: &Film) -> Self {
        let total = film.layer(FilmLayer::Total);
        let variance = film.layer(FilmLayer::Variance);
        let columns = film.width as usize / TILE;
        let rows = film.height as usize / TILE;
        let n = (TILE * TILE) as f64;
        let mut tiles = Self {
            mean: Vec::new(),
            standard_error: Vec::new(),
        };
        for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
            let (mut sum, mut square) = ([0.0; 3], [0.0; 3]);
            for (y, x) in (0..TILE).flat_map(|y| (0..TILE).map(move |x| (y, x))) {
                let i = (row * TILE + y) * film.width as usize + column * TILE + x;
                for k in 0..3 {
                    sum[k] += total[i][k];
                    square[k] += variance[i][k];
                }
            }
            tiles.mean.push(sum.map(|s| s / n));
            tiles.standard_error.push(square.map(|s| s.sqrt() / n));
        }
        tiles
    }

    /// The same tiles, with standard errors that include a relative error of each tile.
    pub fn with_error(mut self, relative: f64) -> Self {
        for (error, mean) in self.standard_error.iter_mut().zip(&self.mean) {
            for k in 0..3 {
                error[k] = error[k].hypot(relative * mean[k]);
            }
        }
        self
    }

    /// Mean over all tiles, per channel, with its standard error.
    pub fn picture_mean(&self) -> ([f64; 3], [f64; 3]) {
        let n = self.mean.len() as f64;
        let mean = std::array::from_fn(|k| self.mean.iter().map(|m| m[k]).sum::<f64>() / n);
        let error = std::array::from_fn(|k| {
            self.standard_error
                .iter()
                .map(|e| e[k] * e[k])
                .sum::<f64>()
                .sqrt()
                / n
        });
        (mean, error)
    }

    /// z-scores of the differences to `other`, all tiles of one channel.
    pub fn z_scores(&self, other: &Self, channel: usize) -> Vec<f64> {
        (0..self.mean.len())
            .map(|i| {
                let difference = self.mean[i][channel] - other.mean[i][channel];
                let error = self.standard_error[i][channel].hypot(other.standard_error[i][channel]);
                difference / error
            })
            .collect()
    }
}

/// Root mean square and largest magnitude.
pub fn spread(z: &[f64]) -> (f64, f64) {
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    (rms, z.iter().fold(0.0, |m, z| z.abs().max(m)))
}
