//! Absorption and scattering of a water by wavelength.

use crate::error::MediaError;
use crate::iops::Iops;
use crate::jerlov::{SpectralIop, WaterType, fine_spectrum, measured_spectrum};

use super::{Curve, Response, TableError, read_columns};

/// Absorption and scattering by wavelength, water itself included.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterSpectrum {
    /// Absorption, 1/m.
    pub a: Curve,
    /// Scattering, 1/m.
    pub b: Curve,
}

/// Largest coefficient of a user's table, 1/m.
const LARGEST_PER_M: f64 = 1e4;

impl WaterSpectrum {
    /// A Jerlov type, 400 to 700 nm in steps of 10 nm.
    pub fn jerlov(water_type: WaterType) -> Self {
        Self::of(fine_spectrum(water_type))
    }

    /// A type as Williamson and Hollins (2022) measured it.
    ///
    /// # Errors
    /// Types that they did not measure.
    pub fn measured(water_type: WaterType) -> Result<Self, MediaError> {
        Ok(Self::of(measured_spectrum(water_type)?))
    }

    /// What lies between two waters: this one at `weight` 0, `other` at 1.
    pub fn towards(&self, other: &Self, weight: f64) -> Self {
        Self {
            a: self.a.towards(&other.a, weight),
            b: self.b.towards(&other.b, weight),
        }
    }

    /// Reads a table with the columns wavelength_nm, a_per_m and b_per_m.
    ///
    /// # Errors
    /// As [`read_columns`].
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let [a, b] = read_columns(text, ["a_per_m", "b_per_m"], Some(LARGEST_PER_M))?;
        Ok(Self { a, b })
    }

    fn of(samples: &[SpectralIop]) -> Self {
        let curve = |value: fn(&SpectralIop) -> f64| {
            Curve::new(
                samples
                    .iter()
                    .map(|s| (s.wavelength_nm, value(s)))
                    .collect(),
            )
        };
        Self {
            a: curve(|s| s.a),
            b: curve(|s| s.b),
        }
    }

    /// Coefficients at three wavelengths, one for each channel.
    pub fn at(&self, wavelengths_nm: [f64; 3]) -> Iops {
        Iops {
            a: wavelengths_nm.map(|nm| self.a.at(nm)),
            b: wavelengths_nm.map(|nm| self.b.at(nm)),
        }
    }

    /// Coefficients of the channels of `response` near zero range, 1/m.
    pub fn near_zero_range(&self, response: &Response) -> Iops {
        let range = Some(self.range_nm());
        Iops {
            a: response.channel_values(range, |nm| self.a.at(nm)),
            b: response.channel_values(range, |nm| self.b.at(nm)),
        }
    }

    /// First and last wavelength, nm.
    pub fn range_nm(&self) -> (f64, f64) {
        self.a.range_nm().unwrap_or((0.0, 0.0))
    }
}
