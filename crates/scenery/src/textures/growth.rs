//! What grows on everything that stays in the sea.

use crate::colour::{Reflectance, mix, scale};
use crate::noise::unit;
use crate::tile::{Population, Tile, TilePoint, smoothstep};

const ROCK: Reflectance = [0.125, 0.113, 0.094];
const SILT: Reflectance = [0.205, 0.185, 0.145];
const TURF: Reflectance = [0.082, 0.078, 0.034];
const CORALLINE: Reflectance = [0.215, 0.125, 0.128];
const OCHRE: Reflectance = [0.235, 0.150, 0.058];
const SHELL: Reflectance = [0.430, 0.405, 0.350];

/// Rock or steel under turf, coralline crusts, sponges, tubes of worms and silt.
pub(super) fn encrusted(tile: &Tile, at: TilePoint) -> Reflectance {
    let moved = tile.warp(at, 0.30, 0.10, 500);
    let relief = tile.fbm(moved, 0.24, 5, 501);
    let grain = tile.fbm(at, 0.016, 3, 502);
    let mut colour = scale(ROCK, 1.0 + 0.8 * relief + 0.4 * grain);
    let crust = tile.fbm(moved, 0.20, 5, 503) + 0.35 * tile.fbm(at, 0.05, 2, 504);
    let pink = scale(CORALLINE, 1.0 + 0.35 * grain + 0.3 * relief);
    colour = mix(colour, pink, 0.75 * smoothstep(0.06, 0.16, crust));
    let turf = tile.fbm(moved, 0.42, 5, 505);
    let tuft = scale(TURF, 1.0 + 0.9 * grain + 0.5 * tile.fbm(at, 0.05, 3, 506));
    colour = mix(colour, tuft, 0.92 * smoothstep(-0.04, 0.16, turf));
    let sponge = tile.fbm(tile.warp(at, 0.2, 0.08, 507), 0.5, 4, 508);
    colour = mix(
        colour,
        scale(OCHRE, 1.0 + 0.4 * grain),
        0.85 * smoothstep(0.30, 0.36, sponge),
    );
    let dust = smoothstep(0.0, 0.5, tile.fbm(moved, 0.9, 4, 509));
    colour = mix(colour, scale(SILT, 1.0 + 0.3 * grain), 0.45 * dust);
    let shells = Population {
        spacing_m: 0.04,
        radius_m: [0.0025, 0.009],
        elongation: 1.4,
        salt: 510,
    };
    let colony = |c: TilePoint| 0.7 * smoothstep(0.05, 0.4, tile.fbm(c, 0.4, 3, 511));
    if let Some(shell) = tile.item(at, shells, colony) {
        let rim = smoothstep(0.3, 0.55, shell.r);
        let pale = scale(SHELL, 0.55 + 0.45 * unit(shell.bits, 9));
        colour = mix(scale(colour, 0.35), pale, rim);
    }
    let pit = smoothstep(0.86, 0.98, tile.ridged(moved, 0.30, 3, 512));
    scale(colour, 1.0 - 0.7 * pit)
}

/// A pale living skin, to be coloured by what it is multiplied with.
pub(super) fn polyps(tile: &Tile, at: TilePoint) -> Reflectance {
    let cell = tile.cellular(tile.warp(at, 0.05, 0.006, 520), 0.013, 521);
    let mouth = smoothstep(0.10, 0.28, cell.nearest);
    let wall = smoothstep(0.02, 0.20, cell.second - cell.nearest);
    let broad = tile.fbm(at, 0.40, 5, 522);
    let fine = tile.fbm(at, 0.05, 3, 523);
    let tone =
        0.46 * (1.0 + 0.45 * broad + 0.30 * fine) * (0.72 + 0.28 * mouth) * (0.80 + 0.20 * wall);
    let warm = 0.10 * tile.fbm(at, 0.7, 3, 524);
    [tone * (1.0 + warm), tone, tone * (1.0 - warm)]
}
