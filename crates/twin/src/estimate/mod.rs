//! Contrast and mean of the image of a flat target, from few paths and without the noise of the paths.
//!
//! An image of 1280 × 720 pixels has too many of them to render each one well. But all detail in it comes from
//! the target's texture, which is known, and everything else is smooth. Along every camera path until it first
//! meets the target, the radiance at image point x is exactly
//!
//! L(x) = V(x) + E(x) · M(x),  M(x) = T(x) ρ(x) + S(x) · (s ∗ ρ)(x)
//!
//! * V, the veil: light that never met the target;
//! * E: the target's irradiance over π, all light that reaches it, scattered or not;
//! * T = exp(-c · length): the unscattered camera ray; ρ: the texture;
//! * S, s: share and spread on the target of camera rays that scatter before they meet it.
//!
//! V and E are smooth over the image: a polynomial each, fitted to the renderer's paths through random image
//! points ([`fields`]). T and ρ are known; S and s come from walks from the camera to the target ([`spread`],
//! with the texture blurred in steps, [`pyramid`]). The fit uses the moments Σφ(L - V - E M) = 0, so that it is
//! linear in the paths' radiance and unbiased at any number of them.
//!
//! Where the scene goes by wavelength, T, S, s and ρ are means over the wavelengths of a channel, weighted with the light
//! of the source that reaches the target in each ([`source_light`]).
//!
//! The fit is made in [`fields::GROUPS`] groups of independent paths. Half of the groups give one image, the
//! other half a second one ([`radiance`]); the variance of a patch is the **covariance of the two**, to which
//! noise of the paths adds nothing in expectation, plus the variance that the sensor's noise and rounding
//! really have there ([`response`]). The spread of the groups gives the standard error ([`statistics`]).
//!
//! Two approximations remain: E is taken at x rather than where the scattered ray lands (its known part for
//! lamps is corrected), and the spread s is that of the whole image's mean. What they cost is measured against
//! plain renders at full resolution by `uw dataset --check`.

pub mod basis;
pub mod every_water;
pub mod fields;
pub mod guess;
mod levels;
mod numbers;
mod paths;
pub mod pyramid;
pub mod radiance;
pub mod response;
pub mod source_light;
pub mod spread;
pub mod statistics;
pub mod target_image;
pub mod target_model;
pub mod target_view;
pub mod upward;
mod walks;
pub mod water_tables;
