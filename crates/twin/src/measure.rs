//! Renders of a view and the statistics of the image that the sensor would make of them.
//!
//! Every view is rendered as two independent halves. Lamps and daylight are separate layers of one render,
//! because radiance is linear in each lamp's level: one render gives the image at every level.

use std::sync::atomic::AtomicBool;

use uw_calib::ImageStats;
use uw_render::{
    film::FilmLayer,
    image::Picture,
    integrator::{self, Plan, RenderError},
    prepare::Prepared,
    scene::{Encoding, Exposure, Noise, Scene, Sensor},
};

/// Patches of the contrast definition, columns and rows.
const PATCHES: (usize, usize) = (10, 6);
/// Variance of rounding to whole counts.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// How many samples each half takes, and from which seed.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Samples per pixel of each half.
    pub samples_per_half: u32,
    /// Seed.
    pub seed: u64,
    /// Threads; `None` for all cores.
    pub threads: Option<usize>,
}

/// One half of a render: radiance per pixel and channel.
#[derive(Clone, Debug)]
struct Half {
    ambient: Vec<[f64; 3]>,
    lamps: Vec<[f64; 3]>,
}

/// A rendered view.
#[derive(Clone, Debug)]
pub struct RenderedView {
    width: usize,
    height: usize,
    halves: [Half; 2],
}

impl RenderedView {
    /// Renders both halves of `scene`; `cancel` stops the render with an error.
    pub fn render(
        scene: &Scene,
        quality: Quality,
        cancel: &AtomicBool,
    ) -> Result<Self, RenderError> {
        let prepared = Prepared::build(scene);
        let half = |part: u64| -> Result<Half, RenderError> {
            let plan = Plan {
                samples_per_pixel: Some(quality.samples_per_half),
                threads: quality.threads,
                dark_lamps: true,
                ..Plan::new(quality.seed.wrapping_mul(2).wrapping_add(part))
            };
            let (film, stats) = integrator::render_lanes(&prepared, &plan, cancel, &|_| {})?;
            if stats.interrupted {
                return Err(RenderError::Incomplete {
                    rows: 0,
                    total: film.rows.len(),
                });
            }
            let mut lamps = vec![[0.0; 3]; film.width as usize * film.height as usize];
            for i in 0..film.lamps() {
                for (sum, value) in lamps.iter_mut().zip(film.layer(FilmLayer::Lamp(i))) {
                    (0..3).for_each(|k| sum[k] += value[k]);
                }
            }
            Ok(Half {
                ambient: film.layer(FilmLayer::Ambient),
                lamps,
            })
        };
        Ok(Self {
            width: scene.camera.width as usize,
            height: scene.camera.height as usize,
            halves: [half(0)?, half(1)?],
        })
    }

    /// Radiance at a lamp level, the mean of both halves.
    pub fn picture(&self, light_pct: f64) -> Picture {
        let data = (0..self.width * self.height)
            .map(|i| {
                std::array::from_fn(|k| {
                    (0.5 * (self.radiance(0, i, light_pct)[k] + self.radiance(1, i, light_pct)[k]))
                        as f32
                })
            })
            .collect();
        Picture {
            width: self.width as u32,
            height: self.height as u32,
            data,
        }
    }

    fn radiance(&self, half: usize, pixel: usize, light_pct: f64) -> [f64; 3] {
        let Half { ambient, lamps } = &self.halves[half];
        std::array::from_fn(|k| ambient[pixel][k] + 0.01 * light_pct * lamps[pixel][k])
    }

