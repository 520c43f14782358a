//! The water of an environment: its place on Jerlov's scale, its phase function, and how its spectra become channels.

use std::fmt;
use std::str::FromStr;

use uw_media::spectral::{Response, SPECTRAL, SPECTRAL_MEASURED, WaterSpectrum};
use uw_media::{
    Bands, Iops, MediaError, WaterType, channel_iops,
    phase::{FournierForand, Phase},
};
use uw_render::scene::{Spectral, Water};

use super::EnvironmentError;

/// Refractive index of the particles against water in the phase function.
const PARTICLE_INDEX: f64 = 1.10;
/// Refractive index of the water.
pub(crate) const WATER_INDEX: f64 = 1.34;

/// How the spectra of a water become the three channels of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WaterBands {
    /// Coefficients of three bands.
    Three(Bands),
    /// "spectral": by wavelength, before a camera with three boxes for a response.
    Spectral,
    /// "spectral-measured": the same with the spectra that Williamson and Hollins measured.
    SpectralMeasured,
}

impl Default for WaterBands {
    fn default() -> Self {
        Self::Three(Bands::default())
    }
}

impl fmt::Display for WaterBands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Three(bands) => bands.fmt(f),
            Self::Spectral => f.write_str(SPECTRAL),
            Self::SpectralMeasured => f.write_str(SPECTRAL_MEASURED),
        }
    }
}

impl FromStr for WaterBands {
    type Err = MediaError;

    fn from_str(text: &str) -> Result<Self, MediaError> {
        match text {
            SPECTRAL => Ok(Self::Spectral),
            SPECTRAL_MEASURED => Ok(Self::SpectralMeasured),
            _ => text.parse().map(Self::Three),
        }
    }
}

/// Coefficients of no water.
const NOTHING: Iops = Iops {
    a: [0.0; 3],
    b: [0.0; 3],
};

/// A water on Jerlov's scale: one of his types, or a mixture of two written as `IB-II@0.4` (0.4 of the way
/// from IB to II).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WaterKind {
    /// One of the ten types.
    Type(WaterType),
    /// Absorption and scattering linear between two types.
    Between {
        /// The first type.
        from: WaterType,
        /// The second type.
        to: WaterType,
        /// How far it is from the first, in [0, 1].
        share: f64,
    },
}

impl WaterKind {
    /// Absorption and scattering per channel.
    pub fn iops(&self) -> Result<Iops, MediaError> {
        self.iops_in(WaterBands::default())
    }

    /// Absorption and scattering per channel in `bands`; by wavelength those near zero range.
    ///
    /// # Errors
    /// The bands do not cover the water.
    pub fn iops_in(&self, bands: WaterBands) -> Result<Iops, MediaError> {
        let bands = match bands {
            WaterBands::Three(bands) => bands,
            WaterBands::Spectral | WaterBands::SpectralMeasured => {
                let spectral = self.spectral(bands)?;
                return Ok(spectral.map_or(NOTHING, |spectral| spectral.wideband()));
            }
        };
        match *self {
            Self::Type(of) => channel_iops(of, &bands),
            Self::Between { from, to, share } => {
                let (x, y) = (channel_iops(from, &bands)?, channel_iops(to, &bands)?);
                let mix = |x: [f64; 3], y: [f64; 3]| {
                    std::array::from_fn(|k| (1.0 - share) * x[k] + share * y[k])
                };
                Ok(Iops {
                    a: mix(x.a, y.a),
                    b: mix(x.b, y.b),
                })
            }
        }
    }

    /// The water by wavelength; `None` in three bands.
    ///
    /// # Errors
    /// The bands do not cover the water.
    pub fn spectral(&self, bands: WaterBands) -> Result<Option<Spectral>, MediaError> {
        let of = |water_type| WaterSpectrum::of_bands(&bands.to_string(), water_type);
        let spectrum = match *self {
            Self::Type(only) => of(only)?,
            Self::Between { from, to, share } => {
                of(from)?.zip(of(to)?).map(|(x, y)| x.towards(&y, share))
            }
        };
        Ok(spectrum.map(|spectrum| Spectral::of(spectrum, Response::boxes())))
    }
}

