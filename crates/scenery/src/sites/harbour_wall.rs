//! A wall of sheet piles in a harbour, with a tyre, a ladder and what has sunk before it.

use super::shapes::{ground, lump, lumps, noise, step, tube, wall};
use super::{AS_IT_IS, Dealt, Place, Site};
use crate::mesh::{Mesh, Vec3, turn};
use crate::noise::{hash, unit};
use crate::tile::Tile;

const Y_M: [f64; 2] = [-7.0, 3.5];
const Z_M: [f64; 2] = [-2.4, 2.4];
/// Width of a pair of piles and depth of a pan, m.
const PAIR_M: f64 = 1.2;
const PAN_M: f64 = 0.36;

/// The wall faces -x; its pans stand at x = 0 and its outer faces at x = -0.36. Mud at z = -2.
pub(super) fn harbour_wall(seed: u32) -> Site {
    let tile = Tile {
        size_m: 14.4,
        seed: seed ^ 0xba51,
    };
    let growth = |y: f64, z: f64| {
        let at = [y + 20.0, z + 20.0];
        let cover = step(-0.25, 0.3, noise(&tile, at, 1.1, 4, 1) - 0.06 * z);
        0.008 * noise(&tile, at, 0.12, 3, 2)
            + cover * (0.02 + 0.55 * lumps(&tile, at, ([0.015, 0.07], 0.15, 3), 0.75))
    };
    let piles = wall(Y_M, Z_M, 0.045, |y, z| profile_m(y) + growth(y, z));
    let ball = |i: u32| lump([0.0; 3], [1.0, 1.2, 0.9], (0.35, 0.7), tile.seed ^ i, 2);
    let mut things = Dealt::<4>::new(ball);
    let mut sponges = Dealt::<3>::new(|i| ball(i + 4));
    let mut pale = Dealt::<2>::new(|i| ball(i + 7));
    for i in 0..520 {
        let bits = hash(i, 2, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let (y, z) = (Y_M[0] + 10.5 * share(1), Z_M[0] + 4.6 * share(2));
        let place = Place {
            at_m: [-profile_m(y) - growth(y, z), y, z],
            turn: share(5),
            size: 0.012 + 0.06 * share(3) * share(4) * share(6),
        };
        match i % 3 {
            0 => pale.put(bits, place),
            _ => sponges.put(bits, place),
        }
    }
    for i in 0..34 {
        let bits = hash(i, 3, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let (x, y) = (-0.6 - 2.4 * share(1), Y_M[0] + 10.0 * share(2));
        let size = 0.05 + 0.2 * share(3) * share(4);
        things.put(
            bits,
            Place {
                at_m: [x, y, -2.0],
                turn: share(5),
                size,
            },
        );
    }
    let bed = |x: f64, y: f64| {
        let at = [x + 8.0, y + 20.0];
        -2.0 + 0.12 * noise(&tile, at, 1.2, 4, 4)
            + 0.25 * step(-0.9, -0.4, x)
            + lumps(&tile, at, ([0.02, 0.12], 0.5, 5), 0.5)
    };
    Site::new("harbour_wall")
        .with("piles", piles, "rusted_pile", [0.95, 1.0, 1.0])
        .with_many("sponges", sponges.all(), ("polyps", [0.46, 0.30, 0.13]))
        .with_many("tunicates", pale.all(), ("polyps", [0.60, 0.55, 0.46]))
        .with(
            "tyre",
            ring([-0.55, 0.05, 0.25], 0.42, 0.13),
            "polyps",
            [0.06, 0.06, 0.06],
        )
        .with("ladder", ladder(-0.46, -1.3), "rusted_pile", AS_IT_IS)
        .with_many("stones", things.all(), ("encrusted", AS_IT_IS))
        .with(
            "mud",
            ground([-4.5, 0.2], Y_M, 0.06, bed),
            "kelp_sediment",
            [0.9, 0.88, 0.85],
        )
}

/// How far a pile stands out at a place along the wall, m.
fn profile_m(y: f64) -> f64 {
    let t = 2.0 * (y / PAIR_M - (y / PAIR_M).floor());
    let up = if t < 1.0 { t } else { 2.0 - t };
    PAN_M * ((up - 0.30) / 0.40).clamp(0.0, 1.0)
}

/// A tyre that hangs before the wall, its axis along x.
fn ring(centre: Vec3, radius_m: f64, thickness_m: f64) -> Mesh {
    let path: Vec<Vec3> = (0..=48)
        .map(|k| {
            let [cosine, sine] = turn(f64::from(k) / 48.0);
            [
                centre[0],
                centre[1] + radius_m * cosine,
                centre[2] + radius_m * sine,
            ]
        })
        .collect();
    tube(&path, 16, |share, _| {
        let [cosine, _] = turn(2.0 * share);
        thickness_m * (1.0 + 0.10 * cosine)
    })
}

/// Two posts and rungs, at x and y.
fn ladder(x: f64, y: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let mut bar = |from: Vec3, to: Vec3, radius_m: f64| {
        let path: Vec<Vec3> = (0..=12)
            .map(|k| [0, 1, 2].map(|c| from[c] + (to[c] - from[c]) * f64::from(k) / 12.0))
            .collect();
        mesh.append(&tube(&path, 8, |_, _| radius_m));
    };
    for side in [-0.22, 0.22] {
        bar([x, y + side, -1.6], [x, y + side, 2.4], 0.03);
    }
    for k in 0..13 {
        let z = -1.5 + 0.3 * f64::from(k);
        bar([x, y - 0.22, z], [x, y + 0.22, z], 0.017);
    }
    mesh
}
