//! What a lens leaves of the light away from the middle of a picture.

use serde::{Deserialize, Serialize};

/// Least and largest share of light at a place that a lens may leave.
const RANGE: (f64, f64) = (0.05, 1.5);

/// Light over that in the middle: 1 + k₁ r² + k₂ r⁴ + k₃ r⁶, r the distance from the picture's middle over that of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 3]", into = "[f64; 3]")]
pub struct Vignetting([f64; 3]);

impl Vignetting {
    /// Of the three coefficients.
    ///
    /// # Errors
    /// A share of light below 0.05 or above 1.5 somewhere in the picture.
    pub fn new(coefficients: [f64; 3]) -> Result<Self, String> {
        let lens = Self(coefficients);
        for i in 0..=100 {
            let radius = f64::from(i) / 100.0;
            let share = lens.share(radius * radius);
            if !(share >= RANGE.0 && share <= RANGE.1) {
                return Err(format!(
                    "vignetting {coefficients:?} leaves {share:.3} of the light at {radius} of the way to the corner; it must leave {} to {} \
                     everywhere (1 + k1 r^2 + k2 r^4 + k3 r^6)",
                    RANGE.0, RANGE.1
                ));
            }
        }
        Ok(lens)
    }

    /// The coefficients k₁, k₂, k₃.
    pub fn coefficients(self) -> [f64; 3] {
        self.0
    }

    /// Light over that in the middle at a squared radius in [0, 1].
    pub fn share(self, square: f64) -> f64 {
        let [k1, k2, k3] = self.0;
        1.0 + square * (k1 + square * (k2 + square * k3))
    }

    /// The share at a pixel of a picture of `width` x `height` pixels.
    pub fn share_at(self, (column, row): (u32, u32), (width, height): (u32, u32)) -> f64 {
        let half = [0.5 * f64::from(width), 0.5 * f64::from(height)];
        let off = [
            f64::from(column) + 0.5 - half[0],
            f64::from(row) + 0.5 - half[1],
        ];
        let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
        self.share(square(off) / square(half))
    }
}

impl TryFrom<[f64; 3]> for Vignetting {
    type Error = String;

    fn try_from(coefficients: [f64; 3]) -> Result<Self, String> {
        Self::new(coefficients)
    }
}

impl From<Vignetting> for [f64; 3] {
    fn from(lens: Vignetting) -> Self {
        lens.0
    }
}
