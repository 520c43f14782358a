//! The side of a ship that has lain in harbour too long.

use super::shapes::{bush, lumps, noise, step, tube, wall};
use super::{Dealt, Place, Site};
use crate::mesh::{Mesh, Vec3};
use crate::noise::{hash, unit};
use crate::tile::Tile;

/// Along the ship and up, m.
const Y_M: [f64; 2] = [-9.0, 3.0];
const Z_M: [f64; 2] = [-2.6, 2.2];

/// The plating faces -x and stands at x = 0; it runs from y = 3 to y = -9, with barnacles, weed and a bilge that turns away.
pub(super) fn hull_side(seed: u32) -> Site {
    let tile = Tile {
        size_m: 14.4,
        seed: seed ^ 0x4011,
    };
    let plating = wall(Y_M, Z_M, 0.045, |y, z| {
        plating_m(y, z) + fouling_m(&tile, y, z)
    });
    let mut barnacles = Dealt::<1>::new(|_| barnacle());
    let mut weed = Dealt::<3>::new(|i| hanging(tile.seed ^ i));
    for i in 0..3000 {
        let bits = hash(i, 3, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let y = Y_M[0] + (Y_M[1] - Y_M[0]) * share(1);
        let z = Z_M[0] + (Z_M[1] - Z_M[0]) * share(2);
        if share(3) > 1.15 * cover(&tile, y, z) {
            continue;
        }
        let put = |size: f64| Place {
            at_m: [-plating_m(y, z) - fouling_m(&tile, y, z), y, z],
            turn: 0.0,
            size,
        };
        match i % 4 {
            0 => weed.put(bits, put(0.06 + 0.16 * share(4))),
            _ => barnacles.put(bits, put(0.010 + 0.016 * share(4))),
        }
    }
    Site::new("hull_side")
        .with("plating", plating, "hull_black_fouled", [1.0, 1.0, 1.0])
        .with_many("barnacles", barnacles.all(), ("polyps", [0.46, 0.44, 0.39]))
        .with_many("weed", weed.all(), ("polyps", [0.13, 0.17, 0.06]))
}

/// The bare hull: frames press the plating into bays, and it turns under at the bilge.
fn plating_m(y: f64, z: f64) -> f64 {
    let bay = (y / 0.75 - (y / 0.75).floor() - 0.5).abs();
    let under = step(-1.0, -2.6, z);
    0.006 * step(0.0, 0.5, bay) - 0.9 * under * under
}

/// Where growth is, 0 to 1: in patches, more towards the bilge.
fn cover(tile: &Tile, y: f64, z: f64) -> f64 {
    let patches = noise(tile, [y + 20.0, z + 20.0], 1.3, 4, 1);
    step(-0.05, 0.35, patches + 0.12 * (0.4 - z))
}

fn fouling_m(tile: &Tile, y: f64, z: f64) -> f64 {
    let at = [y + 20.0, z + 20.0];
    let cover = cover(tile, y, z);
    let crust = 0.012 + 0.02 * noise(tile, at, 0.25, 3, 2);
    cover * (crust.max(0.0) + 0.6 * lumps(tile, at, ([0.015, 0.055], 0.13, 3), 0.7))
}

/// A barnacle of radius 1: a cone with a flat top, towards -x.
fn barnacle() -> Mesh {
    let path: Vec<Vec3> = [0.0, 0.5, 1.0, 1.05, 0.7]
        .iter()
        .map(|t| [-1.1 * t, 0.0, 0.0])
        .collect();
    tube(&path, 8, |_, t| {
        let lip = if t > 0.8 { 0.55 } else { 1.0 };
        lip * (1.0 - 0.55 * t.min(0.75) / 0.75)
    })
}

/// A tuft of weed, 1 m long, that hangs down from the side.
fn hanging(bits: u32) -> Mesh {
    let mut mesh = bush([0.0; 3], 7, (1.0, 0.025), 0.7, bits);
    // The bush grows up; here it hangs, and away from the hull.
    for p in &mut mesh.positions {
        *p = [-0.4 * p[2] - 0.3 * p[0].abs(), p[1], -0.9 * p[2]];
    }
    mesh.smooth_normals();
    mesh
}
