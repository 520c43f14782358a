//! Bottoms of loose material: rippled sand, gravel, silt under kelp.

use crate::colour::{Reflectance, mix, scale};
use crate::noise::unit;
use crate::tile::{Item, Population, Tile, TilePoint, smoothstep, wave};

const SAND: Reflectance = [0.335, 0.275, 0.190];
const PALE_SAND: Reflectance = [0.450, 0.390, 0.290];
const DETRITUS: Reflectance = [0.120, 0.098, 0.062];
const SILT: Reflectance = [0.190, 0.165, 0.120];
const ALGAE: Reflectance = [0.046, 0.058, 0.031];
const ALGAE_TIP: Reflectance = [0.135, 0.140, 0.050];
const CORALLINE: Reflectance = [0.330, 0.150, 0.190];
const SHELL: Reflectance = [0.620, 0.560, 0.480];
const KELP: Reflectance = [0.110, 0.078, 0.032];

/// Colours of stones: granite, basalt, quartz, sandstone, greenstone, slate.
const STONES: [Reflectance; 6] = [
    [0.250, 0.235, 0.220],
    [0.070, 0.070, 0.074],
    [0.540, 0.510, 0.460],
    [0.300, 0.195, 0.125],
    [0.130, 0.150, 0.115],
    [0.150, 0.155, 0.170],
];

/// Nominal distance between ripple crests, m.
const RIPPLE_M: f32 = 0.24;

/// Height of the sand ripples relative to half their range, in [-1, 1]; 1 on the crests.
pub fn ripple_height(tile: &Tile, at: TilePoint) -> f32 {
    let [x, y] = tile.warp(at, 0.9, 0.16, 80);
    // Whole numbers of waves along both edges keep the tile seamless.
    let across = tile.count(RIPPLE_M) as f32;
    let along = tile.count(tile.size_m / 5.0) as f32;
    let phase = (x * across + y * along) / tile.size_m;
    // Skewed, as ripples under a current are.
    wave(phase + 0.10 * wave(phase + 0.25))
}

/// Rippled sand, pebbles of all sizes, shells, algae.
pub(super) fn seabed(tile: &Tile, at: TilePoint) -> Reflectance {
    let mut colour = sand(tile, at);
    colour = burrows(tile, at, colour);
    let stony = |centre: TilePoint| smoothstep(-0.35, 0.40, tile.fbm(centre, 1.4, 3, 90));
    for (spacing_m, radius_m, share, salt) in [
        (0.016, [0.0025, 0.0065], 0.45, 91),
        (0.030, [0.004, 0.012], 0.60, 92),
        (0.085, [0.010, 0.032], 0.55, 93),
        (0.260, [0.030, 0.095], 0.50, 94),
    ] {
        let stones = Population {
            spacing_m,
            radius_m,
            elongation: 1.8,
            salt,
        };
        colour = with_stone(
            tile,
            at,
            colour,
            tile.item(at, stones, |c| share * (0.15 + 0.85 * stony(c))),
        );
    }
    for (spacing_m, radius_m, salt) in [(0.05, [0.004, 0.011], 95), (0.16, [0.010, 0.026], 96)] {
        let shells = Population {
            spacing_m,
            radius_m,
            elongation: 1.3,
            salt,
        };
        colour = with_shell(colour, tile.item(at, shells, |c| 0.12 + 0.25 * stony(c)));
    }
    algae(tile, at, colour)
}

/// Sand: grains of several minerals, pale crests, dark organic matter in the troughs.
pub(super) fn sand(tile: &Tile, at: TilePoint) -> Reflectance {
    let grain = tile.cellular(at, 0.007, 81);
    let mineral = match unit(grain.bits, 9) {
        u if u < 0.12 => scale(SAND, 0.45),
        u if u < 0.30 => PALE_SAND,
        u if u < 0.34 => scale(SHELL, 0.95),
        _ => SAND,
    };
    let coarse = scale(
        mix(SAND, mineral, 0.35),
        1.0 + 0.20 * tile.fbm(at, 0.03, 3, 82),
    );
    let height = ripple_height(tile, at) + 0.5 * tile.fbm(at, 0.08, 3, 83);
    let shaped = mix(coarse, PALE_SAND, 0.40 * smoothstep(0.2, 1.1, height));
    let litter =
        smoothstep(-0.35, -1.05, height) * smoothstep(-0.5, 0.3, tile.fbm(at, 0.05, 3, 84));
    let broad = 1.0 + 0.35 * tile.fbm(at, 1.8, 4, 85);
    scale(mix(shaped, DETRITUS, 0.75 * litter), broad)
}

