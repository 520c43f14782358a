//! A coarse picture that stands in for rows without samples, where the time did not last for them.

use super::{Film, FilmLayer, NotFinite};
use uw_media::Spectrum;

/// The same view in fewer, larger pixels.
#[derive(Clone, Debug)]
pub(super) struct Coarse {
    film: Film,
    /// Pixels of the picture, a side, that one pixel of the film stands for.
    step: usize,
}

impl Coarse {
    /// Writes the values of a layer in row `y` of the picture. Their variance is infinite: they are means over more
    /// than a pixel, so that nothing is known of how far the pixel itself is from them.
    pub(super) fn show(&self, y: usize, layer: FilmLayer, values: &mut [Spectrum]) {
        if layer == FilmLayer::Variance {
            return values.fill([f64::INFINITY; 3]);
        }
        let row = &self.film.rows[(y / self.step).min(self.film.rows.len() - 1)];
        let mut means = vec![[0.0; 3]; self.film.width as usize];
        row.show(self.film.lamps, layer, &mut means);
        for (x, value) in values.iter_mut().enumerate() {
            *value = means[(x / self.step).min(means.len() - 1)];
        }
    }

    /// As [`Film::check_finite`], in pixels of the picture.
    pub(super) fn check_finite(&self, lamp_names: &[String]) -> Result<(), NotFinite> {
        let (step, area) = (self.step, (self.step * self.step) as u64);
        let in_pixels = |coarse: NotFinite| NotFinite {
            pixels: area * coarse.pixels,
            all: area * coarse.all,
            column: step * coarse.column,
            row: step * coarse.row,
            ..coarse
        };
        self.film.check_finite(lamp_names).map_err(in_pixels)
    }
}

impl Film {
    /// Rows without samples show `coarse` from now on, a film of the same view whose pixels are `step` pixels of this one
    /// wide and high; what is left over at the right and at the bottom belongs to its last ones.
    pub(crate) fn stand_in(&mut self, coarse: Film, step: u32) {
        let step = step as usize;
        self.coarse = Some(Box::new(Coarse { film: coarse, step }));
    }

    /// Number of pixels that have no samples of their own and show a coarse picture.
    pub fn filled_pixels(&self) -> u64 {
        let filled = self.rows.iter().filter(|row| row.batches == 0).count() as u64;
        match self.coarse {
            Some(_) => filled * u64::from(self.width),
            None => 0,
        }
    }

    /// Width of the pixels of the coarse picture that some rows show, pixels, and its samples per such pixel.
    pub fn coarse(&self) -> Option<(u32, u64)> {
        let coarse = self.coarse.as_ref().filter(|_| self.filled_pixels() > 0)?;
        Some((coarse.step as u32, coarse.film.samples()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::BatchMean;
    use super::*;

    fn mean(total: f32) -> BatchMean {
        BatchMean::of_sums(&[total; 9], 1, &[])
    }

    #[test]
    fn rows_without_samples_show_the_coarse_picture_and_no_variance() {
        let mut film = Film::new(5, 3, 0);
        for batch in [1.0, 3.0] {
            for x in 0..5 {
                film.rows[1].add(x, 0, &mean(batch), 4);
            }
            film.rows[1].finish_batch(4);
        }
        let mut coarse = Film::new(2, 1, 0);
        for x in 0..2 {
            coarse.rows[0].add(x, 0, &mean(10.0 + x as f32), 4);
        }
        coarse.rows[0].finish_batch(4);
        film.stand_in(coarse, 2);
        let total: Vec<f64> = film.layer(FilmLayer::Total).iter().map(|p| p[1]).collect();
        let filled = [10.0, 10.0, 11.0, 11.0, 11.0];
        assert_eq!(total, [filled, [2.0; 5], filled].concat());
        let variance = film.layer(FilmLayer::Variance);
        assert_eq!(variance[4], [f64::INFINITY; 3]);
        assert_eq!(variance[7], [1.0; 3]);
        assert_eq!((film.filled_pixels(), film.coarse()), (10, Some((2, 4))));
        assert_eq!(film.relative_error(), None);
    }
}
