//! A picture channel by channel, so that sums over it are sums over rows of numbers.

use image::DynamicImage;

use crate::picture::COUNTS_PER_U16;
use crate::stats::StatsError;

/// Partial sums, which vector units make side by side.
const LANES: usize = 8;

/// A picture in 8-bit counts.
#[derive(Clone, Debug)]
pub(crate) struct Planes {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// R, G and B, each row by row from the top left.
    pub channels: [Vec<f64>; 3],
}

impl Planes {
    /// Of a picture whose pixel `i`, row by row from the top left, is `pixel(i)`.
    pub fn new(width: usize, height: usize, pixel: impl Fn(usize) -> [f64; 3]) -> Self {
        let mut channels = [const { Vec::new() }; 3];
        for channel in &mut channels {
            channel.reserve_exact(width * height);
        }
        for i in 0..width * height {
            for (channel, value) in channels.iter_mut().zip(pixel(i)) {
                channel.push(value);
            }
        }
        Self {
            width,
            height,
            channels,
        }
    }

    /// Of interleaved samples, `channels` of them a pixel: 1 (grey), 2 (grey, alpha), 3 (R, G, B) or 4 (R, G, B, alpha). A sample is
    /// `light` of its count, which is `step` times the sample.
    pub fn of_samples<T: Sample>(
        (width, height): (usize, usize),
        samples: &[T],
        channels: usize,
        step: f64,
        light: &dyn Fn(f64) -> f64,
    ) -> Self {
        let count = |sample: T| light(step * Into::<f64>::into(sample));
        let next = usize::from(channels >= 3);
        let planes = |of: &dyn Fn(T) -> f64| {
            let plane = |k: usize| {
                let pixels = samples.chunks_exact(channels);
                pixels.map(|pixel| of(pixel[k * next])).collect()
            };
            [plane(0), plane(1), plane(2)]
        };
        // Where there are more samples than values each value is worked out once.
        let channels = match samples.len() > T::ALL.len() {
            true => {
                let table: Vec<f64> = T::ALL.map(|value| light(step * value as f64)).collect();
                planes(&|sample| table[Into::<usize>::into(sample)])
            }
            false => planes(&count),
        };
        Self {
            width,
            height,
            channels,
        }
    }

    /// Of a decoded file.
    ///
    /// # Errors
    /// Its samples are not unsigned integers of 8 or 16 bits.
    pub fn of_image(
        image: &DynamicImage,
        name: &str,
        light: &dyn Fn(f64) -> f64,
    ) -> Result<Self, StatsError> {
        let size = (image.width() as usize, image.height() as usize);
        let eight = |samples: &[u8], n: usize| Self::of_samples(size, samples, n, 1.0, light);
        let sixteen =
            |samples: &[u16], n: usize| Self::of_samples(size, samples, n, COUNTS_PER_U16, light);
        Ok(match image {
            DynamicImage::ImageLuma8(b) => eight(b.as_raw(), 1),
            DynamicImage::ImageLumaA8(b) => eight(b.as_raw(), 2),
            DynamicImage::ImageRgb8(b) => eight(b.as_raw(), 3),
            DynamicImage::ImageRgba8(b) => eight(b.as_raw(), 4),
            DynamicImage::ImageLuma16(b) => sixteen(b.as_raw(), 1),
            DynamicImage::ImageLumaA16(b) => sixteen(b.as_raw(), 2),
            DynamicImage::ImageRgb16(b) => sixteen(b.as_raw(), 3),
            DynamicImage::ImageRgba16(b) => sixteen(b.as_raw(), 4),
            other => {
                return Err(StatsError::SampleType {
                    name: name.to_owned(),
                    got: format!("{:?}", other.color()),
                });
            }
        })
    }
}

/// A stored number.
pub(crate) trait Sample: Copy + Into<f64> + Into<usize> {
    /// All that there are.
    const ALL: std::ops::Range<usize>;
}

impl Sample for u8 {
    const ALL: std::ops::Range<usize> = 0..1 << 8;
}

impl Sample for u16 {
    const ALL: std::ops::Range<usize> = 0..1 << 16;
}

/// Part of a plane: `width` × `height` pixels from `first` on, in rows of `stride`.
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    pub plane: &'a [f64],
    pub first: usize,
    pub width: usize,
    pub height: usize,
    pub stride: usize,
}

impl<'a> Part<'a> {
    /// All of it, as one row.
    pub fn whole(plane: &'a [f64]) -> Self {
        Self {
            plane,
            first: 0,
            width: plane.len(),
            height: 1,
            stride: plane.len(),
        }
    }

    /// Mean of a function of its values.
    pub fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let mut sums = [0.0; LANES];
        for y in 0..self.height {
            let from = self.first + y * self.stride;
            let (chunks, rest) = self.plane[from..from + self.width].as_chunks::<LANES>();
            for chunk in chunks {
                for (sum, &value) in sums.iter_mut().zip(chunk) {
                    *sum += of(value);
                }
            }
            for (sum, &value) in sums.iter_mut().zip(rest) {
                *sum += of(value);
            }
        }
        sums.iter().sum::<f64>() / (self.width * self.height) as f64
    }

    /// Mean of a function of its values, of which some may be unknown (NaN): of the known ones; NaN where there is none.
    pub fn mean_of_known(&self, of: impl Fn(f64) -> f64) -> f64 {
        self.mean_and_known(of).0
    }

    /// The same, and how many are known.
    pub fn mean_and_known(&self, of: impl Fn(f64) -> f64) -> (f64, usize) {
        let mean = self.mean(&of);
        if !mean.is_nan() {
            return (mean, self.width * self.height);
        }
        let (mut sum, mut n) = (0.0, 0);
        for value in self.values().filter(|value| !value.is_nan()) {
            sum += of(value);
            n += 1;
        }
        (sum / n as f64, n)
    }

    /// How many of its values are known.
    pub fn known(&self) -> usize {
        self.values().filter(|value| !value.is_nan()).count()
    }

    fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let row = |y: usize| &self.plane[self.first + y * self.stride..][..self.width];
        (0..self.height).flat_map(row).copied()
    }
}
