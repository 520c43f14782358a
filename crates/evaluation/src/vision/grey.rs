//! Grey images from colour frames.

use uw_render::image::{Counts, Frame};

use super::VisionError;

/// Weights of R, G, B in BT.601 luma, thousandths.
const LUMA: [u32; 3] = [299, 587, 114];

/// A grey image of 8 bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GreyImage {
    width: usize,
    height: usize,
    values: Vec<u8>,
}

impl GreyImage {
    /// An image of given grey values, row 0 at the top.
    pub fn new(width: usize, height: usize, values: Vec<u8>) -> Result<Self, VisionError> {
        if values.len() != width * height || values.is_empty() {
            return Err(VisionError::BufferLength {
                width,
                height,
                expected: (width * height).max(1),
                got: values.len(),
            });
        }
        Ok(Self {
            width,
            height,
            values,
        })
    }

    /// BT.601 luma 0.299 R + 0.587 G + 0.114 B of the stored counts on the scale of 8 bits, rounded half up.
    pub fn of_frame(frame: &Frame) -> Self {
        let luma = |rgb: [u32; 3]| {
            let sum: u32 = rgb.iter().zip(LUMA).map(|(v, w)| v * w).sum();
            ((sum + 500) / 1000) as u8
        };
        let values = match &frame.counts {
            Counts::Bits8(counts) => counts
                .chunks_exact(3)
                .map(|c| luma([c[0], c[1], c[2]].map(u32::from)))
                .collect(),
            Counts::Bits16(counts) => counts
                .chunks_exact(3)
                .map(|c| luma([c[0], c[1], c[2]].map(|v| (u32::from(v) + 128) / 257)))
                .collect(),
        };
        Self {
            width: frame.width as usize,
            height: frame.height as usize,
            values,
        }
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Grey values row by row from the top.
    pub fn values(&self) -> &[u8] {
        &self.values
    }

    /// The grey values as numbers, 0 to 255.
    pub fn numbers(&self) -> Vec<f64> {
        self.values.iter().map(|&v| f64::from(v)).collect()
    }
}
