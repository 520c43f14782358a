//! Contrast by physics: what the water does to a target's detail, from tables of one water, camera and set of lamps.
//!
//! The linear signal of an image of a flat target is, at each point of the image,
//!
//! y = V + E · (T ρ + S (s ∗ ρ))
//!
//! with the veil V, the irradiance over π of the target E, the transmittance T of the straight ray, and the share S and spread s
//! of rays that scatter before they meet the target ([`water`]: V, E, S and s of daylight and of the lamps, by distance). The
//! present picture, cleared of V and E, shows the target's detail by scale ([`detail`]); with the V, E, T, S and s of another
//! distance and lamp level the same detail makes another contrast ([`predict`], with what a fit leaves open of the water in [`doubt`], of which a search looks at a sheet made once a
//! picture, [`present`]). Nothing of the target is learned beforehand; pictures of it
//! from other distances, kept in the water's [`file`] or taken by the vehicle on its way (`earlier`), tell what the present one does not show (`memory`).

mod blocks;
mod brightness;
mod cleared;
pub mod detail;
pub mod doubt;
mod earlier;
pub mod file;
mod full_scale;
mod grid;
mod light;
mod made;
mod memory;
mod noise;
mod overlap;
mod patches;
mod pictures;
pub mod predict;
pub mod present;
mod scales;
mod shape;
mod sheet;
pub mod target;
pub mod water;
mod waves;

pub use brightness::Brightness;
pub use cleared::LinearPicture;
pub use detail::TargetDetail;
pub use doubt::WaterDoubt;
pub use earlier::Earlier;
pub use file::{WaterFile, WaterFileError};
pub use pictures::{Pictures, TakenPicture};
pub use predict::{Contrast, Place, Predictor, Unknown};
pub use present::{Present, Residual, ResidualFrom, Water};
pub use target::Sight;
pub use water::WaterTables;

#[cfg(test)]
mod tests;
