//! Ship hulls: red antifouling paint that peels, and black paint that has fouled.

use crate::colour::{Reflectance, mix, scale};
use crate::noise::{hash, unit};
use crate::tile::{Item, Population, Tile, TilePoint, smoothstep, wave};

const RED_PAINT: Reflectance = [0.300, 0.052, 0.042];
const BLEACHED_RED: Reflectance = [0.345, 0.085, 0.068];
const BLACK_PAINT: Reflectance = [0.040, 0.042, 0.045];
const PRIMER: Reflectance = [0.285, 0.295, 0.290];
const BARE_STEEL: Reflectance = [0.115, 0.088, 0.074];
const RUST: Reflectance = [0.190, 0.075, 0.034];
const SLIME: Reflectance = [0.105, 0.090, 0.042];
const WEED: Reflectance = [0.050, 0.082, 0.033];
const BARNACLE: Reflectance = [0.480, 0.455, 0.390];

/// Where the hull plates of a tile meet. Seams run along x at the middle of each strake height,
/// butts run along y between two seams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plating {
    /// Distance between seams, m.
    pub strake_m: f32,
    /// Distance between butts of one strake, m.
    pub plate_m: f32,
    seed: u32,
}

/// Nominal strake height and plate length, m; rounded so that the tile holds a whole number.
const STRAKE_M: f32 = 2.0;
const PLATE_M: f32 = 3.0;

/// Half the width of a weld bead, m.
const BEAD_HALF_WIDTH_M: f32 = 0.007;

/// The plates of a tile.
pub fn plating(tile: &Tile) -> Plating {
    Plating {
        strake_m: tile.size_m / tile.count(STRAKE_M) as f32,
        plate_m: tile.size_m / tile.count(PLATE_M) as f32,
        seed: tile.seed,
    }
}

impl Plating {
    /// Signed distance to the nearest seam, m, positive below it.
    pub fn from_seam_m(&self, y_m: f32) -> f32 {
        let rows = y_m / self.strake_m;
        (rows - rows.floor() - 0.5) * self.strake_m
    }

    /// Signed distance to the nearest butt of the strake that `at` lies in, m, positive to its right.
    pub fn from_butt_m(&self, tile: &Tile, at: TilePoint) -> f32 {
        // A strake lies between two seams, which are half a strake off the multiples of its height.
        let strakes = tile.count(STRAKE_M);
        let strake = ((at[1] / self.strake_m + 0.5).floor() as i32).rem_euclid(strakes as i32);
        // The remainder is not negative.
        let shift = unit(hash(strake as u32, 7, self.seed), 1);
        let columns = at[0] / self.plate_m + shift;
        (columns - columns.floor() - 0.5) * self.plate_m
    }
}

/// Red antifouling paint.
pub(super) fn red(tile: &Tile, at: TilePoint) -> Reflectance {
    let plates = plating(tile);
    let below_seam_m = plates.from_seam_m(at[1]);
    let beside_butt_m = plates.from_butt_m(tile, at);
    let mut colour = rolled_paint(tile, at, RED_PAINT, BLEACHED_RED);
    colour = mix(
        colour,
        SLIME,
        0.30 * smoothstep(0.05, 0.55, tile.fbm(at, 1.2, 4, 20)),
    );
    colour = rust_streaks(tile, at, colour, below_seam_m);
    colour = weld_bead(tile, at, colour, below_seam_m, beside_butt_m);
    colour = peeling(
        tile,
        at,
        colour,
        below_seam_m.abs().min(beside_butt_m.abs()),
    );
    colour = fouling_specks(tile, at, colour);
    let barnacles = Population {
        spacing_m: 0.05,
        radius_m: [0.004, 0.011],
        elongation: 1.25,
        salt: 40,
    };
    let cluster = |centre: TilePoint| 0.5 * smoothstep(0.30, 0.55, tile.fbm(centre, 0.8, 2, 41));
    with_barnacle(colour, tile.item(at, barnacles, cluster))
}

/// Paint laid on with a roller: strokes along the hull, stipple, slow bleaching.
fn rolled_paint(
    tile: &Tile,
    at: TilePoint,
    fresh: Reflectance,
    bleached: Reflectance,
) -> Reflectance {
    let bleach = 0.5 + 0.9 * tile.fbm(at, 1.6, 3, 1);
    let stroke = tile.streaks(at, [0.22, 0.018], 2, 2);
    let stipple = tile.fbm(at, 0.016, 2, 3);
    let runs = tile.streaks(at, [0.05, 0.6], 2, 4);
    scale(
        mix(fresh, bleached, bleach),
        1.0 + 0.07 * stroke + 0.24 * stipple + 0.05 * runs,
    )
}

/// Rust that water has carried down from the seams.
fn rust_streaks(tile: &Tile, at: TilePoint, under: Reflectance, below_seam_m: f32) -> Reflectance {
    let source = smoothstep(-0.08, 0.42, tile.streaks(at, [0.8, 3.0], 2, 10));
    let thread = smoothstep(-0.15, 0.45, tile.streaks(at, [0.05, 1.2], 3, 11));
    let reach_m = 0.25 + 0.75 * source;
    let fall = smoothstep(-0.015, 0.0, below_seam_m) * smoothstep(reach_m, 0.0, below_seam_m);
    mix(under, RUST, 0.9 * source * thread * fall)
}

