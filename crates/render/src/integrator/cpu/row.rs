//! Rows of pixels: the samples of a batch, added to a row of the film.

use super::{Worker, ambient_shared::View};
use crate::{
    film::{BatchMean, Row},
    integrator::sampling::Draws,
};

/// Which samples of which row.
#[derive(Clone, Copy, Debug)]
pub struct RowBatch {
    /// Seed of the render.
    pub seed: u64,
    /// Index of the row, from the top.
    pub row: u32,
    /// Number of the batch.
    pub batch: u32,
    /// Samples per pixel, at least 1.
    pub samples: u32,
}

impl Worker<'_> {
    /// Adds a batch of samples to `row`. `stop` is asked before every pixel, or, where pixels share walks, before every
    /// sample of the row; where it says so the row stays as it was. Returns whether the batch was added.
    pub fn add_row(&mut self, at: RowBatch, row: &mut Row, stop: &dyn Fn() -> bool) -> bool {
        let lamps = self.scene.lamps.len();
        let mut means = std::mem::take(&mut self.means);
        means.resize_with(self.scene.camera.width as usize, || BatchMean::new(lamps));
        means.iter_mut().for_each(BatchMean::clear);
        let complete = if self.shares() {
            self.add_together(at, &mut means, stop)
        } else {
            self.add_apart(at, &mut means, stop)
        };
        if complete {
            for (column, mean) in means.iter().enumerate() {
                row.add(column, lamps, mean, at.samples);
            }
            row.finish_batch(at.samples);
        }
        self.means = means;
        complete
    }

    /// Whether the pixels of a row share walks.
    fn shares(&self) -> bool {
        self.selection.shares(self.scene)
    }

    /// Pixel by pixel.
    fn add_apart(
        &mut self,
        at: RowBatch,
        means: &mut [BatchMean],
        stop: &dyn Fn() -> bool,
    ) -> bool {
        let weight = 1.0 / f64::from(at.samples);
        for (column, mean) in (0..).zip(means) {
            if stop() {
                return false;
            }
            for sample in 0..at.samples {
                mean.add(
                    self.sample(at.seed, column, at.row, at.batch, sample),
                    weight,
                );
            }
        }
        true
    }

    /// Sample by sample of the whole row, with daylight walks that serve several pixels.
    fn add_together(
        &mut self,
        at: RowBatch,
        means: &mut [BatchMean],
        stop: &dyn Fn() -> bool,
    ) -> bool {
        let weight = 1.0 / f64::from(at.samples);
        let mut scores = vec![self.scores.clone(); means.len()];
        for sample in 0..at.samples {
            if stop() {
                return false;
            }
            scores.iter_mut().for_each(super::Scores::clear);
            let mut views = self.views(at, sample);
            self.work.paths += views.len() as u64;
            self.work.vertices += self.shared_walks.trace(
                self.scene,
                self.selection.max_events,
                &mut views,
                self.groups(at, sample),
                &mut scores,
            );
            for view in &views {
                if view.factor != 1.0 {
                    scores[view.column].scale(view.factor);
                }
            }
            for (column, (scores, mean)) in (0..).zip(scores.iter_mut().zip(&mut *means)) {
                if self.wants_lamps() {
                    self.sample_without_daylight(at.seed, column, at.row, at.batch, sample);
                    scores.merge(&self.scores);
                }
                mean.add(scores, weight);
            }
        }
        true
    }

    /// The camera rays of a sample of every pixel of the row.
    fn views(&self, at: RowBatch, sample: u32) -> Vec<View> {
        let width = self.scene.camera.width;
        let view = |column: u32| {
            let draws = Draws::new(at.seed, at.row * width + column, at.batch, sample, 0);
            let (u, v) = (draws.leading(0), draws.leading(1));
            let (x, y, factor) = self.lamp_pixels.place(column, at.row, u, v)?;
            Some(View {
                ray: self.camera_ray(x, y),
                draws: draws.of_stream(1),
                column: column as usize,
                factor,
            })
        };
        (0..width).filter_map(view).collect()
    }

    /// Sizes of the first group of pixels that share walks and of the others: the first one is drawn, so that no edge
    /// between groups stays where it is.
    fn groups(&self, at: RowBatch, sample: u32) -> (usize, usize) {
        let first_pixel = at.row * self.scene.camera.width;
        let size = self.selection.share_walks as usize;
        let u = Draws::new(at.seed, first_pixel, at.batch, sample, 3).uniform();
        (1 + (u * size as f64) as usize, size)
    }
}