impl From<WaterType> for WaterKind {
    fn from(of: WaterType) -> Self {
        Self::Type(of)
    }
}

impl fmt::Display for WaterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Type(of) => write!(f, "{of}"),
            Self::Between { from, to, share } => write!(f, "{from}-{to}@{share}"),
        }
    }
}

impl FromStr for WaterKind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let one = |name: &str| name.parse::<WaterType>().map_err(|e| e.to_string());
        let Some((types, share)) = text.split_once('@') else {
            return one(text).map(Self::Type);
        };
        let (Some((from, to)), Ok(share)) = (types.split_once('-'), share.parse::<f64>()) else {
            return Err(format!(
                "a water between two types must be written as \"IB-II@0.4\", got {text:?}"
            ));
        };
        if !(0.0..=1.0).contains(&share) {
            return Err(format!(
                "the share in {text:?} must be in [0, 1], got {share}"
            ));
        }
        Ok(Self::Between {
            from: one(from)?,
            to: one(to)?,
            share,
        })
    }
}

/// A water body: place on Jerlov's scale and backscatter fraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterBody {
    /// Jerlov type, or a mixture of two.
    pub jerlov: WaterKind,
    /// Backscatter fraction B of the phase function.
    pub backscatter_fraction: f64,
}

impl WaterBody {
    /// Whether the water can be: a backscatter fraction that its phase function has.
    ///
    /// # Errors
    /// The fraction or the type's coefficients cannot be used.
    pub fn check(&self) -> Result<(), EnvironmentError> {
        self.water(WaterBands::default()).map(|_| ())
    }

    pub(super) fn water(&self, bands: WaterBands) -> Result<Water, EnvironmentError> {
        Ok(Water {
            iops: self.jerlov.iops_in(bands)?,
            phase: Phase::FournierForand(FournierForand::new(
                PARTICLE_INDEX,
                self.backscatter_fraction,
            )?),
            refractive_index: WATER_INDEX,
        })
    }

    /// A name for files and tables, such as `3C_B0.0183`.
    pub fn name(&self) -> String {
        format!("{}_B{}", self.jerlov, self.backscatter_fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_read_as_they_are_written() {
        for name in [
            "mean",
            "paper-printed",
            "camera:imx219",
            SPECTRAL,
            SPECTRAL_MEASURED,
        ] {
            let bands: WaterBands = name.parse().expect(name);
            assert_eq!(bands.to_string(), name);
        }
        let told = "narrow".parse::<WaterBands>().unwrap_err().to_string();
        assert!(told.contains("narrow") && told.contains(SPECTRAL), "{told}");
        assert_eq!(WaterBands::default().to_string(), "mean");
    }

    #[test]
    fn a_mixture_by_wavelength_lies_between_its_types() {
        let water: WaterKind = "5C-7C@0.5".parse().unwrap();
        let spectral = water.spectral(WaterBands::Spectral).unwrap().unwrap();
        let at = |of: &WaterSpectrum| of.at([650.0, 550.0, 450.0]).a;
        let mixed = at(spectral.water.as_ref().unwrap());
        let ends = [WaterType::C5, WaterType::C7].map(|t| at(&WaterSpectrum::jerlov(t)));
        for k in 0..3 {
            let middle = 0.5 * (ends[0][k] + ends[1][k]);
            assert!((mixed[k] / middle - 1.0).abs() < 1e-12);
        }
        // Near zero range it is about what three bands have, whose table is coarser.
        let (fine, coarse) = (
            water.iops_in(WaterBands::Spectral).unwrap(),
            water.iops().unwrap(),
        );
        for k in 0..3 {
            assert!(
                (fine.b[k] / coarse.b[k] - 1.0).abs() < 0.1,
                "{fine:?} {coarse:?}"
            );
        }
        assert!(water.spectral(WaterBands::default()).unwrap().is_none());
        // The type 7C was not measured.
        assert!(water.spectral(WaterBands::SpectralMeasured).is_err());
    }
}