/// The raised bead along seams and butts, seen by its ripples and the dirt at its toes.
fn weld_bead(
    tile: &Tile,
    at: TilePoint,
    under: Reflectance,
    below_seam_m: f32,
    beside_butt_m: f32,
) -> Reflectance {
    let along_seam = below_seam_m.abs() < beside_butt_m.abs();
    let (across_m, along_m) = if along_seam {
        (below_seam_m.abs(), at[0])
    } else {
        (beside_butt_m.abs(), at[1])
    };
    let across_m = across_m + 0.002 * tile.fbm(at, 0.06, 2, 14);
    let ripples_per_tile = tile.count(0.012) as f32;
    let ripple = wave(along_m / tile.size_m * ripples_per_tile);
    let bead = smoothstep(BEAD_HALF_WIDTH_M, 0.5 * BEAD_HALF_WIDTH_M, across_m);
    let toe = smoothstep(0.016, BEAD_HALF_WIDTH_M, across_m) * (1.0 - bead);
    scale(under, 1.0 + bead * (0.10 + 0.10 * ripple) - 0.28 * toe)
}

/// Paint that has come off: grey primer, and in the middle of large patches bare, rusting steel.
fn peeling(tile: &Tile, at: TilePoint, under: Reflectance, to_joint_m: f32) -> Reflectance {
    let moved = tile.warp(at, 0.16, 0.05, 50);
    let near_joint = 0.10 * smoothstep(0.30, 0.0, to_joint_m);
    let region = 0.30 * tile.fbm(at, 2.0, 2, 51);
    let loss =
        tile.fbm(moved, 0.55, 5, 52) + near_joint + region + 0.045 * tile.fbm(at, 0.022, 2, 57);
    let patch = smoothstep(0.435, 0.443, loss);
    let steel = smoothstep(0.53, 0.57, loss + 0.06 * tile.fbm(at, 0.05, 2, 53));
    // The rim of the remaining paint lifts: pale edge outside the patch, shadow inside it.
    let rim = smoothstep(0.405, 0.43, loss) * (1.0 - patch);
    let shadow = patch * smoothstep(0.47, 0.443, loss);
    let grain = 1.0 + 0.10 * tile.fbm(at, 0.02, 3, 54);
    let stain = mix(
        PRIMER,
        RUST,
        0.8 * smoothstep(0.05, 0.5, tile.fbm(at, 0.12, 3, 55)),
    );
    let rough_steel = mix(BARE_STEEL, RUST, 0.5 + tile.fbm(at, 0.03, 3, 56));
    let exposed = scale(
        mix(stain, rough_steel, steel),
        grain * (1.0 - 0.45 * shadow),
    );
    mix(scale(under, 1.0 + 0.22 * rim), exposed, patch)
}

/// Young growth, a few millimetres across.
fn fouling_specks(tile: &Tile, at: TilePoint, under: Reflectance) -> Reflectance {
    let specks = Population {
        spacing_m: 0.022,
        radius_m: [0.0015, 0.005],
        elongation: 1.8,
        salt: 30,
    };
    let chance =
        |centre: TilePoint| 0.10 + 0.35 * smoothstep(0.0, 0.6, tile.fbm(centre, 0.5, 2, 31));
    match tile.item(at, specks, chance) {
        Some(speck) => {
            let pale = unit(speck.bits, 9) < 0.3;
            let growth = if pale {
                scale(PRIMER, 1.2)
            } else {
                scale(SLIME, 0.7)
            };
            mix(under, growth, 0.55 * smoothstep(1.0, 0.6, speck.r))
        }
        None => under,
    }
}

/// A barnacle over what lies under it: dark opening, pale ribbed cone, shadow at its foot.
fn with_barnacle(under: Reflectance, item: Option<Item>) -> Reflectance {
    let Some(barnacle) = item else { return under };
    let tint = 0.75 + 0.45 * unit(barnacle.bits, 9);
    // Ribs between the plates: the slope of the place as seen from the top.
    let slope = barnacle.local[0] / (barnacle.local[1].abs() + 0.15);
    let ribs = 1.0 + 0.16 * wave(slope * 1.3 + unit(barnacle.bits, 10));
    let cone = mix(
        scale(BARNACLE, tint * ribs),
        scale(BARNACLE, 0.12),
        smoothstep(0.34, 0.22, barnacle.r),
    );
    mix(scale(under, 0.6), cone, smoothstep(0.95, 0.82, barnacle.r))
}

/// Black antifouling paint that has lost its effect.
pub(super) fn black_fouled(tile: &Tile, at: TilePoint) -> Reflectance {
    let plates = plating(tile);
    let below_seam_m = plates.from_seam_m(at[1]);
    let mut colour = rolled_paint(tile, at, BLACK_PAINT, [0.070, 0.072, 0.075]);
    colour = weld_bead(tile, at, colour, below_seam_m, plates.from_butt_m(tile, at));
    let film = smoothstep(
        -0.30,
        0.45,
        tile.fbm(tile.warp(at, 0.3, 0.1, 60), 0.7, 5, 61),
    );
    let mottled = scale(SLIME, 1.0 + 0.5 * tile.fbm(at, 0.03, 3, 62));
    colour = mix(colour, mottled, 0.8 * film);
    let tufts = tile.fbm(at, 0.5, 3, 63) + 0.45 * tile.streaks(at, [0.012, 0.09], 3, 64);
    colour = mix(
        colour,
        scale(WEED, 1.0 + 0.5 * tile.streaks(at, [0.008, 0.07], 2, 65)),
        smoothstep(0.22, 0.36, tufts),
    );
    for (spacing_m, radius_m, salt) in [(0.030, [0.004, 0.010], 70), (0.055, [0.008, 0.021], 72)] {
        let barnacles = Population {
            spacing_m,
            radius_m,
            elongation: 1.3,
            salt,
        };
        let cluster =
            |centre: TilePoint| 0.06 + 0.85 * smoothstep(0.02, 0.38, tile.fbm(centre, 0.6, 3, 71));
        colour = with_barnacle(colour, tile.item(at, barnacles, cluster));
    }
    colour
}
