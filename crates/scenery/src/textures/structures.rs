//! Things people have built: concrete, steel piles, pipelines, nets.

use super::sediment;
use crate::colour::{Reflectance, mix, scale};
use crate::noise::{hash, unit};
use crate::tile::{Population, Tile, TilePoint, smoothstep, wave};

const CONCRETE: Reflectance = [0.300, 0.290, 0.265];
const LIME: Reflectance = [0.500, 0.490, 0.460];
const GREEN_FILM: Reflectance = [0.090, 0.125, 0.055];
const OLD_RUST: Reflectance = [0.085, 0.045, 0.032];
const BRIGHT_RUST: Reflectance = [0.340, 0.135, 0.045];
const RUST: Reflectance = [0.190, 0.078, 0.036];
const COATING: Reflectance = [0.062, 0.066, 0.070];
const JOINT_FOAM: Reflectance = [0.430, 0.300, 0.075];
const SILT: Reflectance = [0.220, 0.195, 0.145];
const TWINE: Reflectance = [0.070, 0.260, 0.230];

/// Cast concrete with board marks.
pub(super) fn concrete_pier(tile: &Tile, at: TilePoint) -> Reflectance {
    let boards = tile.count(0.15) as f32;
    let across = at[0] / tile.size_m * boards;
    let board = unit(
        hash(
            (across.floor() as i32).rem_euclid(boards as i32) as u32,
            3,
            tile.seed,
        ),
        1,
    );
    let to_joint_m = (across - across.floor() - 0.5).abs();
    let joint = smoothstep(
        0.475,
        0.495,
        to_joint_m + 0.008 * tile.fbm(at, 0.05, 2, 200),
    );
    let wood = tile.streaks(at, [0.010, 0.35], 3, 201);
    let sandy = tile.fbm(at, 0.012, 3, 202);
    let cloudy = tile.fbm(at, 0.7, 4, 203);
    let tone =
        1.0 + 0.22 * (board - 0.5) + 0.10 * wood + 0.20 * sandy + 0.25 * cloudy - 0.40 * joint;
    let mut colour = scale(CONCRETE, tone);
    let pores = Population {
        spacing_m: 0.035,
        radius_m: [0.0015, 0.008],
        elongation: 1.5,
        salt: 204,
    };
    if let Some(pore) = tile.item(at, pores, |_| 0.5) {
        colour = scale(colour, 1.0 - 0.65 * smoothstep(1.0, 0.7, pore.r));
    }
    // Where the skin has spalled, rounded aggregate shows.
    let worn = smoothstep(0.10, 0.20, tile.fbm(at, 0.5, 4, 205));
    let stone = tile.cellular(at, 0.028, 206);
    let stone_tone = 0.35 + 1.3 * unit(stone.bits, 9);
    let edge = smoothstep(0.02, 0.16, stone.second - stone.nearest);
    let aggregate = scale(
        CONCRETE,
        (0.45 + 0.55 * edge) * (0.8 + (stone_tone - 0.8) * edge) + 0.12 * sandy,
    );
    colour = mix(colour, aggregate, worn);
    let fissure = tile.ridged(tile.warp(at, 0.12, 0.05, 207), 1.1, 1, 208);
    let crack = smoothstep(0.989, 0.998, fissure);
    colour = mix(colour, scale(CONCRETE, 0.2), 0.9 * crack);
    let lime = smoothstep(0.90, 0.99, fissure);
    colour = mix(
        colour,
        LIME,
        0.35 * lime * (1.0 - crack) * smoothstep(-0.2, 0.4, cloudy),
    );
    let film = smoothstep(
        0.02,
        0.42,
        tile.fbm(tile.warp(at, 0.2, 0.08, 209), 0.8, 5, 210),
    );
    mix(
        colour,
        scale(GREEN_FILM, 1.0 + 0.5 * sandy + 0.3 * wood),
        0.8 * film,
    )
}

/// Steel under thick flaking rust.
pub(super) fn rusted_pile(tile: &Tile, at: TilePoint) -> Reflectance {
    let moved = tile.warp(at, 0.12, 0.03, 220);
    let layer = tile.fbm(moved, 0.35, 5, 221);
    let powder = tile.fbm(at, 0.02, 3, 222);
    let runs = tile.streaks(at, [0.06, 0.8], 3, 223);
    let mut colour = mix(OLD_RUST, RUST, 0.5 + 1.1 * layer);
    colour = mix(
        colour,
        BRIGHT_RUST,
        smoothstep(0.0, 0.55, runs + 0.5 * layer + 0.3 * powder),
    );
    colour = scale(colour, 1.0 + 0.40 * powder);
    // Flakes: plates with a dark gap on one side.
    let flake = tile.cellular(moved, 0.055, 224);
    let gap = smoothstep(0.09, 0.0, flake.second - flake.nearest);
    let lifted = if unit(flake.bits, 9) < 0.55 { 1.0 } else { 0.0 };
    colour = scale(colour, 0.80 + 0.45 * unit(flake.bits, 10) * lifted);
    colour = scale(colour, 1.0 - 0.7 * gap * lifted);
    let pits = Population {
        spacing_m: 0.028,
        radius_m: [0.002, 0.010],
        elongation: 1.4,
        salt: 225,
    };
    if let Some(pit) = tile.item(at, pits, |c| {
        0.15 + 0.6 * smoothstep(-0.2, 0.4, tile.fbm(c, 0.4, 2, 226))
    }) {
        colour = mix(
            colour,
            scale(OLD_RUST, 0.7),
            0.85 * smoothstep(1.0, 0.6, pit.r),
        );
    }
    let scale_white = smoothstep(0.30, 0.42, tile.fbm(at, 0.25, 4, 227));
    mix(colour, [0.40, 0.37, 0.32], 0.55 * scale_white)
}

