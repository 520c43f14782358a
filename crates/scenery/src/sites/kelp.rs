//! Kelp over rock.

use super::shapes::{crests, ground, lump, noise, step, strip, tube};
use super::{AS_IT_IS, Dealt, Place, Site};
use crate::mesh::{Mesh, Vec3, normalised, plus, times, turn};
use crate::noise::{hash, unit};
use crate::tile::Tile;

const X_M: [f64; 2] = [-0.5, 14.0];
const Y_M: [f64; 2] = [-7.0, 7.0];
const PLANTS: u32 = 34;
/// Kinds of plants, by height.
const KINDS: u32 = 6;

/// Rock about 2 m below the origin, and plants of up to 7 m that lean with the current, towards +y.
pub(super) fn kelp(seed: u32) -> Site {
    let tile = Tile {
        size_m: 28.0,
        seed: seed ^ 0x6e19,
    };
    let rock = |x: f64, y: f64| {
        let at = [x + 6.0, y + 14.0];
        -2.0 + 0.55 * noise(&tile, at, 3.2, 4, 1)
            + 0.4 * (crests(&tile, at, 1.6, 2) - 0.5)
            + 0.05 * noise(&tile, at, 0.3, 3, 3)
            + 0.8 * step(2.0, 6.0, y.abs())
    };
    let kinds: Vec<Plant> = (0..KINDS)
        .map(|i| {
            let height_m = 2.4 + 4.6 * f64::from(i) / f64::from(KINDS - 1);
            plant(height_m, hash(i, 9, tile.seed))
        })
        .collect();
    let mut places = vec![Vec::new(); KINDS as usize];
    let mut boulders =
        Dealt::<4>::new(|i| lump([0.0; 3], [1.0, 1.2, 0.7], (0.35, 1.0), tile.seed ^ i, 3));
    for i in 0..PLANTS {
        let bits = hash(i, 1, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let x = 2.0 + 11.0 * share(1);
        let y = (2.0 * share(2) - 1.0) * (1.0 + 0.42 * x);
        // A lane ahead of the camera stays open.
        let y = if y.abs() < 0.35 + 0.05 * x {
            y + 1.1 * y.signum()
        } else {
            y
        };
        let kind = (f64::from(KINDS) * share(3).sqrt()) as usize;
        places[kind].push(Place {
            at_m: [x, y, rock(x, y) - 0.05],
            turn: 0.12 * (share(4) - 0.5),
            size: 0.92 + 0.13 * share(5),
        });
    }
    for i in 0..40 {
        let bits = hash(i, 2, tile.seed);
        let share = |k| f64::from(unit(bits, k));
        let (x, y) = (1.0 + 12.0 * share(1), Y_M[0] + 14.0 * share(2));
        let size = 0.08 + 0.35 * share(3) * share(4);
        boulders.put(
            bits,
            Place {
                at_m: [x, y, rock(x, y)],
                turn: share(5),
                size,
            },
        );
    }
    let of = |part: fn(&Plant) -> Mesh| {
        let meshes: Vec<Mesh> = kinds.iter().map(part).collect();
        meshes.into_iter().zip(places.clone())
    };
    Site::new("kelp")
        .with("rock", ground(X_M, Y_M, 0.09, rock), "encrusted", AS_IT_IS)
        .with_many("boulders", boulders.all(), ("encrusted", AS_IT_IS))
        .with_many(
            "stalks",
            of(|plant| plant.stalk.clone()),
            ("polyps", [0.20, 0.13, 0.05]),
        )
        .with_many(
            "young_blades",
            of(|plant| plant.upper.clone()),
            ("polyps", [0.34, 0.25, 0.07]),
        )
        .with_many(
            "old_blades",
            of(|plant| plant.lower.clone()),
            ("polyps", [0.20, 0.14, 0.05]),
        )
}

struct Plant {
    stalk: Mesh,
    upper: Mesh,
    lower: Mesh,
}

/// A stalk with blades on both sides; what is above its reach lies along it.
fn plant(height_m: f64, bits: u32) -> Plant {
    let share = |k| f64::from(unit(bits, k));
    let (sway, phase) = (0.25 + 0.35 * share(10), share(11));
    let place = |t: f64| {
        let [wave, _] = turn(phase + 0.9 * t);
        let z = (height_m * 1.06 * t).min(height_m);
        let lean = sway * t * t * 1.8 + 0.12 * wave * t;
        [0.15 * wave * t, lean, z]
    };
    let steps = 24;
    let path: Vec<Vec3> = (0..=steps)
        .map(|k| place(f64::from(k) / f64::from(steps)))
        .collect();
    let mut plant = Plant {
        stalk: tube(&path, 5, |_, t| 0.011 - 0.005 * t),
        upper: Mesh::default(),
        lower: Mesh::default(),
    };
    let blades = (height_m * 10.0) as u32;
    for i in 0..blades {
        let of = |k| f64::from(unit(hash(i, 5, bits), k));
        let t = 0.12 + 0.88 * (f64::from(i) + of(1)) / f64::from(blades);
        let from = place(t);
        let [cosine, sine] = turn(0.5 * f64::from(i) + 0.31 * of(2) + phase);
        let out = normalised([cosine, sine + 0.7, 0.15 - 0.5 * of(3)]);
        let across = normalised([-sine, cosine, 0.6 * (of(4) - 0.5)]);
        let length = 0.35 + 0.45 * of(5);
        let droop = 0.35 + 0.4 * of(6);
        let ruffle = of(7);
        let path: Vec<Vec3> = (0..=9)
            .map(|k| {
                let s = f64::from(k) / 9.0;
                let [wave, _] = turn(1.6 * s + ruffle);
                let along = times(out, length * s);
                let down = [0.0, 0.0, -droop * length * s * s + 0.03 * wave * s];
                plus(from, plus(along, down))
            })
            .collect();
        let half = 0.030 + 0.025 * of(8);
        let blade = strip(&path, across, |s| {
            half * step(-0.15, 0.25, s) * step(1.15, 0.7, s)
        });
        if t > 0.55 {
            plant.upper.append(&blade)
        } else {
            plant.lower.append(&blade)
        }
    }
    plant
}
