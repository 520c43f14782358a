//! A square of surface, in metres, on which patterns are laid out so that they repeat without a seam.

use super::noise::{Cellular, NoiseLattice, direction, hash, unit};

/// A place on the tile, m: x to the right and y downwards from the upper left corner.
pub type TilePoint = [f32; 2];

/// A square tile of surface; everything laid on it repeats with its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// Edge length, m, > 0.
    pub size_m: f32,
    /// Seed of everything random on the tile.
    pub seed: u32,
}

/// A random population of separate items such as pebbles or barnacles, at most one per lattice cell.
#[derive(Clone, Copy, Debug)]
pub struct Population {
    /// Size of a lattice cell, m. `radius_m[1] · elongation` must not exceed it.
    pub spacing_m: f32,
    /// Smallest and largest radius (half the shorter axis), m.
    pub radius_m: [f32; 2],
    /// Largest ratio of the longer to the shorter axis, >= 1.
    pub elongation: f32,
    /// Tells this population from others on the same tile.
    pub salt: u32,
}

/// The item of a population that covers a place.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The place in the item's own frame, in units of its half axes: inside where x² + y² < 1.
    pub local: [f32; 2],
    /// Distance from the centre in units of the half axes, in [0, 1).
    pub r: f32,
    /// Half the shorter axis, m.
    pub radius_m: f32,
    /// Random bits of the item.
    pub bits: u32,
}

impl Tile {
    /// How often a feature of about this size fits on the tile; at least once.
    pub fn count(&self, feature_m: f32) -> u32 {
        // The quotient is positive and far below 2³², the cast cannot wrap.
        (self.size_m / feature_m).round().max(1.0) as u32
    }

    fn lattice(&self, feature_m: [f32; 2], salt: u32) -> NoiseLattice {
        NoiseLattice {
            cells: feature_m.map(|m| self.count(m)),
            seed: hash(salt, 1, self.seed),
        }
    }

    fn uv(&self, [x, y]: TilePoint) -> [f32; 2] {
        [x / self.size_m, y / self.size_m]
    }

    /// Fractal noise in [-1, 1] whose coarsest features measure `feature_m`.
    pub fn fbm(&self, at: TilePoint, feature_m: f32, octaves: u32, salt: u32) -> f32 {
        self.streaks(at, [feature_m; 2], octaves, salt)
    }

    /// Fractal noise in [-1, 1] drawn out: features measure `feature_m` along (x, y).
    pub fn streaks(&self, at: TilePoint, feature_m: [f32; 2], octaves: u32, salt: u32) -> f32 {
        self.lattice(feature_m, salt).fbm(self.uv(at), octaves)
    }

    /// Ridged fractal noise in [0, 1], 1 on crooked lines `feature_m` apart.
    pub fn ridged(&self, at: TilePoint, feature_m: f32, octaves: u32, salt: u32) -> f32 {
        self.lattice([feature_m; 2], salt)
            .ridged(self.uv(at), octaves)
    }

    /// Cellular noise with cells of about `feature_m`.
    pub fn cellular(&self, at: TilePoint, feature_m: f32, salt: u32) -> Cellular {
        self.lattice([feature_m; 2], salt).cellular(self.uv(at))
    }

    /// The place moved by up to `amplitude_m` by noise with features of `feature_m`.
    pub fn warp(&self, at: TilePoint, feature_m: f32, amplitude_m: f32, salt: u32) -> TilePoint {
        [
            at[0] + amplitude_m * self.fbm(at, feature_m, 2, salt),
            at[1] + amplitude_m * self.fbm(at, feature_m, 2, salt ^ 0x5bd1),
        ]
    }

