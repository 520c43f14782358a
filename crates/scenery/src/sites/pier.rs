//! Piles of a pier with growth on them.

use super::shapes::{bush, ground, lump, lumps, noise, noise_3d, step, tube};
use super::{AS_IT_IS, Dealt, Place, Site};
use crate::mesh::{Mesh, Vec3, turn};
use crate::noise::{hash, unit};
use crate::tile::Tile;

/// Places of the piles, m, and where their tops and feet are.
const PILES_M: [[f64; 2]; 5] = [
    [2.2, -0.25],
    [4.4, 1.15],
    [5.2, -1.9],
    [7.4, 0.3],
    [9.0, -2.9],
];
const Z_M: [f64; 2] = [-2.6, 3.4];
const RADIUS_M: f64 = 0.33;

/// Five piles before a camera at the origin that looks along +x, their feet 2.6 m below and their tops 3.4 m above it, on mud.
pub(super) fn pier(seed: u32) -> Site {
    let tile = Tile {
        size_m: 12.0,
        seed: seed ^ 0x91e7,
    };
    let (mut near, mut piles) = (Mesh::default(), Mesh::default());
    let ball = |i: u32| lump([0.0; 3], [1.0, 0.8, 1.1], (0.3, 0.7), tile.seed ^ i, 2);
    let mut mussels = Dealt::<2>::new(|i| {
        lump(
            [0.0; 3],
            [1.0, 0.7, 1.7],
            (0.12, 0.9),
            tile.seed ^ (10 + i),
            2,
        )
    });
    let mut anemones = Dealt::<2>::new(ball);
    let mut sponges = Dealt::<2>::new(|i| ball(i + 2));
    let mut weed = Dealt::<2>::new(|i| bush([0.0; 3], 9, (1.0, 0.02), 0.9, tile.seed ^ (20 + i)));
    for (i, &place) in PILES_M.iter().enumerate() {
        let i = i as u32;
        let rings = if i == 0 { 180 } else { 70 };
        let path: Vec<Vec3> = (0..=rings)
            .map(|k| {
                let t = f64::from(k) / f64::from(rings);
                [place[0], place[1], Z_M[0] + (Z_M[1] - Z_M[0]) * t]
            })
            .collect();
        let skin = |share: f64, t: f64| RADIUS_M + growth_m(&tile, i, share, t);
        let mesh = tube(&path, if i == 0 { 96 } else { 44 }, skin);
        if i == 0 {
            near = mesh
        } else {
            piles.append(&mesh)
        }
        let many = if i == 0 { 900 } else { 260 };
        for k in 0..many {
            let bits = hash(k, 20 + i, tile.seed);
            let share = |j| f64::from(unit(bits, j));
            let (at, t) = (share(1), share(2));
            let [cosine, sine] = turn(at);
            let out = skin(at, t);
            let z = Z_M[0] + (Z_M[1] - Z_M[0]) * t;
            let put = |size: f64| Place {
                at_m: [place[0] + out * cosine, place[1] + out * sine, z],
                turn: at,
                size,
            };
            let small = share(3) * share(4);
            match k % 9 {
                0 => anemones.put(bits, put(0.025 + 0.05 * small)),
                1 => weed.put(bits, put(0.10 + 0.16 * share(3))),
                2 => sponges.put(bits, put(0.02 + 0.05 * small)),
                _ => mussels.put(bits, put(0.010 + 0.018 * share(3))),
            }
        }
    }
    let mud = |x: f64, y: f64| {
        let near = |p: &[f64; 2]| ((x - p[0]).powi(2) + (y - p[1]).powi(2)).sqrt();
        let scour: f64 = PILES_M.iter().map(|p| step(1.1, 0.3, near(p))).sum();
        -2.35 + 0.16 * noise(&tile, [x, y], 1.6, 4, 40) - 0.18 * scour
            + lumps(&tile, [x, y], ([0.03, 0.16], 0.6, 41), 0.5)
    };
    Site::new("pier")
        .with("near_pile", near, "encrusted", AS_IT_IS)
        .with("piles", piles, "encrusted", AS_IT_IS)
        .with_many("mussels", mussels.all(), ("polyps", [0.09, 0.09, 0.11]))
        .with_many("anemones", anemones.all(), ("polyps", [0.62, 0.52, 0.42]))
        .with_many("sponges", sponges.all(), ("polyps", [0.52, 0.30, 0.10]))
        .with_many("weed", weed.all(), ("polyps", [0.17, 0.12, 0.05]))
        .with(
            "mud",
            ground([-0.5, 12.0], [-6.0, 6.0], 0.08, mud),
            "kelp_sediment",
            AS_IT_IS,
        )
}

/// Thickness of the growth, m: most below the tide, worn at the foot.
fn growth_m(tile: &Tile, pile: u32, share: f64, t: f64) -> f64 {
    let [cosine, sine] = turn(share);
    let z = (Z_M[1] - Z_M[0]) * t;
    let p = [
        RADIUS_M * cosine + 2.0 * f64::from(pile),
        RADIUS_M * sine + 2.0,
        z,
    ];
    let thick = step(0.0, 0.25, t) * step(1.0, 0.8, t);
    let around = [
        2.0 * std::f64::consts::PI * RADIUS_M * share + 3.0 * f64::from(pile),
        z,
    ];
    let clumps = lumps(tile, around, ([0.02, 0.09], 0.2, 30), 0.75);
    let rough = noise_3d(tile, p, 0.4, 4, 31);
    0.02 + thick * (0.05 + 0.08 * rough + 0.55 * clumps)
}
