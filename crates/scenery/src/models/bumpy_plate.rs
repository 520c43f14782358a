//! The bumpy plate of the benchmark.

use crate::mesh::{Mesh, Vec3, Vertex, normalised};
use crate::tile::Tile;

/// Edge length of a tile, m, and its cells along each edge.
const TILE_M: f64 = 2.0;
const CELLS: u32 = 56;
/// Tiles along each edge of the plate.
const TILES: i32 = 4;
/// Height of the bumps, m, and size of the largest, m.
const BUMP_M: f64 = 0.03;
const FEATURE_M: f32 = 0.4;

/// A tile, 2 m × 2 m around the origin, that faces -x (up is +z) and continues itself on all sides: 6272 triangles.
/// Its texture coordinates run once over it.
pub fn bumpy_tile(seed: u32) -> Mesh {
    let tile = Tile {
        size_m: TILE_M as f32,
        seed,
    };
    let step_m = TILE_M / f64::from(CELLS);
    // The first and the last vertices of a row are the same place of the next tile.
    let bump_m = |column: u32, row: u32| {
        let at = [column, row].map(|i| (f64::from(i % CELLS) * step_m) as f32);
        BUMP_M * f64::from(tile.fbm(at, FEATURE_M, 3, 501))
    };
    let vertex = |column: u32, row: u32| {
        let slope = |after: f64, before: f64| (after - before) / (2.0 * step_m);
        let right = slope(bump_m(column + 1, row), bump_m(column + CELLS - 1, row));
        let down = slope(bump_m(column, row + 1), bump_m(column, row + CELLS - 1));
        let share = [column, row].map(|i| f64::from(i) / f64::from(CELLS));
        // Seen from the front, right is -y and down is -z; bumps stand out towards -x.
        Vertex {
            position: [
                -bump_m(column, row),
                TILE_M * (0.5 - share[0]),
                TILE_M * (0.5 - share[1]),
            ],
            normal: normalised([-1.0, right, down]),
            uv: share,
        }
    };
    Mesh::grid(CELLS + 1, CELLS + 1, vertex, |_, _| true)
}

/// The middles of the tiles that make a plate of 8 m × 8 m around the origin; 100,352 triangles in all.
pub fn bumpy_plate_places() -> Vec<Vec3> {
    let middle = |i: i32| TILE_M * (f64::from(i) - 0.5 * f64::from(TILES - 1));
    (0..TILES)
        .flat_map(|row| (0..TILES).map(move |column| [0.0, middle(column), middle(row)]))
        .collect()
}
