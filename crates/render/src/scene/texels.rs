//! The values of a texture as its file stores them, decoded when they are looked up: what is looked up at random should
//! stay in the cache, and a large picture in memory.

use std::sync::Arc;

use image::DynamicImage;

use super::TextureEncoding;
use crate::image::srgb_to_linear;

/// Linear R, G, B values, row by row from the top. Copies share their memory.
#[derive(Clone)]
pub struct Texels(Arc<Stored>);

enum Stored {
    /// Codes of 8 bits.
    Bytes(Codes<u8>, Box<[f32; 256]>),
    /// Codes of 16 bits.
    Words(Codes<u16>, Vec<f32>),
    /// The values themselves.
    Plain(Vec<[f32; 3]>),
}

/// Codes, and values by code beside them.
struct Codes<T> {
    codes: Vec<T>,
    /// One code a texel instead of three.
    is_grey: bool,
}

impl<T: Copy> Codes<T> {
    /// Codes of pictures of 1 (grey), 2 (with alpha), 3 or 4 (with alpha) channels.
    fn of(codes: Vec<T>, channels: usize) -> Self {
        let is_grey = channels < 3;
        let codes = if channels.is_multiple_of(2) {
            without_last(codes, channels)
        } else {
            codes
        };
        Self { codes, is_grey }
    }

    fn len(&self) -> usize {
        self.codes.len() / if self.is_grey { 1 } else { 3 }
    }

    #[inline]
    fn get(&self, index: usize) -> [T; 3] {
        if self.is_grey {
            [self.codes[index]; 3]
        } else {
            let texel = &self.codes[3 * index..3 * index + 3];
            [texel[0], texel[1], texel[2]]
        }
    }
}