/// Holes of burrowing animals in little mounds of pale sand.
fn burrows(tile: &Tile, at: TilePoint, under: Reflectance) -> Reflectance {
    let burrows = Population {
        spacing_m: 0.30,
        radius_m: [0.015, 0.045],
        elongation: 1.2,
        salt: 86,
    };
    match tile.item(at, burrows, |_| 0.30) {
        Some(hole) => {
            let mound = mix(
                under,
                scale(PALE_SAND, 1.05),
                0.7 * smoothstep(1.0, 0.5, hole.r),
            );
            mix(mound, scale(DETRITUS, 0.45), smoothstep(0.34, 0.24, hole.r))
        }
        None => under,
    }
}

/// A stone over what lies under it, speckled, veined or overgrown, with sand and shade at its foot.
fn with_stone(tile: &Tile, at: TilePoint, under: Reflectance, item: Option<Item>) -> Reflectance {
    let Some(stone) = item else { return under };
    let kind = STONES[(unit(stone.bits, 9) * STONES.len() as f32) as usize];
    let outline = 1.0
        + 0.16
            * tile.fbm(
                at,
                1.3 * stone.radius_m.max(0.004),
                2,
                100 ^ (stone.bits & 3),
            );
    let r = stone.r * outline.max(0.5) + 0.06;
    let speckle = tile.fbm(at, 0.012, 2, 101);
    let mottle = tile.fbm(at, (0.7 * stone.radius_m).max(0.01), 3, 102);
    let tint = 0.7 + 0.6 * unit(stone.bits, 10);
    let mut face = scale(kind, tint * (1.0 + 0.22 * speckle + 0.40 * mottle));
    if unit(stone.bits, 11) < 0.3 {
        let band = wave(stone.local[1] * (1.0 + 2.0 * unit(stone.bits, 12)) + 0.4 * mottle);
        face = mix(
            face,
            scale(STONES[2], 0.9),
            0.6 * smoothstep(0.75, 0.95, band),
        );
    }
    if unit(stone.bits, 13) < 0.25 {
        face = mix(face, CORALLINE, 0.85 * smoothstep(-0.1, 0.15, mottle));
    }
    // The upper left faces the sky a little more than the lower right.
    face = scale(
        face,
        1.0 - 0.35 * smoothstep(0.45, 1.0, r) - 0.08 * stone.local[1],
    );
    mix(scale(under, 0.55), face, smoothstep(1.0, 0.90, r))
}

/// A scallop-like shell with fan ribs and growth rings.
fn with_shell(under: Reflectance, item: Option<Item>) -> Reflectance {
    let Some(shell) = item else { return under };
    let [x, y] = shell.local;
    // The hinge lies at the lower end of the long axis; ribs fan out from it.
    let fan = y / (x + 1.15);
    let ribs = wave(fan * 6.0);
    let from_hinge = ((x + 1.0) * (x + 1.0) + y * y).sqrt();
    let rings = wave(from_hinge * 2.5);
    let warm = unit(shell.bits, 9);
    let body = mix(SHELL, [0.50, 0.29, 0.20], 0.8 * warm * warm);
    let face = scale(
        body,
        1.0 + 0.20 * ribs + 0.08 * rings - 0.25 * smoothstep(0.5, 0.0, from_hinge),
    );
    mix(scale(under, 0.5), face, smoothstep(0.98, 0.88, shell.r))
}

/// Patches of turf algae with frayed edges.
fn algae(tile: &Tile, at: TilePoint, under: Reflectance) -> Reflectance {
    let moved = tile.warp(at, 0.10, 0.03, 110);
    let cover = tile.fbm(moved, 0.75, 4, 111) + 0.28 * (tile.ridged(at, 0.05, 3, 112) - 0.6);
    let strand = tile.ridged(tile.warp(at, 0.06, 0.02, 113), 0.022, 2, 114);
    let clump = tile.fbm(at, 0.06, 3, 116);
    let turf = scale(
        mix(
            ALGAE,
            ALGAE_TIP,
            smoothstep(0.55, 0.95, strand) * (0.5 + clump),
        ),
        1.0 + 0.5 * clump,
    );
    mix(under, turf, 0.92 * smoothstep(0.20, 0.27, cover))
}

