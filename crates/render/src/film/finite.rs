//! Films that hold a value that is no number: nothing of them can be used.

use rayon::prelude::*;
use uw_media::Spectrum;

use super::{FIXED, Film, FilmLayer, Row};

/// Values of a picture that are not finite.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{pixels} of {all} pixels are no finite numbers, the first in column {column}, row {row} (counted from 0 at the top \
     left), layer {layer}, where the radiance is {value}; nothing of such a render can be used"
)]
pub struct NotFinite {
    /// Number of pixels with such a value in any layer.
    pub pixels: u64,
    /// Number of pixels in all.
    pub all: u64,
    /// Column of the first one, from the left.
    pub column: usize,
    /// Row of the first one, from the top.
    pub row: usize,
    /// The layer of the first one, by the name it has in EXR files; `picture` for the whole.
    pub layer: String,
    /// The value found there.
    pub value: f64,
}

impl Film {
    /// Whether every radiance is a finite number, in single precision too, in which it is written.
    ///
    /// # Errors
    /// The first pixel that is not, and how many there are. `lamp_names` are those of the scene.
    pub fn check_finite(&self, lamp_names: &[String]) -> Result<(), NotFinite> {
        if let Some(coarse) = &self.coarse {
            coarse.check_finite(lamp_names)?;
        }
        let layers = layers(self.lamps);
        let of_row = |(y, row): (usize, &Row)| {
            let pixels = row.sums.chunks_exact(FIXED + self.lamps).enumerate();
            let mut bad = pixels.filter_map(|(x, pixel)| Some((x, row.bad_value(pixel, &layers)?)));
            let (column, (layer, value)) = bad.next()?;
            let first = NotFinite {
                pixels: 1 + bad.count() as u64,
                all: u64::from(self.width) * u64::from(self.height),
                column,
                row: y,
                layer: name(layer, lamp_names),
                value,
            };
            Some(first)
        };
        let rows = self.rows.par_iter().enumerate().filter_map(of_row);
        let earlier = |one: NotFinite, other: NotFinite| NotFinite {
            pixels: one.pixels + other.pixels,
            ..if one.row <= other.row { one } else { other }
        };
        match rows.reduce_with(earlier) {
            Some(found) => Err(found),
            None => Ok(()),
        }
    }
}

impl Row {
    /// The first of `layers` of a pixel that has a value that is not finite, and that value.
    fn bad_value(&self, pixel: &[Spectrum], layers: &[FilmLayer]) -> Option<(FilmLayer, f64)> {
        layers.iter().find_map(|&layer| {
            let values = self.value(pixel, layer);
            let bad = values.into_iter().find(|&v| !(v as f32).is_finite())?;
            Some((layer, bad))
        })
    }
}

/// The sources first: what is wrong with one of them is wrong with the whole too.
fn layers(lamps: usize) -> Vec<FilmLayer> {
    let sources = std::iter::once(FilmLayer::Ambient).chain((0..lamps).map(FilmLayer::Lamp));
    let rest = [FilmLayer::Direct, FilmLayer::Backscatter, FilmLayer::Total];
    sources.chain(rest).collect()
}

fn name(layer: FilmLayer, lamp_names: &[String]) -> String {
    let fixed = match layer {
        FilmLayer::Total => "picture",
        FilmLayer::Ambient => "ambient",
        FilmLayer::Direct => "direct",
        FilmLayer::Backscatter => "backscatter",
        FilmLayer::Variance => "variance",
        FilmLayer::Lamp(i) => {
            let name = lamp_names.get(i).cloned();
            return format!("lamp.{}", name.unwrap_or_else(|| i.to_string()));
        }
    };
    fixed.to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::BatchMean;
    use super::*;

    /// Three rows of four pixels with one lamp; `pixels` have `value` in the lamp's green channel.
    fn film(value: f32, pixels: &[(usize, usize)]) -> Film {
        let mut film = Film::new(4, 3, 1);
        for (y, row) in film.rows.iter_mut().enumerate() {
            for x in 0..4 {
                let mut sums = [0.5; 12];
                if pixels.contains(&(x, y)) {
                    sums[10] = value;
                }
                row.add(x, 1, &BatchMean::of_sums(&sums, 1, &[1.0]), 1);
            }
            row.finish_batch(1);
        }
        film
    }

    #[test]
    fn the_first_pixel_its_layer_and_the_number_are_named() {
        let names = ["left".to_owned()];
        assert_eq!(film(7.0, &[(1, 1)]).check_finite(&names), Ok(()));
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let film = film(value, &[(3, 2), (2, 1), (0, 2)]);
            let error = film.check_finite(&names).expect_err("not finite");
            assert_eq!((error.column, error.row, error.pixels), (2, 1, 3));
            let text = error.to_string();
            assert!(
                text.contains("3 of 12 pixels")
                    && text.contains("column 2, row 1")
                    && text.contains("layer lamp.left"),
                "{text}"
            );
        }
    }

    /// Radiance is written in single precision: what has no place there is as bad as what is no number.
    #[test]
    fn what_single_precision_cannot_hold_is_refused() {
        let mut film = film(0.0, &[]);
        film.rows[0].sums[2] = [0.0, 1e39, 0.0];
        let error = film.check_finite(&[]).expect_err("too large");
        assert_eq!((error.layer.as_str(), error.value), ("ambient", 1e39));
    }
}
