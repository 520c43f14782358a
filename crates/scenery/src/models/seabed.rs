//! A stretch of seabed.

use super::{AssetModel, Part, Surface};
use crate::mesh::{Mesh, Vec3, Vertex, boulder, normalised};
use crate::noise::{hash, unit};
use crate::textures::{Pattern, ripple_height};
use crate::tile::Tile;

/// Edge length of the seabed, m, and number of grid vertices along it.
const SEABED_M: f64 = 12.0;
const SEABED_VERTICES: u32 = 206;
const BOULDERS: u32 = 26;

/// A stretch of seabed, 12 m × 12 m around the origin, facing +z: ripples, mounds and boulders.
pub fn seabed(seed: u32) -> AssetModel {
    let bed = Seabed {
        tile: Tile {
            size_m: Pattern::Seabed.tile_m(),
            seed,
        },
    };
    AssetModel {
        name: "seabed",
        tile: bed.tile,
        pattern: Pattern::Seabed,
        parts: vec![
            Part {
                name: "sand",
                mesh: bed.sand(),
                surface: Surface::Textured,
            },
            Part {
                name: "boulders",
                mesh: bed.boulders(),
                surface: Surface::Textured,
            },
        ],
    }
}

struct Seabed {
    tile: Tile,
}

impl Seabed {
    /// Place on the texture: x to the right, y of the texture downwards, both from the upper left corner.
    fn uv(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        [x_m + 0.5 * SEABED_M, 0.5 * SEABED_M - y_m].map(|m| m / f64::from(self.tile.size_m))
    }

    /// Height of the sand, m.
    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let [u, v] = self.uv(x_m, y_m);
        let size_m = self.tile.size_m;
        let at = [u as f32 * size_m, v as f32 * size_m];
        let ripple_m = 0.014 * ripple_height(&self.tile, at);
        // Mounds twice as long as the tile, so that the relief does not repeat with the texture.
        let wide = Tile {
            size_m: 2.0 * size_m,
            seed: self.tile.seed ^ 0x77,
        };
        f64::from(ripple_m + 0.20 * wide.fbm(at, 3.0, 3, 401) + 0.02 * wide.fbm(at, 0.45, 2, 402))
    }

    fn sand(&self) -> Mesh {
        let step_m = SEABED_M / f64::from(SEABED_VERTICES - 1);
        let vertex = |column: u32, row: u32| {
            let x = -0.5 * SEABED_M + step_m * f64::from(column);
            let y = 0.5 * SEABED_M - step_m * f64::from(row);
            let slope = |dx: f64, dy: f64| {
                (self.height_m(x + dx, y + dy) - self.height_m(x - dx, y - dy)) / step_m
            };
            let normal = normalised([-slope(0.5 * step_m, 0.0), -slope(0.0, 0.5 * step_m), 1.0]);
            Vertex {
                position: [x, y, self.height_m(x, y)],
                normal,
                uv: self.uv(x, y),
            }
        };
        Mesh::grid(SEABED_VERTICES, SEABED_VERTICES, vertex, |_, _| true)
    }

    fn boulders(&self) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..BOULDERS {
            let bits = hash(i, 5, self.tile.seed);
            let share = |index| f64::from(unit(bits, index));
            let radius_m = 0.08 + 0.32 * share(1) * share(2);
            let [x, y] = [share(3), share(4)].map(|s| (s - 0.5) * (SEABED_M - 1.2));
            let centre = [x, y, self.height_m(x, y) + 0.15 * radius_m];
            // Seen from the side the texture runs on with the height, so that it is not drawn out.
            let uv = |p: Vec3| self.uv(p[0] + 0.7 * p[2], p[1] + 0.7 * p[2]);
            mesh.append(&boulder(centre, radius_m, bits, uv));
        }
        mesh
    }
}
