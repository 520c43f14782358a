//! A reef: a channel of sand between rock that rises to both sides, with corals.

use super::shapes::{bush, crests, ground, lump, lumps, noise, step};
use super::{AS_IT_IS, Dealt, Place, Site};
use crate::mesh::{Mesh, Vec3};
use crate::noise::{hash, unit};
use crate::tile::Tile;

/// What is in view of a camera at the origin that looks along +x: x and y, m.
const X_M: [f64; 2] = [-0.5, 11.5];
const Y_M: [f64; 2] = [-5.5, 5.5];
/// Places that are tried for corals.
const CORALS: u32 = 1500;

/// A channel along +x, about 1.3 m below the origin, rock at both sides up to 1 m above it, corals on the rock.
pub(super) fn reef(seed: u32) -> Site {
    let tile = Tile {
        size_m: 24.0,
        seed: seed ^ 0x5eef,
    };
    let rock = |x: f64, y: f64| rock_m(&tile, x, y);
    let bed = |x: f64, y: f64| {
        let ripple = noise(&tile, [0.5 * x + 0.2 * y, 2.0 * y], 0.5, 2, 11);
        -1.45 + 0.10 * noise(&tile, [x, y], 2.0, 3, 12) + 0.012 * ripple
    };
    let ball = |i: u32| lump([0.0; 3], [1.0, 0.9, 0.8], (0.17, 0.6), tile.seed ^ i, 3);
    let thicket = |i: u32| bush([0.0; 3], 26, (1.0, 0.035), 0.95, tile.seed ^ (40 + i));
    let (mut ochre, mut green) = (Dealt::<2>::new(ball), Dealt::<2>::new(|i| ball(i + 2)));
    let (mut brown, mut pale) = (
        Dealt::<2>::new(thicket),
        Dealt::<2>::new(|i| thicket(i + 2)),
    );
    let mut tables = Dealt::<2>::new(|i| table(tile.seed ^ (80 + i)));
    let mut fans = Dealt::<1>::new(|i| bush([0.0; 3], 14, (1.0, 0.018), 0.5, tile.seed ^ (90 + i)));
    for i in 0..CORALS {
        let bits = hash(i, 7, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let x = 0.9 + (X_M[1] - 1.4) * share(1);
        let side = if share(2) < 0.5 { -1.0 } else { 1.0 };
        let y = side * (0.6 + 4.3 * share(3));
        let at_m = [x, y, rock(x, y) - 0.01];
        // Colonies stand together.
        let crowded = noise(&tile, [x + 9.0, y + 12.0], 1.1, 2, 20) > 0.5 * share(9) - 0.22;
        if at_m[2] < bed(x, y) + 0.06 || !crowded {
            continue;
        }
        let put = |size: f64| Place {
            at_m,
            turn: share(4),
            size,
        };
        let small = share(5) * share(6);
        match i % 9 {
            0..3 => ochre.put(bits, put(0.06 + 0.34 * small)),
            3..5 => green.put(bits, put(0.06 + 0.28 * small)),
            5 => brown.put(bits, put(0.20 + 0.26 * small)),
            6 => pale.put(bits, put(0.18 + 0.24 * small)),
            7 => tables.put(bits, put(0.22 + 0.30 * small)),
            _ => fans.put(bits, put(0.25 + 0.25 * small)),
        }
    }
    Site::new("reef")
        .with("rock", ground(X_M, Y_M, 0.055, rock), "encrusted", AS_IT_IS)
        .with(
            "sand",
            ground(X_M, [-3.0, 3.0], 0.12, bed),
            "seabed",
            [0.85, 0.83, 0.78],
        )
        .with_many("corals_ochre", ochre.all(), ("polyps", [0.42, 0.33, 0.17]))
        .with_many("corals_green", green.all(), ("polyps", [0.28, 0.31, 0.18]))
        .with_many("bushes_brown", brown.all(), ("polyps", [0.44, 0.32, 0.18]))
        .with_many("bushes_pale", pale.all(), ("polyps", [0.52, 0.45, 0.42]))
        .with_many("tables", tables.all(), ("polyps", [0.36, 0.29, 0.19]))
        .with_many("fans", fans.all(), ("polyps", [0.34, 0.14, 0.34]))
}

fn rock_m(tile: &Tile, x: f64, y: f64) -> f64 {
    let bend = 0.8 * noise(tile, [x, 3.0], 5.0, 2, 1);
    let off = y - bend;
    let right = 1.9 * step(-0.6, -3.6, off);
    let left = 1.5 * step(0.8, 3.4, off);
    let far = 1.1 * step(6.0, 11.0, x);
    let height = right + left + far;
    let at = [x + 9.0, y + 12.0];
    let rough = 0.34 * noise(tile, at, 1.5, 4, 2)
        + 0.42 * (crests(tile, at, 1.1, 3) - 0.5)
        + 0.11 * noise(tile, at, 0.28, 3, 4)
        + 0.8 * lumps(tile, at, ([0.06, 0.24], 0.5, 5), 0.6);
    // In the channel the rock is below the sand.
    -1.75 + height + rough * (0.35 + 0.65 * step(0.1, 0.8, height))
}

/// A flat coral of radius 1 on a stalk, with an uneven rim.
fn table(bits: u32) -> Mesh {
    let rise = 0.30 + 0.15 * f64::from(unit(bits, 8));
    let top: Vec3 = [0.0, 0.0, rise];
    let mut mesh = lump(top, [1.0, 0.9, 0.05], (0.35, 1.0), bits, 3);
    mesh.append(&lump(
        [0.0, 0.0, 0.4 * rise],
        [0.2, 0.2, 0.75 * rise],
        (0.2, 0.3),
        bits ^ 1,
        2,
    ));
    mesh
}
