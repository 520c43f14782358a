//! Veil, irradiance and spread in every water, from one set of paths.
//!
//! In homogeneous water what a path of light carries depends on absorption a and scattering b only through how often the
//! path scatters, k, and its length s: w · b^k · e^(-(a+b)s). Paths drawn once, with orders for a mixture of waters
//! (`orders`), therefore give the parts of an image that `estimate` makes ([`super`]) in any water, with exact
//! derivatives, at one exponential per path. They belong to a view of a target, to its lamps and to a phase function; the
//! random numbers are the same whatever the phase function is, so that values change smoothly with it.
//!
//! Lamps are points: the irradiance by the vehicle's disks of 2 cm differs by 0.05 % at 0.8 m. There is neither daylight nor
//! a water surface, and light that the target sends back and the water returns to it is missing: the irradiance is that of
//! a black target. Nothing ends at the target's edges.

mod bridge;
mod evaluate;
mod irradiance;
mod orders;
mod sight;
mod veil;

use rayon::prelude::*;
use uw_media::phase::PhaseTable;
use uw_render::prepare::PreparedLamp;

use super::fields::GROUPS;
use super::target_view::TargetView;
use evaluate::{Grouped, Paths, WaterAt, value};
use irradiance::Irradiance;
use orders::Orders;
use sight::{SightPaths, SightWalks};
use veil::Veil;

pub use evaluate::Value;

/// Streams of random numbers: of the walks to the target, and the first of those of each lamp.
const SIGHT_STREAM: u32 = 0x00e7_0000;
const LAMP_STREAMS: u32 = SIGHT_STREAM + 1;

/// Paths of one view, of its lamps at 100 %, and of one phase function.
#[derive(Clone, Debug)]
pub struct EveryWater {
    lamps: Vec<LampPaths>,
    sight: Grouped<SightPaths>,
}

#[derive(Clone, Debug)]
struct LampPaths {
    intensity: [f64; 3],
    irradiance: Grouped<Paths>,
    veil: Grouped<Paths>,
}

/// Means over the image in one water and channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InWater {
    /// Light that scattered and never met the target, W/(m² sr).
    pub veil: Value,
    /// Irradiance of the target over π, W/(m² sr).
    pub irradiance: Value,
    /// Share of camera rays that scatter before they meet the target and still meet it.
    pub share: Value,
}

impl EveryWater {
    /// Paths from `lamps` to what `view` sees, in water of `phase`: `paths` for each of veil, irradiance and share, shared
    /// among lamps and [`GROUPS`]; at least one each.
    pub fn new(
        view: &TargetView,
        lamps: &[PreparedLamp],
        phase: &PhaseTable,
        paths: u32,
        seed: u64,
    ) -> Self {
        let groups = GROUPS as u32;
        let walks_per_group = paths.div_ceil(groups).max(1);
        let drawn = paths.div_ceil(groups * lamps.len().max(1) as u32).max(1);
        let orders = Orders::new();
        let in_groups = |make: &(dyn Fn(u32) -> Paths + Sync), exact: Paths| Grouped {
            groups: (0..groups).into_par_iter().map(make).collect(),
            drawn,
            exact,
        };
        let of_lamp = |(stream, lamp): (u32, &PreparedLamp)| {
            let irradiance = Irradiance {
                view,
                lamp,
                phase,
                orders: &orders,
            };
            let veil = Veil {
                view,
                lamp,
                phase,
                orders: &orders,
            };
            LampPaths {
                intensity: lamp.intensity,
                irradiance: in_groups(
                    &|g| irradiance.scattered(seed, g, stream, drawn),
                    irradiance.straight(),
                ),
                veil: in_groups(
                    &|g| veil.paths(seed, g, stream + 1, drawn),
                    Paths::default(),
                ),
            }
        };
        let walks = SightWalks { view, phase };
        Self {
            lamps: (LAMP_STREAMS..)
                .step_by(2)
                .zip(lamps)
                .map(of_lamp)
                .collect(),
            sight: Grouped {
                groups: (0..groups)
                    .into_par_iter()
                    .map(|g| walks.walks(seed, g, SIGHT_STREAM, walks_per_group))
                    .collect(),
                drawn: walks_per_group,
                exact: Paths::default(),
            },
        }
    }

    /// Means over the image in water of absorption `a` >= 0 and scattering `b` >= 0, 1/m, in `channel` (0 to 2), which
    /// chooses the lamps' intensity.
    pub fn at(&self, a: f64, b: f64, channel: usize) -> InWater {
        let water = WaterAt::new(a, b);
        let of_lamps = |which: fn(&LampPaths) -> &Grouped<Paths>| {
            let lamps = self.lamps.iter();
            value(lamps.map(|l| (which(l), l.intensity[channel])), water)
        };
        InWater {
            veil: of_lamps(|lamp| &lamp.veil),
            irradiance: of_lamps(|lamp| &lamp.irradiance),
            share: value(std::iter::once((&self.sight, 1.0)), water),
        }
    }

    /// Contrast that the rays which scatter and reach the target leave of a texture at each of `frequencies`, cycles per
    /// metre, relative to frequency 0; the mean of both directions.
    pub fn transfer(&self, a: f64, b: f64, frequencies: &[f64]) -> Vec<f64> {
        let water = WaterAt::new(a, b);
        let mut waves = vec![0.0; frequencies.len()];
        let groups = self.sight.groups.iter();
        let total: f64 = groups
            .map(|group| group.add_waves(water, frequencies, &mut waves))
            .sum();
        let total = total.max(f64::MIN_POSITIVE);
        waves.iter().map(|wave| wave / total).collect()
    }
}