impl Texels {
    /// The texels of a decoded picture; alpha is left out.
    pub(super) fn of(picture: DynamicImage, encoding: TextureEncoding) -> Self {
        let bytes =
            |codes, channels| Stored::Bytes(Codes::of(codes, channels), byte_values(encoding));
        let words =
            |codes, channels| Stored::Words(Codes::of(codes, channels), word_values(encoding));
        Self(Arc::new(match picture {
            DynamicImage::ImageLuma8(picture) => bytes(picture.into_raw(), 1),
            DynamicImage::ImageLumaA8(picture) => bytes(picture.into_raw(), 2),
            DynamicImage::ImageRgb8(picture) => bytes(picture.into_raw(), 3),
            DynamicImage::ImageRgba8(picture) => bytes(picture.into_raw(), 4),
            DynamicImage::ImageLuma16(picture) => words(picture.into_raw(), 1),
            DynamicImage::ImageLumaA16(picture) => words(picture.into_raw(), 2),
            DynamicImage::ImageRgb16(picture) => words(picture.into_raw(), 3),
            DynamicImage::ImageRgba16(picture) => words(picture.into_raw(), 4),
            other => {
                let value = |value: f32| linear(value, encoding);
                let picture = other.to_rgb32f();
                Stored::Plain(picture.pixels().map(|pixel| pixel.0.map(value)).collect())
            }
        }))
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        match &*self.0 {
            Stored::Bytes(codes, _) => codes.len(),
            Stored::Words(codes, _) => codes.len(),
            Stored::Plain(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory that they take, bytes, but for a table of values of fixed size.
    pub fn bytes(&self) -> u64 {
        let bytes = match &*self.0 {
            Stored::Bytes(codes, _) => codes.codes.len(),
            Stored::Words(codes, _) => 2 * codes.codes.len(),
            Stored::Plain(texels) => size_of_val(&texels[..]),
        };
        bytes as u64
    }

    /// The texel at `index`, below the number of texels.
    #[inline]
    pub fn get(&self, index: usize) -> [f32; 3] {
        match &*self.0 {
            Stored::Bytes(codes, values) => {
                let [red, green, blue] = codes.get(index);
                let value = |code| values[usize::from(code)];
                [value(red), value(green), value(blue)]
            }
            Stored::Words(codes, values) => {
                let [red, green, blue] = codes.get(index);
                let value = |code| values[usize::from(code)];
                [value(red), value(green), value(blue)]
            }
            Stored::Plain(texels) => texels[index],
        }
    }

    /// All texels in their order.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// Codes of 8 bits in their order and the values they stand for; `None` for texels that are kept otherwise.
    pub(crate) fn coded(&self) -> Option<(impl Iterator<Item = [u8; 3]> + '_, &[f32; 256])> {
        match &*self.0 {
            Stored::Bytes(codes, values) => {
                Some(((0..codes.len()).map(|i| codes.get(i)), &**values))
            }
            _ => None,
        }
    }

    /// The first texel that is outside [0, 1], as only floating-point values can be.
    pub(super) fn first_outside(&self) -> Option<usize> {
        let outside = |texel: &[f32; 3]| texel.iter().any(|value| !(0.0..=1.0).contains(value));
        match &*self.0 {
            Stored::Plain(texels) => texels.iter().position(outside),
            _ => None,
        }
    }
}

impl From<Vec<[f32; 3]>> for Texels {
    fn from(texels: Vec<[f32; 3]>) -> Self {
        Self(Arc::new(Stored::Plain(texels)))
    }
}

fn linear(value: f32, encoding: TextureEncoding) -> f32 {
    match encoding {
        TextureEncoding::Linear => value,
        TextureEncoding::Srgb => srgb_to_linear(f64::from(value)) as f32,
    }
}

/// What codes of 8 bits stand for.
fn byte_values(encoding: TextureEncoding) -> Box<[f32; 256]> {
    let value = |code| linear(code as f32 / f32::from(u8::MAX), encoding);
    Box::new(std::array::from_fn(value))
}

/// What codes of 16 bits stand for.
fn word_values(encoding: TextureEncoding) -> Vec<f32> {
    let value = |code| linear(f32::from(code) / f32::from(u16::MAX), encoding);
    (0..=u16::MAX).map(value).collect()
}

/// Leaves the last of every `channels` values out, in place.
fn without_last<T: Copy>(mut values: Vec<T>, channels: usize) -> Vec<T> {
    let (kept, count) = (channels - 1, values.len() / channels);
    for i in 0..count {
        values.copy_within(i * channels..i * channels + kept, i * kept);
    }
    values.truncate(count * kept);
    values.shrink_to_fit();
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};

    /// Every code of `u16` or `u8` in a picture of one row.
    fn row<P: image::Pixel>(pixels: impl Iterator<Item = P>) -> ImageBuffer<P, Vec<P::Subpixel>> {
        let pixels: Vec<P> = pixels.collect();
        ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| pixels[x as usize])
    }

    #[test]
    fn texels_are_the_values_of_their_picture_in_its_own_size() {
        let (bytes, words) = (|| 0..=u8::MAX, || 0..=u16::MAX);
        let pictures: [(DynamicImage, u64); 8] = [
            (row(bytes().map(|v| Luma([v]))).into(), 1),
            (row(bytes().map(|v| LumaA([v, 7]))).into(), 1),
            (row(bytes().map(|v| Rgb([v, 255 - v, 9]))).into(), 3),
            (row(bytes().map(|v| Rgba([v, 255 - v, 9, 7]))).into(), 3),
            (row(words().map(|v| Luma([v]))).into(), 2),
            (row(words().map(|v| LumaA([v, 7]))).into(), 2),
            (row(words().map(|v| Rgb([v, 65_535 - v, 9]))).into(), 6),
            (row(words().map(|v| Rgba([v, 65_535 - v, 9, 7]))).into(), 6),
        ];
        for (picture, bytes) in pictures {
            for encoding in [TextureEncoding::Linear, TextureEncoding::Srgb] {
                let texels = Texels::of(picture.clone(), encoding);
                let name = format!("{:?} {encoding:?}", picture.color());
                let values = picture.to_rgb32f();
                assert_eq!(
                    texels.bytes(),
                    bytes * values.pixels().len() as u64,
                    "{name}"
                );
                assert_eq!(texels.len(), values.pixels().len());
                for (texel, pixel) in texels.iter().zip(values.pixels()) {
                    let expected = pixel.0.map(|value| linear(value, encoding));
                    // Two roundings: the decoder's library and this one divide in different orders.
                    let near = |(a, b): (f32, f32)| (a - b).abs() <= 3e-7 * b;
                    assert!(
                        texel.into_iter().zip(expected).all(near),
                        "{name}: {texel:?} {expected:?}"
                    );
                }
                assert_eq!(texels.first_outside(), None);
            }
        }
    }

    #[test]
    fn values_in_floating_point_stay_as_they_are() {
        let values = vec![[0.25, 0.5, 0.75], [0.0, 1.5, f32::MIN_POSITIVE]];
        let texels = Texels::from(values.clone());
        assert!(texels.iter().eq(values));
        assert_eq!((texels.bytes(), texels.first_outside()), (24, Some(1)));
        assert!(texels.coded().is_none());
    }
}
