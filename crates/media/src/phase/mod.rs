//! Phase functions: how water spreads the light it scatters.
//!
//! Every function takes `x = sin²(θ/2)` in `[0, 1]`, where θ is the angle between the directions of
//! travel before and after: `x = 0` is straight on, `x = 1` straight back, and `cosθ = 1 - 2x`.
//! With unit directions `x = |ω - ω'|²/4`. Water scatters so far forward that `cosθ` has no digits
//! left for the peak, while `x` keeps its relative precision down to the smallest angle.
//! The solid angle between `x` and `x + dx` is `4π dx`, so the density of `x` is `4π·value(x)`.

mod disk;
mod draine;
mod fast;
mod fournier_forand;
mod henyey_greenstein;
mod mixture;
mod molecular;
mod solve;
mod tabulated;

pub use disk::disk_mean;
pub use draine::Draine;
pub use fast::{CellParts, DiskTable, PhaseTable, X_MIN};
pub use fournier_forand::{FournierForand, backscatter_from_mu, mu_from_backscatter};
pub use henyey_greenstein::HenyeyGreenstein;
pub use mixture::Mixture;
pub use molecular::{Isotropic, Rayleigh};
use solve::Share;
pub use solve::X_FLOOR;
pub use tabulated::Tabulated;

/// Distribution of the scattering angle, as a function of `x = sin²(θ/2)`.
pub trait PhaseFunction {
    /// Phase function, 1/sr, >= 0; `4π ∫ value dx` over `[0, 1]` is 1.
    fn value(&self, x: f64) -> f64;

    /// Share of the light that is scattered into angles up to `x`, in `[0, 1]`.
    fn cdf(&self, x: f64) -> f64;

    /// `1 - cdf(x)`, without the cancellation where it is small.
    fn ccdf(&self, x: f64) -> f64;

    /// The `x` below which the share `u` in `[0, 1]` of the light is scattered; small `u` is forward.
    /// An angle too small for any float comes back as [`X_FLOOR`], never as NaN.
    fn inverse_cdf(&self, u: f64) -> f64 {
        solve::invert(self, Share::Below(u))
    }

    /// The `x` above which the share `v` in `[0, 1]` of the light is scattered: `inverse_cdf(1 - v)` without
    /// the rounding of `1 - v`; small `v` is backward.
    fn inverse_ccdf(&self, v: f64) -> f64 {
        solve::invert(self, Share::Above(v))
    }

    /// Mean of cosθ, in (-1, 1).
    fn mean_cosine(&self) -> f64;

    /// Share of the light that is scattered by more than 90°, in (0, 1).
    fn backscatter_fraction(&self) -> f64 {
        self.ccdf(0.5)
    }
}

/// Any of the phase functions, chosen at run time.
#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    /// Fournier-Forand: particles with a power law of sizes.
    FournierForand(FournierForand),
    /// Henyey-Greenstein.
    HenyeyGreenstein(HenyeyGreenstein),
    /// Rayleigh with depolarisation: pure water.
    Rayleigh(Rayleigh),
    /// The same in all directions.
    Isotropic,
    /// Draine's generalisation of Henyey-Greenstein.
    Draine(Draine),
    /// A measured table, among them Petzold's average particle.
    Tabulated(Tabulated),
    /// A weighted sum of phase functions.
    Mixture(Mixture),
}

impl Phase {
    /// The model's name as scene files write it.
    pub fn name(&self) -> &'static str {
        match self {
            Phase::FournierForand(_) => "fournier-forand",
            Phase::HenyeyGreenstein(_) => "henyey-greenstein",
            Phase::Rayleigh(_) => "rayleigh",
            Phase::Isotropic => "isotropic",
            Phase::Draine(_) => "draine",
            Phase::Tabulated(table) if table.is_petzold() => "petzold",
            Phase::Tabulated(_) => "table",
            Phase::Mixture(_) => "mix",
        }
    }

    fn model(&self) -> &dyn PhaseFunction {
        match self {
            Phase::FournierForand(model) => model,
            Phase::HenyeyGreenstein(model) => model,
            Phase::Rayleigh(model) => model,
            Phase::Isotropic => &Isotropic,
            Phase::Draine(model) => model,
            Phase::Tabulated(model) => model,
            Phase::Mixture(model) => model,
        }
    }
}

impl PhaseFunction for Phase {
    fn value(&self, x: f64) -> f64 {
        self.model().value(x)
    }

    fn cdf(&self, x: f64) -> f64 {
        self.model().cdf(x)
    }

    fn ccdf(&self, x: f64) -> f64 {
        self.model().ccdf(x)
    }

    fn inverse_cdf(&self, u: f64) -> f64 {
        self.model().inverse_cdf(u)
    }

    fn inverse_ccdf(&self, v: f64) -> f64 {
        self.model().inverse_ccdf(v)
    }

    fn mean_cosine(&self) -> f64 {
        self.model().mean_cosine()
    }

    fn backscatter_fraction(&self) -> f64 {
        self.model().backscatter_fraction()
    }
}
