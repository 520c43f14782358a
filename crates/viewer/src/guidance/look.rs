//! What the vehicle's camera sees from one place, at every lamp level.

use std::sync::Arc;

use uw_calib::ImageStats;
use uw_calib::picture::Counts;
use uw_guidance::physics::Water;
use uw_render::image::Picture;
use uw_render::scene::{Noise, Sensor};
use uw_twin::estimate::statistics::StandardErrors;
use uw_twin::estimate::target_image::TargetImage;

use super::task::VehiclePosition;

/// Lamp levels at which statistics are kept. They lie evenly in the root of the level, because counts rise steeply
/// where there is little light.
const LEVELS: usize = 21;
/// Pixels of the image per pixel of the thumbnail, along an edge.
const THUMBNAIL_STEP: usize = 4;

/// The lamp levels of a look, percent.
pub fn levels_pct() -> Vec<f64> {
    (0..LEVELS)
        .map(|i| 100.0 * (i as f64 / (LEVELS - 1) as f64).powi(2))
        .collect()
}

/// A view from the vehicle at every lamp level.
#[derive(Clone, Debug)]
pub struct Look {
    /// Where it was taken.
    pub position: VehiclePosition,
    /// The image.
    pub film: Film,
    /// A small copy of it.
    pub thumbnail: Film,
    /// The tables of the water that it was taken in, where physics was to predict from it.
    pub water: Option<Arc<Water>>,
    at_levels: Vec<Seen>,
}

/// Statistics of an image at a lamp level, and their standard errors, 8-bit counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Mean and contrast.
    pub stats: ImageStats,
    /// What the paths of the render leave unknown.
    pub errors: StandardErrors,
}

impl Look {
    /// A look whose statistics at [`levels_pct`] are known.
    pub fn new(
        position: VehiclePosition,
        at_levels: Vec<Seen>,
        film: Film,
        water: Option<Arc<Water>>,
    ) -> Self {
        Self {
            position,
            thumbnail: film.thinned(),
            film,
            water,
            at_levels,
        }
    }

    /// Statistics of the image at a lamp level, from its neighbours among those that are known.
    pub fn statistics(&self, light_pct: f64) -> Option<Seen> {
        let last = self.at_levels.len().checked_sub(1)?;
        let at = (0.01 * light_pct.clamp(0.0, 100.0)).sqrt() * last as f64;
        let below = (at as usize).min(last);
        let share = at - below as f64;
        let (low, high) = (self.at_levels[below], self.at_levels[(below + 1).min(last)]);
        let mix = |low: [f64; 3], high: [f64; 3]| {
            std::array::from_fn(|k| low[k] + share * (high[k] - low[k]))
        };
        Some(Seen {
            stats: ImageStats {
                contrast: mix(low.stats.contrast, high.stats.contrast),
                mean: mix(low.stats.mean, high.stats.mean),
            },
            errors: StandardErrors {
                contrast: mix(low.errors.contrast, high.errors.contrast),
                mean: mix(low.errors.mean, high.errors.mean),
            },
        })
    }
}

/// An image as radiance of daylight and of the lamps at 100 %, and the sensor that stores it.
#[derive(Clone, Debug)]
pub struct Film {
    daylight: Picture,
    lamps: Picture,
    sensor: Sensor,
}

impl Film {
    /// Of `image`.
    pub fn new(image: &TargetImage, sensor: Sensor) -> Self {
        let daylight = image.picture(0.0);
        let both = image.picture(100.0);
        let lamps = Picture {
            data: std::iter::zip(&both.data, &daylight.data)
                .map(|(both, day)| std::array::from_fn(|k| both[k] - day[k]))
                .collect(),
            ..both
        };
        Self {
            daylight,
            lamps,
            sensor,
        }
    }

