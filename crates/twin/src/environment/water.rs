//! The water of an environment: where it is on Jerlov's scale, and its phase function.

use std::fmt;
use std::str::FromStr;

use uw_media::spectral::{JerlovWater, Response, WaterBands};
use uw_media::{
    Bands, Iops, MediaError, WaterType,
    phase::{FournierForand, Phase},
};
use uw_render::scene::{Spectral, Water};

use super::EnvironmentError;

/// Refractive index of the particles against water in the phase function.
pub const PARTICLE_INDEX: f64 = 1.10;
/// Refractive index of the water.
pub const WATER_INDEX: f64 = 1.34;

/// Three bands as data sets have them unless they say otherwise.
pub const MEAN: WaterBands = WaterBands::Three(Bands::Mean);

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
    /// Absorption and scattering per channel in three bands.
    pub fn iops(&self) -> Result<Iops, MediaError> {
        self.iops_in(MEAN, &Response::boxes())
    }

    /// Absorption and scattering per channel in `bands`; by wavelength those near zero range before a camera's `response`.
    ///
    /// # Errors
    /// The bands do not cover the water.
    pub fn iops_in(&self, bands: WaterBands, response: &Response) -> Result<Iops, MediaError> {
        bands.iops(self.jerlov(), response)
    }

    /// The water by wavelength, before a camera with a `response`; `None` in three bands.
    ///
    /// # Errors
    /// The bands do not cover the water.
    pub fn spectral(
        &self,
        bands: WaterBands,
        response: &Response,
    ) -> Result<Option<Spectral>, MediaError> {
        let spectrum = bands.spectrum(self.jerlov())?;
        Ok(spectrum.map(|spectrum| Spectral::of(spectrum, response.clone())))
    }

    fn jerlov(&self) -> JerlovWater {
        match *self {
            Self::Type(only) => only.into(),
            Self::Between { from, to, share } => JerlovWater { from, to, share },
        }
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

/// A water body: type on Jerlov's scale and backscatter fraction.
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
        self.water(MEAN, &Response::boxes()).map(|_| ())
    }

    pub(super) fn water(
        &self,
        bands: WaterBands,
        response: &Response,
    ) -> Result<Water, EnvironmentError> {
        Ok(Water {
            iops: self.jerlov.iops_in(bands, response)?,
            phase: Phase::FournierForand(FournierForand::new(
                PARTICLE_INDEX,
                self.backscatter_fraction,
            )?),
            refractive_index: WATER_INDEX,
            variation: uw_render::scene::Variation::default(),
        })
    }

    /// A name for files and tables, such as `3C_B0.0183`.
    pub fn name(&self) -> String {
        format!("{}_B{}", self.jerlov, self.backscatter_fraction)
    }
}