/// Pipe coating; the pipe runs along x. Ribs go around it, field joints are wrapped in foam.
pub(super) fn pipeline_coating(tile: &Tile, at: TilePoint) -> Reflectance {
    let ribs = tile.count(0.045) as f32;
    let rib = wave(at[0] / tile.size_m * ribs + 0.04 * tile.fbm(at, 0.4, 2, 240));
    let stipple = tile.fbm(at, 0.012, 3, 241);
    let mut colour = scale(
        COATING,
        1.0 + 0.30 * rib + 0.35 * stipple + 0.25 * tile.fbm(at, 0.6, 3, 242),
    );
    let scratch = smoothstep(
        0.955,
        0.985,
        tile.ridged(tile.warp(at, 0.6, 0.2, 243), 0.25, 1, 244),
    );
    let scuffed = smoothstep(0.0, 0.3, tile.fbm(at, 0.9, 2, 245));
    colour = mix(colour, [0.26, 0.26, 0.25], 0.7 * scratch * scuffed);
    let joints = tile.count(1.8) as f32;
    let joint = at[0] / tile.size_m * joints;
    let from_joint_m = (joint - joint.floor() - 0.5).abs() * tile.size_m / joints;
    let wrapped = smoothstep(
        0.172,
        0.168,
        from_joint_m + 0.004 * tile.fbm(at, 0.1, 2, 246),
    );
    let foam = scale(
        JOINT_FOAM,
        0.95 + 0.20 * stipple + 0.25 * tile.fbm(at, 0.15, 3, 247),
    );
    let strap = smoothstep(0.012, 0.009, (from_joint_m - 0.13).abs());
    colour = mix(colour, mix(foam, [0.33, 0.33, 0.33], strap), wrapped);
    let dust = tile.fbm(tile.warp(at, 0.3, 0.1, 248), 0.7, 5, 249) - 0.12 * rib + 0.10 * stipple;
    colour = mix(
        colour,
        scale(SILT, 1.0 + 0.25 * stipple),
        0.80 * smoothstep(-0.02, 0.38, dust),
    );
    let tubes = Population {
        spacing_m: 0.045,
        radius_m: [0.0018, 0.0042],
        elongation: 8.0,
        salt: 250,
    };
    let settled = |c: TilePoint| 0.75 * smoothstep(0.0, 0.4, tile.fbm(c, 0.5, 2, 251));
    match tile.item(tile.warp(at, 0.03, 0.012, 252), tubes, settled) {
        Some(tube) => mix(
            colour,
            scale([0.52, 0.49, 0.43], 0.8 + 0.3 * unit(tube.bits, 9)),
            smoothstep(1.0, 0.7, tube.r),
        ),
        None => colour,
    }
}

/// A diamond mesh of twine, knotted every 6 cm, lying on rippled sand.
pub(super) fn fishing_net(tile: &Tile, at: TilePoint) -> Reflectance {
    let bottom = sediment::sand(tile, at);
    let meshes = tile.count(0.085) as f32;
    let [x, y] = tile.warp(at, 0.35, 0.030, 260);
    let cell_m = tile.size_m / meshes;
    let (p, q) = ((x + y) / cell_m, (x - y) / cell_m);
    let off = |t: f32| (t - (t + 0.5).floor()).abs();
    let shadow_at = |t: f32| off(t - 0.10);
    let to_twine = off(p).min(off(q));
    let shade = smoothstep(0.06, 0.02, shadow_at(p).min(off(q + 0.10)));
    let knot = (off(p) * off(p) + off(q) * off(q)).sqrt();
    let twine = smoothstep(0.034, 0.026, to_twine).max(smoothstep(0.085, 0.07, knot));
    let lay = wave(if off(p) < off(q) { q } else { p } * 9.0);
    let fouled = smoothstep(0.0, 0.4, tile.fbm(at, 0.3, 3, 261));
    let thread = mix(
        scale(TWINE, 1.0 + 0.30 * lay),
        scale(SILT, 0.7),
        0.75 * fouled,
    );
    mix(
        scale(bottom, 1.0 - 0.45 * shade),
        scale(thread, 1.0 + 0.3 * tile.fbm(at, 0.01, 2, 262)),
        twine,
    )
}