    /// A small copy: every pixel is the mean of a block, noise of the sensor included.
    fn thinned(&self) -> Self {
        let block = (THUMBNAIL_STEP * THUMBNAIL_STEP) as f64;
        let noise = self.sensor.noise.map(|n| Noise {
            a: n.a / block,
            b: n.b / block,
        });
        Self {
            daylight: thinned(&self.daylight),
            lamps: thinned(&self.lamps),
            sensor: Sensor {
                noise,
                ..self.sensor
            },
        }
    }

    /// What the sensor stores at a lamp level, with noise of its own for each `seed`.
    pub fn stored(&self, light_pct: f64, seed: u64) -> Counts {
        let level = (0.01 * light_pct) as f32;
        let data = std::iter::zip(&self.daylight.data, &self.lamps.data)
            .map(|(day, lamps)| std::array::from_fn(|k| day[k] + level * lamps[k]))
            .collect();
        let picture = Picture {
            data,
            ..self.daylight.clone()
        };
        Counts::stored(
            picture.width as usize,
            picture.height as usize,
            self.sensor.expose(&picture, seed).in_8_bit_counts(),
        )
    }
}

/// Means over blocks of pixels.
fn thinned(picture: &Picture) -> Picture {
    let step = THUMBNAIL_STEP;
    let (columns, rows) = (
        picture.width as usize / step,
        picture.height as usize / step,
    );
    let mut thin = Picture::black(columns as u32, rows as u32);
    for (i, pixel) in thin.data.iter_mut().enumerate() {
        let corner = (i / columns) * step * picture.width as usize + (i % columns) * step;
        for (y, x) in (0..step).flat_map(|y| (0..step).map(move |x| (y, x))) {
            let source = &picture.data[corner + y * picture.width as usize + x];
            (0..3).for_each(|k| pixel[k] += source[k] / (step * step) as f32);
        }
    }
    thin
}

#[cfg(test)]
mod tests {
    use uw_render::image::linear_to_srgb;

    use super::*;

    /// Counts behind the sRGB curve in water that is dark without lamps: the steepest case.
    #[test]
    fn statistics_between_the_levels_are_close() {
        let contrast = |pct: f64| 40.0 * linear_to_srgb(1e-4 + 0.01 * pct);
        let at_levels = levels_pct()
            .into_iter()
            .map(|pct| Seen {
                stats: ImageStats {
                    contrast: [contrast(pct); 3],
                    mean: [2.0 * contrast(pct); 3],
                },
                errors: StandardErrors {
                    contrast: [0.01 * contrast(pct); 3],
                    mean: [0.0; 3],
                },
            })
            .collect();
        let position = VehiclePosition {
            depth_m: 1.0,
            distance_m: 1.0,
        };
        let nothing = Film {
            daylight: Picture::black(4, 4),
            lamps: Picture::black(4, 4),
            sensor: uw_twin::environment::sensor(&Default::default(), 1.0),
        };
        let look = Look::new(position, at_levels, nothing, None);
        // Between 0 and the first level of 0.25 % nobody sets lamps.
        for pct in [0.0, 0.3, 1.7, 20.0, 33.0, 67.0, 99.0, 100.0, 140.0] {
            let found = look.statistics(pct).expect("levels");
            let expected = contrast(pct.min(100.0));
            let error = (found.stats.contrast[1] - expected).abs();
            // A tenth of a count is far below what an image tells.
            assert!(error < 0.1, "{pct}: {found:?} {expected}");
            assert!((found.stats.mean[2] - 2.0 * found.stats.contrast[2]).abs() < 1e-9);
            assert!((found.errors.contrast[0] - 0.01 * found.stats.contrast[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_thumbnail_holds_means_of_blocks() {
        let mut picture = Picture::black(9, 4);
        picture.data[2] = [16.0, 0.0, 0.0];
        picture.data[9 + 5] = [0.0, 32.0, 0.0];
        let thin = thinned(&picture);
        assert_eq!((thin.width, thin.height), (2, 1));
        assert_eq!(thin.data, [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    }
}
