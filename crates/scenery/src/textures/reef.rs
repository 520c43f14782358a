//! Reef rock under living crusts.

use crate::colour::{Reflectance, mix, scale};
use crate::noise::unit;
use crate::tile::{Item, Population, Tile, TilePoint, smoothstep, wave};

const LIMESTONE: Reflectance = [0.270, 0.245, 0.200];
const CREVICE: Reflectance = [0.045, 0.042, 0.040];
const TURF: Reflectance = [0.080, 0.085, 0.038];

/// Encrusting growth: coralline pink, mauve, sponge orange, sponge yellow, ochre, tunicate red.
const CRUSTS: [Reflectance; 6] = [
    [0.340, 0.190, 0.205],
    [0.185, 0.130, 0.175],
    [0.360, 0.175, 0.075],
    [0.370, 0.300, 0.105],
    [0.220, 0.165, 0.080],
    [0.220, 0.075, 0.062],
];

/// Limestone overgrown by crusts, corals and turf.
pub(super) fn coral_rock(tile: &Tile, at: TilePoint) -> Reflectance {
    let moved = tile.warp(at, 0.14, 0.05, 300);
    let relief = tile.fbm(moved, 0.30, 5, 301);
    let porous = tile.fbm(at, 0.014, 3, 302);
    let mut colour = scale(LIMESTONE, 1.0 + 0.6 * relief + 0.35 * porous);
    let turf = smoothstep(0.02, 0.14, tile.fbm(moved, 0.45, 5, 303));
    colour = mix(colour, scale(TURF, 1.0 + 0.8 * porous), 0.9 * turf);
    colour = crusts(tile, moved, colour, porous);
    let brains = Population {
        spacing_m: 0.42,
        radius_m: [0.05, 0.15],
        elongation: 1.3,
        salt: 310,
    };
    colour = with_coral(tile, at, colour, tile.item(at, brains, |_| 0.55));
    let cups = Population {
        spacing_m: 0.06,
        radius_m: [0.005, 0.016],
        elongation: 1.3,
        salt: 312,
    };
    let colony = |c: TilePoint| 0.9 * smoothstep(0.08, 0.35, tile.fbm(c, 0.5, 2, 313));
    if let Some(cup) = tile.item(at, cups, colony) {
        let ring = smoothstep(0.35, 0.5, cup.r) * smoothstep(1.0, 0.8, cup.r);
        let hue = if unit(cup.bits, 9) < 0.5 {
            [0.56, 0.27, 0.06]
        } else {
            [0.58, 0.50, 0.36]
        };
        colour = mix(scale(colour, 0.5), hue, ring);
    }
    let crack = smoothstep(0.90, 0.985, tile.ridged(moved, 0.38, 2, 304));
    mix(colour, CREVICE, 0.85 * crack)
}

/// Patches of encrusting growth, each a cell of irregular outline with a pale growing edge.
fn crusts(tile: &Tile, moved: TilePoint, under: Reflectance, porous: f32) -> Reflectance {
    let mut colour = under;
    for (feature_m, share, salt) in [(0.28, 0.45, 305), (0.09, 0.28, 306)] {
        let bent = tile.warp(moved, 0.05, 0.02, salt ^ 0x40);
        let patch = tile.cellular(bent, feature_m, salt);
        if unit(patch.bits, 9) > share {
            continue;
        }
        let hue = CRUSTS[(unit(patch.bits, 10) * CRUSTS.len() as f32) as usize];
        let reach = 0.30 + 0.25 * unit(patch.bits, 11);
        let inside = smoothstep(reach, reach - 0.03, patch.nearest);
        let edge = smoothstep(reach - 0.10, reach - 0.03, patch.nearest);
        let lumps = tile.fbm(bent, 0.03, 3, salt ^ 0x80);
        let settled = mix(hue, LIMESTONE, 0.35 * unit(patch.bits, 12));
        let face = scale(settled, 1.0 + 0.35 * porous + 0.40 * lumps + 0.30 * edge);
        colour = mix(colour, face, inside);
    }
    colour
}

/// A massive coral with winding ridges.
fn with_coral(tile: &Tile, at: TilePoint, under: Reflectance, item: Option<Item>) -> Reflectance {
    let Some(coral) = item else { return under };
    let winding = tile.fbm(tile.warp(at, 0.05, 0.01, 314), 0.05, 2, 315);
    let ridge = wave(winding * 3.0 + unit(coral.bits, 12));
    let hue = mix([0.34, 0.27, 0.12], [0.22, 0.29, 0.17], unit(coral.bits, 9));
    let outline = coral.r + 0.08 * tile.fbm(at, 0.08, 2, 316);
    let face = scale(
        hue,
        0.85 + 0.50 * ridge - 0.45 * smoothstep(0.5, 1.0, outline),
    );
    mix(scale(under, 0.45), face, smoothstep(0.97, 0.93, outline))
}