    /// Mean and contrast of the image that `sensor` makes at a lamp level, without the part that the noise of
    /// the render would add.
    ///
    /// The variance in a patch is the covariance of the two halves, whose render noise is independent, plus
    /// the variance that sensor noise and rounding add to it; [`mean_root`] takes the mean of its roots. The
    /// sensor must have a fixed exposure; with an automatic one the signal is scaled to its mean.
    pub fn statistics(&self, sensor: &Sensor, light_pct: f64) -> ImageStats {
        let exposure = self.exposure(sensor, light_pct);
        let (columns, rows) = PATCHES;
        let (patch_width, patch_height) = (self.width / columns, self.height / rows);
        let mut patches = Vec::with_capacity(columns * rows);
        for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
            let mut patch = PairedPatchSums::default();
            for y in row * patch_height..(row + 1) * patch_height {
                for x in column * patch_width..(column + 1) * patch_width {
                    let pixel = y * self.width + x;
                    self.add_pixel(&mut patch, pixel, exposure, light_pct, sensor);
                }
            }
            patches.push(patch);
        }
        let mut all = PairedPatchSums::default();
        for pixel in 0..self.width * self.height {
            self.add_pixel(&mut all, pixel, exposure, light_pct, sensor);
        }
        ImageStats {
            contrast: std::array::from_fn(|k| mean_root(&patches, k)),
            mean: all.mean(),
        }
    }

    /// Linear signal per radiance.
    pub fn exposure(&self, sensor: &Sensor, light_pct: f64) -> f64 {
        match sensor.exposure {
            Exposure::Fixed(exposure) => exposure,
            Exposure::AutoMean(_) => sensor.exposure_factor(&self.picture(light_pct)),
        }
    }

    fn add_pixel(
        &self,
        patch: &mut PairedPatchSums,
        pixel: usize,
        exposure: f64,
        light_pct: f64,
        sensor: &Sensor,
    ) {
        let (first, second) = (
            self.radiance(0, pixel, light_pct),
            self.radiance(1, pixel, light_pct),
        );
        let encoding = sensor.encoding;
        let counts = |radiance: [f64; 3]| radiance.map(|l| encoding.counts(exposure * l));
        let noise_variance = std::array::from_fn(|k| {
            let signal = (0.5 * exposure * (first[k] + second[k])).max(0.0);
            (sensor.noise).map_or(0.0, |noise| count_variance(&noise, encoding, signal))
        });
        patch.add(counts(first), counts(second), noise_variance);
    }
}

/// Variance in squared counts that sensor noise adds at linear signal `signal`: the noise variance times the
/// squared slope of the encoding; none where the signal is clipped.
fn count_variance(noise: &Noise, encoding: Encoding, signal: f64) -> f64 {
    if signal >= 1.0 {
        return 0.0;
    }
    let deviation = noise.standard_deviation(signal);
    // The slope over one standard deviation, so that the steep start of the encoding is not exaggerated.
    let (low, high) = ((signal - deviation).max(0.0), (signal + deviation).min(1.0));
    let slope = (encoding.counts(high) - encoding.counts(low)) / (high - low).max(1e-12);
    (slope * deviation).powi(2)
}

/// Share of the squared mean variance that its sampling error may be for the roots to be taken one by one.
const CLEAN_SHARE: f64 = 0.01;

/// Mean over patches of the standard deviation of channel `k`.
///
/// The root of a noisy variance is biased, most of all where the variance is small. Where the variances are
/// known well their roots are averaged; elsewhere the mean root is expanded around the mean variance m,
/// sqrt(m) (1 − V/(8 m²)), with the spread V of the variances freed of their sampling error.
fn mean_root(patches: &[PairedPatchSums], k: usize) -> f64 {
    let n = patches.len() as f64;
    let variances: Vec<f64> = patches.iter().map(|p| p.variance(k)).collect();
    let mean = variances.iter().sum::<f64>() / n;
    let error2 = patches.iter().map(|p| p.squared_error(k)).sum::<f64>() / n;
    if error2 <= CLEAN_SHARE * mean * mean {
        return variances.iter().map(|v| v.max(0.0).sqrt()).sum::<f64>() / n;
    }
    let mean = mean.max(ROUNDING_VARIANCE);
    let spread = variances.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) - error2;
    mean.sqrt() * (1.0 - (spread / (8.0 * mean * mean)).clamp(0.0, 0.25))
}

/// Sums over the pixels of a patch.
#[derive(Clone, Copy, Debug, Default)]
struct PairedPatchSums {
    pixels: f64,
    first: [f64; 3],
    second: [f64; 3],
    product: [f64; 3],
    squares: [f64; 3],
    noise: [f64; 3],
}

impl PairedPatchSums {
    fn add(&mut self, first: [f64; 3], second: [f64; 3], noise: [f64; 3]) {
        self.pixels += 1.0;
        for k in 0..3 {
            self.first[k] += first[k];
            self.second[k] += second[k];
            self.product[k] += first[k] * second[k];
            self.squares[k] += 0.5 * (first[k] * first[k] + second[k] * second[k]);
            self.noise[k] += noise[k];
        }
    }

