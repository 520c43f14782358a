//! Textures: reading picture files within bounds, and looking values up.

use std::fs::File;
use std::io::Cursor;
use std::path::Path;
use uw_media::Spectrum;

use image::{ColorType, DynamicImage, ImageDecoder, Limits};

use super::{Texels, Texture, TextureEncoding, TextureFilter};
use crate::image::{Reader, reader};

/// Largest side of a texture, texels.
const MAX_SIDE_TEXELS: u32 = 16_384;
/// Most memory that the textures of one scene may take, bytes: one of the largest size with 8 bits a channel.
const MAX_SCENE_BYTES: u64 = 1 << 30;
/// Most memory that decoding one texture may take, bytes.
const MAX_DECODE_BYTES: u64 = 1 << 31;

/// Memory, bytes, that a scene has left for textures beside these.
pub(super) fn room_beside(textures: &[Texture]) -> u64 {
    let taken: u64 = textures.iter().map(|texture| texture.texels.bytes()).sum();
    MAX_SCENE_BYTES.saturating_sub(taken)
}

impl Texture {
    /// Reads a PNG, JPEG or TIFF file, a shipped one (`shipped:NAME`) too. The error says what is wrong, without the path.
    pub fn read(
        path: &Path,
        encoding: TextureEncoding,
        filter: TextureFilter,
    ) -> Result<Self, String> {
        Self::read_within(path, encoding, filter, MAX_SCENE_BYTES)
    }

    /// As [`Texture::read`], with at most `room` bytes for the texels.
    pub(super) fn read_within(
        path: &Path,
        encoding: TextureEncoding,
        filter: TextureFilter,
        room: u64,
    ) -> Result<Self, String> {
        if uw_assets::shipped_name(path).is_some() {
            let bytes = uw_assets::ALL
                .read(path)
                .map_err(|error| error.to_string())?;
            return Self::from_bytes(&bytes, encoding, filter, room);
        }
        let file = File::open(path).map_err(|error| error.to_string())?;
        let reader = reader(file).map_err(|error| error.to_string())?;
        Self::decode(reader, encoding, filter, room)
    }

    /// Reads an encoded picture from memory, with at most `room` bytes for the texels. The error says what is wrong.
    pub(super) fn from_bytes(
        bytes: &[u8],
        encoding: TextureEncoding,
        filter: TextureFilter,
        room: u64,
    ) -> Result<Self, String> {
        let reader = reader(Cursor::new(bytes)).map_err(|error| error.to_string())?;
        Self::decode(reader, encoding, filter, room)
    }

    fn decode(
        mut reader: Reader,
        encoding: TextureEncoding,
        filter: TextureFilter,
        room: u64,
    ) -> Result<Self, String> {
        let mut limits = Limits::default();
        limits.max_alloc = Some(MAX_DECODE_BYTES);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
        let (width, height) = decoder.dimensions();
        // The header alone decides: a picture too large is never decoded.
        if width == 0 || height == 0 || width.max(height) > MAX_SIDE_TEXELS {
            return Err(format!(
                "a texture must be 1 to {MAX_SIDE_TEXELS} texels wide and high, got {width} x {height}"
            ));
        }
        let texel_bytes = texel_bytes(decoder.color_type());
        let needed = u64::from(width) * u64::from(height) * texel_bytes;
        if needed > room {
            return Err(format!(
                "{width} x {height} texels of {texel_bytes} bytes take {needed} bytes of memory; a scene's textures \
                 may take {MAX_SCENE_BYTES} in all, of which {room} are left"
            ));
        }
        let decoded = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
        Self::from_texels(width, height, Texels::of(decoded, encoding), filter)
    }

    fn from_texels(
        width: u32,
        height: u32,
        texels: Texels,
        filter: TextureFilter,
    ) -> Result<Self, String> {
        match texels.first_outside() {
            Some(i) => {
                let (row, column) = (i / width as usize, i % width as usize);
                Err(format!(
                    "texel (column {column}, row {row}) must be in [0, 1], got {:?}",
                    texels.get(i)
                ))
            }
            None => Ok(Self {
                width,
                height,
                texels,
                filter,
            }),
        }
    }

    /// Value at (`u`, `v`), where (0, 0) is the upper left corner of the picture, (1, 1) its lower right one
    /// and everything repeats. `u` and `v` are finite.
    #[inline]
    pub fn sample(&self, u: f64, v: f64) -> Spectrum {
        let x = (u - floor(u)) * f64::from(self.width);
        let y = (v - floor(v)) * f64::from(self.height);
        match self.filter {
            TextureFilter::Nearest => {
                // Rounding can carry u - floor(u) up to 1.
                let column = (x as usize).min(self.width as usize - 1);
                let row = (y as usize).min(self.height as usize - 1);
                let [red, green, blue] = self.texel(column, row);
                [red.into(), green.into(), blue.into()]
            }
            TextureFilter::Bilinear => self.bilinear(x - 0.5, y - 0.5),
        }
    }

