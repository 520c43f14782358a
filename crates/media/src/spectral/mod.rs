//! Quantities by wavelength: water, lamps, daylight, reflectances, and the response of a camera.
//!
//! Between its nodes a spectrum is a straight line. The value of a channel with response w is ∫ L(λ) w(λ) dλ / ∫ w(λ) dλ.

mod bands;
mod constituents;
mod curve;
mod jerlov_water;
mod luminous;
mod named;
mod response;
mod sight;
mod table;
mod water;

pub use bands::WaterBands;
pub use constituents::Constituents;
pub use curve::Curve;
pub use jerlov_water::JerlovWater;
pub use luminous::{efficacy_lm_per_w, mean_seen};
pub use named::{ILLUMINANTS, illuminant, sky_light, sunlight};
pub use response::{Drawn, RESPONSES, Response};
pub use sight::{secchi_depth_m, visibility_m};
pub use table::{TableError, read_columns};
pub use water::WaterSpectrum;

/// Reflectances of the red, the green and the blue that linear sRGB mixes, in [0, 1]: each mixture of numbers in [0, 1] stays
/// there, and equal numbers reflect alike at every wavelength (`tools/spectra/rgb_primaries.py`).
pub fn primaries() -> [Curve; 3] {
    let text = crate::tables::RGB_PRIMARIES;
    ["r", "g", "b"].map(|name| named::embedded(text, name))
}
