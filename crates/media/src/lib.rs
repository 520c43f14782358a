//! Water and cameras as numbers: inherent optical properties, phase functions, the air-water interface, responses, encodings and vignetting.
//!
//! ```
//! use uw_media::phase::{FournierForand, Phase, PhaseFunction, PhaseTable};
//! use uw_media::{Bands, channel_iops, transmittance::transmittance};
//!
//! let iops = channel_iops("3C".parse()?, &Bands::Mean)?;
//! assert!((iops.a[0] - 0.388).abs() < 1e-9); // red absorption, 1/m
//! let seen = transmittance(iops.c()[0], 2.0); // share of red light left after 2 m
//! assert!((seen - (-2.0 * 1.19484_f64).exp()).abs() < 1e-9);
//!
//! let phase = Phase::FournierForand(FournierForand::new(1.10, 0.0183)?);
//! let median_deg = 2.0 * phase.inverse_cdf(0.5).sqrt().asin().to_degrees();
//! assert!((3.0..5.0).contains(&median_deg)); // half of the light is turned by less
//!
//! let table = PhaseTable::new(&phase); // the same for the inner loop of a renderer
//! let x = table.sample_x(0.5);
//! assert!((table.value(x) / phase.value(x) - 1.0).abs() < 1e-5);
//! # Ok::<(), uw_media::MediaError>(())
//! ```

mod bands;
mod daylight;
mod depth_profile;
pub mod encoding;
mod error;
pub mod interface;
mod iops;
mod jerlov;
pub mod phase;
pub mod spectral;
mod tables;
pub mod transmittance;
mod vignetting;

pub use bands::{Bands, Camera, Interval, channel_iops};
pub use daylight::kirk_attenuation;
pub use depth_profile::{DepthLayer, depth_profile};
pub use encoding::{CurveError, Encoding, ResponseCurve};
pub use error::{MediaError, meant};
pub use iops::{Iops, Spectrum};
pub use jerlov::{SpectralIop, WaterType, spectrum};
pub use vignetting::Vignetting;
