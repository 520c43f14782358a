//! The flakes: a Poisson cloud without end in the water's own frame, made cell by cell from hashed numbers, so that a flake is
//! where it was when the camera comes back.

use glam::DVec3;

use crate::sampling::Rng;
use crate::scene::Snow;

/// Mean number of flakes in a cell.
const PER_CELL: f64 = 8.0;
/// Difference of the slope from 1 below which sizes follow its limit there.
const FLAT: f64 = 1e-9;

/// A flake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flake {
    /// Place in the world when the shutter opens, m.
    pub position_m: DVec3,
    /// Diameter, m.
    pub diameter_m: f64,
    /// Random number of its own.
    pub key: u32,
}

/// All flakes of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Cloud {
    seed: u64,
    /// Edge of a cell, m.
    pub(super) edge_m: f64,
    /// By how much the water's frame has moved, m.
    pub(super) drifted_m: DVec3,
    sizes: Sizes,
}

/// Diameters with a density of d to the power of -slope between two bounds.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    smallest_m: f64,
    /// Largest over smallest.
    span: f64,
    slope: f64,
}

impl Cloud {
    /// The cloud of `snow` at its time.
    pub fn new(snow: &Snow) -> Self {
        let [smallest_m, largest_m] = snow.diameter_m;
        Self {
            seed: u64::from(snow.seed),
            edge_m: (PER_CELL / snow.per_m3).cbrt(),
            drifted_m: snow.time_s * snow.drift_m_s,
            sizes: Sizes {
                smallest_m,
                span: largest_m / smallest_m,
                slope: snow.slope,
            },
        }
    }

    /// Mean square of the diameters, m².
    pub fn mean_square_m2(&self) -> f64 {
        self.sizes.smallest_m.powi(2) * self.sizes.moment(2.0) / self.sizes.moment(0.0)
    }

    /// Flakes between two corners of a box in the world, m.
    pub fn flakes_between(&self, lower: DVec3, upper: DVec3) -> Vec<Flake> {
        let [from, to] = [lower, upper].map(|corner| self.cell_of(corner));
        let mut found = Vec::new();
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    self.for_flakes_of([x, y, z], |flake| {
                        let inside = flake.position_m.cmpge(lower) & flake.position_m.cmplt(upper);
                        if inside.all() {
                            found.push(flake);
                        }
                    });
                }
            }
        }
        found
    }

    /// The cell that holds a point of the world.
    pub(super) fn cell_of(&self, point_m: DVec3) -> [i64; 3] {
        ((point_m - self.drifted_m) / self.edge_m)
            .floor()
            .to_array()
            .map(|index| index as i64)
    }

    /// Middle of a cell in the world, m.
    pub(super) fn middle_of(&self, cell: [i64; 3]) -> DVec3 {
        self.drifted_m + self.edge_m * (DVec3::from_array(cell.map(|index| index as f64)) + 0.5)
    }

    /// All flakes of a cell.
    pub(super) fn for_flakes_of(&self, cell: [i64; 3], mut take: impl FnMut(Flake)) {
        let [x, y, z] = cell.map(folded);
        let mut rng = Rng::new(self.seed, x, y, z);
        let lower = DVec3::from_array(cell.map(|index| index as f64));
        for _ in 0..poisson(&mut rng) {
            let within = DVec3::new(rng.uniform(), rng.uniform(), rng.uniform());
            take(Flake {
                position_m: self.drifted_m + self.edge_m * (lower + within),
                diameter_m: self.sizes.at(rng.uniform()),
                key: rng.bits(),
            });
        }
    }
}

impl Sizes {
    /// Mean over a power of minus the slope of x^`power`, x from 1 to the span, but for the power's own sum.
    fn moment(&self, power: f64) -> f64 {
        let exponent = power + 1.0 - self.slope;
        if self.span == 1.0 {
            return 1.0;
        }
        if exponent.abs() < FLAT {
            return self.span.ln();
        }
        (self.span.powf(exponent) - 1.0) / exponent
    }

    /// Diameter at a share of the flakes, m.
    fn at(&self, share: f64) -> f64 {
        let exponent = 1.0 - self.slope;
        let relative = if exponent.abs() < FLAT {
            self.span.powf(share)
        } else {
            let whole = self.span.powf(exponent) - 1.0;
            (1.0 + share * whole).powf(1.0 / exponent)
        };
        self.smallest_m * relative.clamp(1.0, self.span)
    }
}

/// A number of flakes in a cell.
fn poisson(rng: &mut Rng) -> u32 {
    let mut product = rng.uniform();
    let mut count = 0;
    while product > (-PER_CELL).exp() {
        product *= rng.uniform();
        count += 1;
    }
    count
}

/// An index of a cell in 32 bits.
fn folded(index: i64) -> u32 {
    let (low, high) = (index as u32, (index >> 32) as u32);
    low ^ high.wrapping_mul(0x9e37_79b9)
}