    /// Linear interpolation at texel coordinates in which whole numbers are texel centres, from -0.5 up.
    #[inline]
    fn bilinear(&self, x: f64, y: f64) -> Spectrum {
        let (left, right, s) = neighbours(x, self.width as usize);
        let (upper, lower, t) = neighbours(y, self.height as usize);
        let corners = [
            (self.texel(left, upper), (1.0 - s) * (1.0 - t)),
            (self.texel(right, upper), s * (1.0 - t)),
            (self.texel(left, lower), (1.0 - s) * t),
            (self.texel(right, lower), s * t),
        ];
        std::array::from_fn(|k| {
            corners
                .iter()
                .map(|(texel, weight)| f64::from(texel[k]) * weight)
                .sum()
        })
    }

    #[inline]
    fn texel(&self, column: usize, row: usize) -> [f32; 3] {
        self.texels.get(row * self.width as usize + column)
    }

    /// Mean value over all texels.
    pub(super) fn mean(&self) -> Spectrum {
        let mut sum = [0.0; 3];
        for texel in self.texels.iter() {
            (0..3).for_each(|k| sum[k] += f64::from(texel[k]));
        }
        sum.map(|sum| sum / self.texels.len() as f64)
    }
}

/// Bytes in memory of a texel of a picture, without alpha.
fn texel_bytes(color: ColorType) -> u64 {
    let channels = u64::from(color.channel_count());
    let sample_bytes = u64::from(color.bytes_per_pixel()) / channels;
    match sample_bytes {
        // Floating-point values are kept as three.
        4.. => 12,
        _ if color.has_color() => 3 * sample_bytes,
        _ => sample_bytes,
    }
}

/// The largest whole number up to `x`, without the call of a function that it takes where processors may be old.
#[inline]
fn floor(x: f64) -> f64 {
    /// Numbers of at least this size are whole.
    const WHOLE: f64 = (1_u64 << 52) as f64;
    if x.abs() >= WHOLE {
        return x;
    }
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

/// The texels on both sides of `x` in [-0.5, size - 0.5], wrapped, and the weight of the second.
#[inline]
fn neighbours(x: f64, size: usize) -> (usize, usize, f64) {
    let floor = floor(x);
    // floor is -1 at least and size - 1 at most.
    let before = if floor < 0.0 {
        size - 1
    } else {
        (floor as usize).min(size - 1)
    };
    let after = if before + 1 == size { 0 } else { before + 1 };
    (before, after, x - floor)
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "Texture({} x {}, {:?})",
            self.width, self.height, self.filter
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2 x 2 texels whose red is 0, 0.25 / 0.5, 1 and whose green is the column.
    fn texture(filter: TextureFilter) -> Texture {
        let texels = vec![
            [0.0, 0.0, 1.0],
            [0.25, 1.0, 1.0],
            [0.5, 0.0, 1.0],
            [1.0, 1.0, 1.0],
        ];
        Texture {
            width: 2,
            height: 2,
            texels: texels.into(),
            filter,
        }
    }

    #[test]
    fn floors_are_those_of_the_library() {
        let numbers = [
            0.0,
            0.3,
            1.0,
            2.999_999,
            7.5e8,
            4.503_599_627_370_495e15,
            1e16,
            1e300,
        ];
        for x in numbers.into_iter().flat_map(|x| [x, -x]) {
            assert_eq!(floor(x), x.floor(), "{x}");
        }
    }

    #[test]
    fn nearest_takes_the_texel_that_holds_the_point() {
        let texture = texture(TextureFilter::Nearest);
        let cases = [
            (0.0, 0.0, 0.0),
            (0.49, 0.49, 0.0),
            (0.5, 0.0, 0.25),
            (0.0, 0.5, 0.5),
            (0.99, 0.99, 1.0),
            (1.0, 0.0, 0.0),
            (-0.01, 0.0, 0.25),
            (3.75, -2.25, 1.0),
            (-1e-18, 0.0, 0.25),
        ];
        for (u, v, red) in cases {
            assert_eq!(texture.sample(u, v)[0], red, "({u}, {v})");
        }
    }

    #[test]
    fn bilinear_meets_texel_centres_and_is_linear_between_them() {
        let texture = texture(TextureFilter::Bilinear);
        let cases = [
            (0.25, 0.25, 0.0),
            (0.75, 0.25, 0.25),
            (0.75, 0.75, 1.0),
            (0.5, 0.25, 0.125),
            (0.25, 0.5, 0.25),
            (0.5, 0.5, 0.4375),
            (0.0, 0.25, 0.125),
            (1.0, 0.25, 0.125),
            (0.25, 0.0, 0.25),
            (-0.75, 5.25, 0.0),
        ];
        for (u, v, red) in cases {
            let value = texture.sample(u, v);
            assert!((value[0] - red).abs() < 1e-12, "({u}, {v}): {value:?}");
            assert!((value[2] - 1.0).abs() < 1e-12);
        }
        assert!(texture.sample(-1e-18, -1e-18)[0].is_finite());
    }

    #[test]
    fn values_outside_reflectances_are_refused_with_their_place() {
        let texels = vec![[0.5; 3], [0.5; 3], [0.5; 3], [0.5, 1.5, 0.5]];
        let texels = Texels::from(texels);
        let reason = Texture::from_texels(2, 2, texels, TextureFilter::Nearest).expect_err("1.5");
        assert!(
            reason.contains("column 1, row 1") && reason.contains("1.5"),
            "{reason}"
        );
    }
}