/// Densely packed stones with finer ones in between.
pub(super) fn gravel(tile: &Tile, at: TilePoint) -> Reflectance {
    let mut colour = scale(mix(DETRITUS, SAND, 0.5 + tile.fbm(at, 0.012, 3, 120)), 0.7);
    for (spacing_m, radius_m, share, salt) in [
        (0.010, [0.003, 0.0055], 0.90, 121),
        (0.022, [0.006, 0.012], 0.80, 122),
        (0.045, [0.012, 0.024], 0.70, 123),
        (0.090, [0.022, 0.044], 0.45, 124),
    ] {
        let stones = Population {
            spacing_m,
            radius_m,
            elongation: 1.8,
            salt,
        };
        colour = with_stone(tile, at, colour, tile.item(at, stones, |_| share));
    }
    scale(colour, 1.0 + 0.15 * tile.fbm(at, 0.9, 3, 125))
}

/// Silt with trails, flocks and kelp blades that have drifted in.
pub(super) fn kelp_sediment(tile: &Tile, at: TilePoint) -> Reflectance {
    let flock = tile.fbm(at, 0.05, 4, 130);
    let stipple = tile.fbm(at, 0.012, 2, 131);
    let trail = smoothstep(
        0.93,
        0.99,
        tile.ridged(tile.warp(at, 0.5, 0.2, 132), 0.55, 1, 133),
    );
    let broad = 1.0 + 0.25 * tile.fbm(at, 1.2, 3, 134);
    let mut colour = scale(
        mix(SILT, DETRITUS, 0.6 * trail),
        broad * (1.0 + 0.18 * flock + 0.12 * stipple),
    );
    let debris = Population {
        spacing_m: 0.05,
        radius_m: [0.002, 0.006],
        elongation: 5.0,
        salt: 135,
    };
    if let Some(scrap) = tile.item(at, debris, |_| 0.4) {
        colour = mix(
            colour,
            scale(KELP, 0.6 + unit(scrap.bits, 9)),
            smoothstep(1.0, 0.7, scrap.r),
        );
    }
    let drifted = |centre: TilePoint| smoothstep(-0.35, 0.30, tile.fbm(centre, 1.1, 2, 137));
    for (spacing_m, radius_m, elongation, salt) in [
        (0.20, [0.010, 0.022], 8.0, 138),
        (0.45, [0.022, 0.050], 8.5, 139),
    ] {
        let blades = Population {
            spacing_m,
            radius_m,
            elongation,
            salt,
        };
        let bent = tile.warp(at, 0.20, 0.035, 136);
        colour = with_blade(
            tile,
            at,
            colour,
            tile.item(bent, blades, |c| 0.2 + 0.8 * drifted(c)),
        );
    }
    colour
}

/// A kelp blade with midrib, crinkles and holes.
fn with_blade(tile: &Tile, at: TilePoint, under: Reflectance, item: Option<Item>) -> Reflectance {
    let Some(blade) = item else { return under };
    let [x, y] = blade.local;
    let crinkle = wave(x * 9.0 + 0.8 * y.abs() + tile.fbm(at, 0.05, 2, 140));
    let midrib = smoothstep(0.16, 0.04, y.abs());
    let old = unit(blade.bits, 9);
    let skin = mix(KELP, [0.20, 0.165, 0.06], 0.7 * old);
    let silted = smoothstep(0.05, 0.45, tile.fbm(at, 0.09, 3, 141));
    let mut face = scale(
        skin,
        1.0 + 0.28 * crinkle * (1.0 - midrib) - 0.35 * midrib + 0.2 * tile.fbm(at, 0.012, 2, 142),
    );
    face = mix(face, SILT, 0.55 * silted);
    mix(
        scale(under, 0.55),
        face,
        smoothstep(1.0, 0.88, blade.r + 0.06 * crinkle),
    )
}
