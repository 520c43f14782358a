//! How often each count is in a picture, and which pixels are full or black.

use egui::{Color32, ColorImage};

/// Largest count of a channel on the screen.
const FULL: u8 = u8::MAX;
/// Colour of pixels with a full channel.
pub const CLIPPED: Color32 = Color32::from_rgb(255, 0, 110);
/// Colour of pixels that are black.
pub const BLACK: Color32 = Color32::from_rgb(0, 150, 255);

/// How often each count is in the channels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Pixels of each count, R, G and B.
    pub bins: [[u32; 256]; 3],
    /// Pixels.
    pub pixels: u32,
    /// Pixels of which some channel is full.
    pub clipped: u32,
    /// Pixels of which every channel is zero.
    pub black: u32,
}

impl Histogram {
    /// That of a picture.
    pub fn of(image: &ColorImage) -> Self {
        let mut found = Self {
            bins: [[0; 256]; 3],
            pixels: image.pixels.len() as u32,
            clipped: 0,
            black: 0,
        };
        for pixel in &image.pixels {
            for (bins, count) in found.bins.iter_mut().zip(counts(*pixel)) {
                bins[usize::from(count)] += 1;
            }
            found.clipped += u32::from(is_clipped(*pixel));
            found.black += u32::from(is_black(*pixel));
        }
        found
    }

    /// That many pixels as a share of all.
    pub fn share(&self, pixels: u32) -> f64 {
        f64::from(pixels) / f64::from(self.pixels.max(1))
    }
}

/// Red, green and blue.
pub fn counts(pixel: Color32) -> [u8; 3] {
    [pixel.r(), pixel.g(), pixel.b()]
}

fn is_clipped(pixel: Color32) -> bool {
    counts(pixel).contains(&FULL)
}

fn is_black(pixel: Color32) -> bool {
    counts(pixel) == [0; 3]
}

/// Marks of the pixels that are clipped or black, nothing elsewhere.
pub fn marks(image: &ColorImage) -> ColorImage {
    let mark = |pixel: &Color32| match *pixel {
        pixel if is_clipped(pixel) => CLIPPED,
        pixel if is_black(pixel) => BLACK,
        _ => Color32::TRANSPARENT,
    };
    ColorImage::new(image.size, image.pixels.iter().map(mark).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> ColorImage {
        let pixels = [(255, 3, 3), (0, 0, 0), (0, 0, 7), (9, 254, 255)];
        let pixels = pixels.map(|(r, g, b)| Color32::from_rgb(r, g, b));
        ColorImage::new([2, 2], pixels.to_vec())
    }

    #[test]
    fn counts_are_counted_by_channel_and_ends_by_pixel() {
        let found = Histogram::of(&picture());
        assert_eq!((found.pixels, found.clipped, found.black), (4, 2, 1));
        assert_eq!([0, 9, 255].map(|k| found.bins[0][k]), [2, 1, 1]);
        assert_eq!([0, 3, 254].map(|k| found.bins[1][k]), [2, 1, 1]);
        assert_eq!([0, 3, 7, 255].map(|k| found.bins[2][k]), [1, 1, 1, 1]);
        assert_eq!(found.share(found.clipped), 0.5);
        assert_eq!(Histogram::of(&ColorImage::default()).share(0), 0.0);
    }

    #[test]
    fn full_and_black_pixels_are_marked_and_no_others() {
        let expected = [CLIPPED, BLACK, Color32::TRANSPARENT, CLIPPED];
        assert_eq!(marks(&picture()).pixels, expected);
    }
}
