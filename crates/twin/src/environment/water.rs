//! The water of an environment: where it is on Jerlov's scale, and its phase function.

use uw_media::spectral::{JerlovWater, Response, WaterBands};
use uw_media::{
    Bands,
    phase::{FournierForand, Phase},
};
use uw_render::scene::Water;

use super::EnvironmentError;

/// Refractive index of the particles against water in the phase function.
pub const PARTICLE_INDEX: f64 = 1.10;
/// Refractive index of the water.
pub const WATER_INDEX: f64 = 1.34;

/// Three bands as data sets have them unless they say otherwise.
pub const MEAN: WaterBands = WaterBands::Three(Bands::Mean);

/// A water body: type on Jerlov's scale and backscatter fraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterBody {
    /// Jerlov type, or a mixture of two.
    pub jerlov: JerlovWater,
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
            iops: bands.iops(self.jerlov, response)?,
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