    /// The uppermost item that covers `at`, if any. `chance` gives the probability that an item
    /// exists, from the place of its centre.
    pub fn item(
        &self,
        at: TilePoint,
        population: Population,
        chance: impl Fn(TilePoint) -> f32,
    ) -> Option<Item> {
        let lattice = self.lattice([population.spacing_m; 2], population.salt);
        let ([column, row], inside) = lattice.locate(self.uv(at));
        let cell_m = self.size_m / lattice.cells[0] as f32;
        let mut top: Option<Item> = None;
        for j in -1..=1 {
            for i in -1..=1 {
                let bits = lattice.bits(column + i, row + j);
                let offset_m = [
                    (inside[0] - i as f32 - unit(bits, 1)) * cell_m,
                    (inside[1] - j as f32 - unit(bits, 2)) * cell_m,
                ];
                if top.is_some_and(|item| item.bits >= bits) {
                    continue;
                }
                let Some(item) = population.covering(offset_m, bits) else {
                    continue;
                };
                if unit(bits, 6) < chance([at[0] - offset_m[0], at[1] - offset_m[1]]) {
                    top = Some(item);
                }
            }
        }
        top
    }
}

impl Population {
    /// The item as seen at `offset_m` from its centre, if it reaches that far.
    fn covering(&self, offset_m: [f32; 2], bits: u32) -> Option<Item> {
        // The square makes small items more frequent than large ones.
        let size = unit(bits, 3) * unit(bits, 3);
        let radius_m = self.radius_m[0] + (self.radius_m[1] - self.radius_m[0]) * size;
        let longer_m = radius_m * (1.0 + (self.elongation - 1.0) * unit(bits, 4));
        let squared = offset_m[0] * offset_m[0] + offset_m[1] * offset_m[1];
        if squared >= longer_m * longer_m {
            return None;
        }
        let [dx, dy] = direction(bits);
        let local = [
            (offset_m[0] * dx + offset_m[1] * dy) / longer_m,
            (offset_m[1] * dx - offset_m[0] * dy) / radius_m,
        ];
        let r = (local[0] * local[0] + local[1] * local[1]).sqrt();
        (r < 1.0).then_some(Item {
            local,
            r,
            radius_m,
            bits,
        })
    }
}

/// A smooth wave of period 1 in [-1, 1], close to a cosine: 1 at whole numbers, -1 halfway.
pub fn wave(phase: f32) -> f32 {
    let t = (phase - phase.floor() - 0.5).abs() * 2.0;
    2.0 * smoothstep(0.0, 1.0, t) - 1.0
}

/// Hermite step: 0 below `from`, 1 above `to`; also falling, where `from > to`.
pub fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILE: Tile = Tile {
        size_m: 2.0,
        seed: 4,
    };
    const PEBBLES: Population = Population {
        spacing_m: 0.1,
        radius_m: [0.01, 0.05],
        elongation: 2.0,
        salt: 8,
    };

    fn grid() -> impl Iterator<Item = TilePoint> {
        (0..200).flat_map(|j| (0..200).map(move |i| [i as f32 * 0.01, j as f32 * 0.01]))
    }

    #[test]
    fn items_repeat_with_the_tile_and_cover_what_they_should() {
        let covered = grid()
            .filter(|&at| TILE.item(at, PEBBLES, |_| 1.0).is_some())
            .count();
        let rarely = grid()
            .filter(|&at| TILE.item(at, PEBBLES, |_| 0.2).is_some())
            .count();
        assert!((8_000..24_000).contains(&covered), "{covered}");
        assert!(
            rarely > 1_000 && 2 * rarely < covered,
            "{rarely} of {covered}"
        );
        for at in grid().step_by(7) {
            let here = TILE.item(at, PEBBLES, |_| 1.0);
            let there = TILE.item([at[0] + 2.0, at[1] + 2.0], PEBBLES, |_| 1.0);
            // Rounding may move a place across an outline, so only places well inside are compared.
            if here.is_some_and(|item| item.r < 0.95) {
                assert!(there.is_some());
            }
        }
    }

    #[test]
    fn wave_and_step_meet_their_ends() {
        assert_eq!((wave(0.0), wave(0.5), wave(-3.0)), (1.0, -1.0, 1.0));
        assert_eq!(
            (smoothstep(1.0, 2.0, 0.0), smoothstep(2.0, 1.0, 0.0)),
            (0.0, 1.0)
        );
    }
}
