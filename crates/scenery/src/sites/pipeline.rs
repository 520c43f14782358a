//! A pipeline on sand.

use super::shapes::{bush, ground, lump, lumps, noise, step, tube};
use super::{AS_IT_IS, Dealt, Place, Site};
use crate::mesh::{Vec3, turn};
use crate::noise::{hash, unit};
use crate::tile::Tile;

const RADIUS_M: f64 = 0.28;
/// Height of the pipe's middle, and where it runs: from x to x, m.
const MIDDLE_M: f64 = -0.02;
const X_M: [f64; 2] = [-2.0, 16.0];
/// Distance between field joints, m.
const JOINT_M: f64 = 4.0;

/// A pipe along +x that lies half in the sand at z = 0, with field joints, stones, and growth on its top.
pub(super) fn pipeline(seed: u32) -> Site {
    let tile = Tile {
        size_m: 18.0,
        seed: seed ^ 0x919e,
    };
    let middle = |x: f64| {
        [
            x,
            0.12 * noise(&tile, [x + 3.0, 5.0], 6.0, 2, 1),
            MIDDLE_M + 0.05 * noise(&tile, [x + 3.0, 9.0], 5.0, 2, 2),
        ]
    };
    let path: Vec<Vec3> = (0..=360)
        .map(|k| middle(X_M[0] + (X_M[1] - X_M[0]) * f64::from(k) / 360.0))
        .collect();
    let pipe = tube(&path, 40, |share, t| {
        let x = X_M[0] + (X_M[1] - X_M[0]) * t;
        let to_joint = ((x / JOINT_M) - (x / JOINT_M).round()).abs() * JOINT_M;
        let rough = noise(&tile, [x + 3.0, 3.0 + 1.8 * share], 0.3, 3, 3);
        RADIUS_M - 0.022 * step(0.32, 0.30, to_joint) + 0.006 * rough
    });
    let bed = |x: f64, y: f64| {
        let at = [x + 4.0, y + 9.0];
        let off = (y - middle(x)[1]).abs();
        let pool = step(0.9, 0.3, off) * (0.5 + 0.9 * noise(&tile, at, 1.4, 2, 4));
        let drift = 0.16 * step(0.75, 0.35, off) * step(-0.1, 0.5, noise(&tile, at, 2.4, 2, 5));
        let ripples = noise(
            &tile,
            [2.6 * at[0] + 0.8 * noise(&tile, at, 1.0, 2, 6), 0.5 * at[1]],
            0.45,
            1,
            7,
        );
        0.09 * noise(&tile, at, 2.6, 4, 8) + 0.022 * ripples - 0.10 * pool
            + drift
            + lumps(&tile, at, ([0.015, 0.07], 0.5, 9), 0.4)
    };
    let ball = |i: u32| lump([0.0; 3], [1.0, 0.8, 0.7], (0.3, 0.6), tile.seed ^ i, 2);
    let mut stones = Dealt::<4>::new(ball);
    let mut growth = Dealt::<2>::new(|i| ball(i + 4));
    let mut weed = Dealt::<2>::new(|i| bush([0.0; 3], 10, (1.0, 0.02), 0.9, tile.seed ^ (20 + i)));
    for i in 0..130 {
        let bits = hash(i, 2, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let x = X_M[0] + (X_M[1] - X_M[0]) * share(1);
        let y = (if share(2) < 0.5 { -1.0 } else { 1.0 }) * (0.45 + 2.6 * share(3));
        let put = |at_m, size| Place {
            at_m,
            turn: share(9),
            size,
        };
        stones.put(
            bits,
            put(
                [x, y, bed(x, y)],
                0.02 + 0.16 * share(4) * share(5) * share(6),
            ),
        );
        let [cosine, sine] = turn(0.08 + 0.34 * share(6));
        let at = middle(X_M[0] + (X_M[1] - X_M[0]) * share(7));
        let foot = [at[0], at[1] + RADIUS_M * cosine, at[2] + RADIUS_M * sine];
        match i % 3 {
            0 => weed.put(bits, put(foot, 0.08 + 0.15 * share(8))),
            _ => growth.put(bits, put(foot, 0.02 + 0.04 * share(8))),
        }
    }
    Site::new("pipeline")
        .with("pipe", pipe, "pipeline_coating", AS_IT_IS)
        .with(
            "bed",
            ground(X_M, [-6.0, 6.0], 0.09, bed),
            "seabed",
            AS_IT_IS,
        )
        .with_many("stones", stones.all(), ("encrusted", AS_IT_IS))
        .with_many("growth", growth.all(), ("polyps", [0.56, 0.42, 0.30]))
        .with_many("weed", weed.all(), ("polyps", [0.18, 0.13, 0.06]))
}
