//! Phase functions as tables for the inner loop of a renderer.

mod cells;

use super::disk::FAR;
use super::{Phase, PhaseFunction, disk_mean};
pub use cells::CellParts;
use cells::{CellTable, Ends};

/// Smallest `x = sin²(θ/2)` of a [`PhaseTable`], 2^-120 (θ = 1.7e-18 rad): smaller angles are sampled
/// and evaluated as this one.
pub const X_MIN: f64 = 1.0 / (1u128 << 120) as f64;

/// Value and inverse CDF of a phase function as piecewise cubics, found by the bits of the argument.
///
/// Each table covers (0, 1) from both ends: the argument, or one minus it where that is smaller, is cut
/// into eighths of octaves, and these into as many equal cells as the wanted error needs.
/// There is no logarithm, power or exponential in a lookup.
///
/// Errors for analytic models, at any argument: value within 1e-5 of itself; `sample_x` within 1e-5
/// of `min(x, 1 - x)`, |ΔCDF| < 1e-6. A tabulated function has kinks: its value is within 1e-3 of
/// itself (or of a hundredth of the isotropic value), and where its density is 0 over an interval
/// |ΔCDF| < 1e-4. At most 256 KiB, usually less than 100.
#[derive(Clone, Debug)]
pub struct PhaseTable {
    value: CellTable,
    sample: CellTable,
}

/// Octaves of `u` below 1/2; smaller `u` than 2^-65 are taken as 2^-65.
const U_OCTAVES: u32 = 64;
/// Octaves of `x` below 1/2, down to [`X_MIN`].
const X_OCTAVES: u32 = 119;
/// Octaves of one minus the argument: its last bit in f64.
const COMPLEMENT_OCTAVES: u32 = 52;

/// Bytes for the value and for the sampling table.
const VALUE_BYTES: usize = 160 << 10;
const SAMPLE_BYTES: usize = 96 << 10;
/// Bytes for the mean over a disk.
const DISK_BYTES: usize = 160 << 10;

impl PhaseTable {
    /// Tabulates a phase function; takes a few hundredths of a second.
    pub fn new(phase: &Phase) -> Self {
        let value_ends = Ends {
            low_octaves: X_OCTAVES,
            high_octaves: COMPLEMENT_OCTAVES,
        };
        let sample_ends = Ends {
            low_octaves: U_OCTAVES,
            high_octaves: COMPLEMENT_OCTAVES,
        };
        // A millionth of the isotropic value is dark enough to be met absolutely.
        let floor = 1e-6 / (4.0 * std::f64::consts::PI);
        let value = CellTable::build(
            [&|x| phase.value(x), &|y| phase.value(1.0 - y)],
            value_ends,
            &|exact| 2e-6 * exact.max(floor),
            VALUE_BYTES,
            [0.0; 2],
        );
        let sample = CellTable::build(
            [&|u| phase.inverse_cdf(u), &|v| phase.inverse_ccdf(v)],
            sample_ends,
            &sample_tolerance,
            SAMPLE_BYTES,
            [0.0; 2],
        );
        Self { value, sample }
    }

    /// Phase function, 1/sr, >= 0, at `x = sin²(θ/2)`; `x` outside `[X_MIN, 1]` is taken as the nearest bound.
    #[inline]
    pub fn value(&self, x: f64) -> f64 {
        // A cubic may dip below 0 next to a row of 0 in a table.
        self.value.at(x).max(0.0)
    }

    /// `x = sin²(θ/2)` in `[X_MIN, 1]` with density `4π·value(x)`, for `u` uniform in (0, 1).
    #[inline]
    pub fn sample_x(&self, u: f64) -> f64 {
        self.sample.at(u).clamp(X_MIN, 1.0)
    }

    /// The tables of value and of inverse CDF, for lookups on another processor.
    pub fn parts(&self) -> [CellParts<'_>; 2] {
        [self.value.parts(), self.sample.parts()]
    }

    /// Memory of the tables, bytes.
    pub fn bytes(&self) -> usize {
        self.value.bytes() + self.sample.bytes()
    }
}

/// The mean of a phase function over a disk ([`disk_mean`]) up to 40 radii from its middle, as a table within 1e-3 of itself or of a
/// thousandth of the isotropic value.
#[derive(Clone, Debug)]
pub struct DiskTable {
    mean: CellTable,
    far_x: f64,
}

impl DiskTable {
    /// Tabulates the mean over a disk of half the apparent width `radius_rad`, below 0.02.
    pub fn new(phase: &Phase, radius_rad: f64) -> Self {
        // Nobody asks beyond 40 radii, where half a turn is far away.
        let ends = Ends {
            low_octaves: X_OCTAVES,
            high_octaves: 1,
        };
        let floor = 1e-3 / (4.0 * std::f64::consts::PI);
        let at = |radii: f64| (0.5 * radii * radius_rad).sin().powi(2);
        let mean = CellTable::build(
            [&|x| disk_mean(phase, radius_rad, x), &|_| 0.0],
            ends,
            &|exact| 3e-4 * exact.max(floor),
            DISK_BYTES,
            // About the rim.
            [0.1 * at(1.0), 4.0 * at(1.0)],
        );
        Self {
            mean,
            far_x: at(FAR),
        }
    }

    /// From where on the phase function itself is the mean, as `x = sin²(θ/2)`.
    pub fn far_x(&self) -> f64 {
        self.far_x
    }

    /// The mean, 1/sr, at an `x` of the disk's middle up to [`far_x`](Self::far_x).
    pub fn value(&self, x: f64) -> f64 {
        self.mean.at(x).max(0.0)
    }

    /// The table, for lookups on another processor.
    pub fn parts(&self) -> CellParts<'_> {
        self.mean.parts()
    }
}

/// A millionth of the distance to the nearer end, but not below the rounding of x.
/// Whatever lies well below [`X_MIN`] only has to stay there.
fn sample_tolerance(exact: f64) -> f64 {
    if exact < 0.5 * X_MIN {
        0.5 * X_MIN
    } else {
        1e-6 * exact.min(1.0 - exact) + 8.0 * f64::EPSILON * exact
    }
}