    fn mean(&self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * (self.first[k] + self.second[k]) / self.pixels)
    }

    /// Covariance of the halves.
    fn covariance(&self, k: usize) -> f64 {
        let n = self.pixels;
        self.product[k] / n - (self.first[k] / n) * (self.second[k] / n)
    }

    /// Variance of the image in the patch, squared counts; may be negative by its sampling error.
    fn variance(&self, k: usize) -> f64 {
        self.covariance(k) + self.noise[k] / self.pixels + ROUNDING_VARIANCE
    }

    /// Squared sampling error of the covariance that the render noise of variance s causes:
    /// (s² + 2 s covariance)/n.
    fn squared_error(&self, k: usize) -> f64 {
        let n = self.pixels;
        let mean = self.mean()[k];
        let covariance = self.covariance(k).max(0.0);
        let noise = (self.squares[k] / n - mean * mean - covariance).max(0.0);
        (noise * noise + 2.0 * noise * covariance) / n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uw_media::ResponseCurve;
    use uw_render::sampling::Rng;

    const WIDTH: usize = 200;
    const HEIGHT: usize = 120;

    /// A chequered picture whose halves carry independent noise of relative standard deviation `noise`.
    fn view(noise: f64) -> RenderedView {
        let half = |part: u32| {
            let mut rng = Rng::new(5, part, 0, 0);
            let pixel = |i: usize| {
                let level = if (i % WIDTH + i / WIDTH).is_multiple_of(2) {
                    0.30
                } else {
                    0.34
                };
                // Uniform noise of unit variance.
                let error = 12f64.sqrt() * (rng.uniform() - 0.5);
                [level * (1.0 + noise * error); 3]
            };
            Half {
                ambient: (0..WIDTH * HEIGHT).map(pixel).collect(),
                lamps: vec![[0.0; 3]; WIDTH * HEIGHT],
            }
        };
        RenderedView {
            width: WIDTH,
            height: HEIGHT,
            halves: [half(0), half(1)],
        }
    }

    fn sensor(noise: Option<Noise>) -> Sensor {
        Sensor {
            exposure: Exposure::Fixed(1.0),
            encoding: Encoding::Srgb,
            bits: 8,
            noise,
            ..Sensor::default()
        }
    }

    #[test]
    fn noise_of_the_render_does_not_count_as_contrast() {
        let clean = view(0.0).statistics(&sensor(None), 0.0);
        let noisy_view = view(0.1);
        let noisy = noisy_view.statistics(&sensor(None), 0.0);
        // The noise alone has a standard deviation of about 6 counts, the pattern one of 4.
        let naive = ImageStats::from_counts(
            WIDTH,
            HEIGHT,
            &noisy_view.halves[0]
                .ambient
                .iter()
                .map(|p| p.map(|v| Encoding::Srgb.counts(v)))
                .collect::<Vec<_>>(),
        )
        .unwrap();
        assert!(naive.contrast[0] > 1.5 * clean.contrast[0]);
        // 60 patches of 400 pixels: the covariance of the halves has a standard error of about 1 %.
        assert!(
            (noisy.contrast[0] / clean.contrast[0] - 1.0).abs() < 0.04,
            "{noisy:?} {clean:?}"
        );
    }

    #[test]
    fn sensor_noise_counts_as_in_the_exposed_picture() {
        let squares: Vec<[f64; 2]> = (1..=17)
            .map(|k| [15.0 * f64::from(k), f64::from(k * k)])
            .collect();
        let curve = ResponseCurve::new(&squares).unwrap();
        for encoding in [Encoding::Srgb, Encoding::Linear, Encoding::Curve(curve)] {
            let sensor = Sensor {
                encoding,
                ..sensor(Some(Noise { a: 1e-3, b: 1e-5 }))
            };
            let view = view(0.0);
            let expected = view.statistics(&sensor, 0.0);
            let counts = sensor.expose(&view.picture(0.0), 3).in_8_bit_counts();
            let exposed = ImageStats::from_counts(WIDTH, HEIGHT, &counts).unwrap();
            for k in 0..3 {
                assert!(
                    (exposed.contrast[k] / expected.contrast[k] - 1.0).abs() < 0.01,
                    "{exposed:?} {expected:?}"
                );
                assert!((exposed.mean[k] / expected.mean[k] - 1.0).abs() < 0.002);
            }
        }
    }
}
