//! Shapes that places are made of.

use crate::mesh::{
    Mesh, Vec3, Vertex, cross, dot, icosphere, minus, normalised, plus, random_direction, times,
    turn,
};
use crate::noise::{hash, unit};
use crate::tile::{Population, Tile};

/// Edge of a texture's tile, m.
pub(super) const TILE_M: f64 = 3.6;

/// Smooth step from 0 to 1 between two values; also falling.
pub(super) fn step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Fractal noise in [-1, 1] over a plane.
pub(super) fn noise(tile: &Tile, at: [f64; 2], feature_m: f64, octaves: u32, salt: u32) -> f64 {
    f64::from(tile.fbm(at.map(|v| v as f32), feature_m as f32, octaves, salt))
}

/// Noise in space: that of its three projections.
pub(super) fn noise_3d(tile: &Tile, p: Vec3, feature_m: f64, octaves: u32, salt: u32) -> f64 {
    let of = |i: usize, j: usize, k: u32| noise(tile, [p[i], p[j]], feature_m, octaves, salt + k);
    (of(0, 1, 0) + of(1, 2, 1) + of(2, 0, 2)) / 1.8
}

/// Crooked crests in [0, 1].
pub(super) fn crests(tile: &Tile, at: [f64; 2], feature_m: f64, salt: u32) -> f64 {
    f64::from(tile.ridged(at.map(|v| v as f32), feature_m as f32, 4, salt))
}

/// How far the lumps of a population stand out at a place, in metres: half balls, where `share` of the places has them.
pub(super) fn lumps(
    tile: &Tile,
    at: [f64; 2],
    (radius_m, spacing_m, salt): ([f32; 2], f32, u32),
    share: f64,
) -> f64 {
    let population = Population {
        spacing_m,
        radius_m,
        elongation: 1.3,
        salt,
    };
    let item = tile.item(at.map(|v| v as f32), population, |_| share as f32);
    item.map_or(0.0, |item| {
        let r = f64::from(item.r);
        f64::from(item.radius_m) * (1.0 - r * r).sqrt()
    })
}

/// A height above the plane over `x_m` and `y_m`, on a grid of about `step_m`, facing up. Textures are laid along
/// the grid's lines, so that slopes do not draw them out.
pub(super) fn ground(
    x_m: [f64; 2],
    y_m: [f64; 2],
    step_m: f64,
    height_m: impl Fn(f64, f64) -> f64,
) -> Mesh {
    let count = |range: [f64; 2]| ((range[1] - range[0]) / step_m).round() as u32 + 1;
    let (columns, rows) = (count(x_m), count(y_m));
    let vertex = |column: u32, row: u32| {
        let x = x_m[0] + (x_m[1] - x_m[0]) * f64::from(column) / f64::from(columns - 1);
        let y = y_m[1] - (y_m[1] - y_m[0]) * f64::from(row) / f64::from(rows - 1);
        let z = height_m(x, y);
        Vertex {
            position: [x, y, z],
            normal: [0.0, 0.0, 1.0],
            uv: [x_m[0] / TILE_M, -y_m[1] / TILE_M],
        }
    };
    let mut mesh = Mesh::grid(columns, rows, vertex, |_, _| true);
    mesh.smooth_normals();
    lay_along(&mut mesh, columns as usize);
    mesh
}

/// A wall that faces -x over `y_m` and `z_m`, on a grid of about `step_m`; `depth_m` is how far it stands towards -x.
pub(super) fn wall(
    y_m: [f64; 2],
    z_m: [f64; 2],
    step_m: f64,
    depth_m: impl Fn(f64, f64) -> f64,
) -> Mesh {
    let count = |range: [f64; 2]| ((range[1] - range[0]) / step_m).round() as u32 + 1;
    let (columns, rows) = (count(y_m), count(z_m));
    // Seen from the front, -y is at the right.
    let vertex = |column: u32, row: u32| {
        let y = y_m[1] - (y_m[1] - y_m[0]) * f64::from(column) / f64::from(columns - 1);
        let z = z_m[1] - (z_m[1] - z_m[0]) * f64::from(row) / f64::from(rows - 1);
        Vertex {
            position: [-depth_m(y, z), y, z],
            normal: [-1.0, 0.0, 0.0],
            uv: [-y_m[1] / TILE_M, -z_m[1] / TILE_M],
        }
    };
    let mut mesh = Mesh::grid(columns, rows, vertex, |_, _| true);
    mesh.smooth_normals();
    lay_along(&mut mesh, columns as usize);
    mesh
}

/// Adds to the texture coordinates of a grid's vertices how far they are along their row and their column.
fn lay_along(mesh: &mut Mesh, columns: usize) {
    for (axis, back) in [(0, 1), (1, columns)] {
        for i in 0..mesh.positions.len() {
            let first = if axis == 0 {
                i % columns == 0
            } else {
                i < columns
            };
            if first {
                continue;
            }
            let way = minus(mesh.positions[i], mesh.positions[i - back]);
            mesh.uvs[i][axis] = mesh.uvs[i - back][axis] + dot(way, way).sqrt() / TILE_M;
        }
    }
}

/// A round body along a path: `radius_m` of the share of a turn and the place along it (0 to 1). Open at its ends.
pub(super) fn tube(path: &[Vec3], sides: u32, radius_m: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let last = path.len() - 1;
    let mut across = [1.0, 0.0, 0.0];
    let mut along_m = 0.0;
    for (i, &centre) in path.iter().enumerate() {
        let ahead = normalised(minus(path[(i + 1).min(last)], path[i.saturating_sub(1)]));
        // The frame turns with the path and no more than that.
        let level = minus(across, times(ahead, dot(across, ahead)));
        across = match dot(level, level) > 1e-6 {
            true => normalised(level),
            false => normalised(cross(ahead, [0.0, 1.0, 0.0])),
        };
        let other = cross(ahead, across);
        if i > 0 {
            let part = minus(centre, path[i - 1]);
            along_m += dot(part, part).sqrt();
        }
        let t = i as f64 / last as f64;
        let about_m = 2.0 * std::f64::consts::PI * radius_m(0.0, t);
        for side in 0..=sides {
            let share = f64::from(side) / f64::from(sides);
            let [cosine, sine] = turn(share);
            let out = plus(times(across, cosine), times(other, sine));
            mesh.push(Vertex {
                position: plus(centre, times(out, radius_m(share, t))),
                normal: out,
                uv: [share * about_m.max(0.2) / TILE_M, along_m / TILE_M],
            });
        }
    }
    let stride = sides + 1;
    for i in 0..last as u32 {
        for side in 0..sides {
            let (here, next) = (i * stride + side, (i + 1) * stride + side);
            mesh.triangles.push([here, here + 1, next + 1]);
            mesh.triangles.push([here, next + 1, next]);
        }
    }
    mesh.smooth_normals();
    close_seam(&mut mesh, sides, stride);
    mesh
}

/// The first and the last row of a round body are the same place: one normal for both.
fn close_seam(mesh: &mut Mesh, sides: u32, stride: u32) {
    for ring in 0..mesh.positions.len() as u32 / stride {
        let [first, last] = [ring * stride, ring * stride + sides].map(|i| i as usize);
        let normal = normalised(plus(mesh.normals[first], mesh.normals[last]));
        (mesh.normals[first], mesh.normals[last]) = (normal, normal);
    }
}

/// A strip along a path, `half_m` wide to both sides of it in the direction `across`, seen from both sides.
pub(super) fn strip(path: &[Vec3], across: Vec3, half_m: impl Fn(f64) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let last = path.len() - 1;
    for (i, &centre) in path.iter().enumerate() {
        let t = i as f64 / last as f64;
        // A middle rib, with both halves bent out of the plane like a gutter.
        let ahead = normalised(minus(path[(i + 1).min(last)], path[i.saturating_sub(1)]));
        let out = normalised(cross(across, ahead));
        for (k, side) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
            let half = half_m(t);
            let bent = if side == 0.0 { 0.0 } else { 0.25 * half };
            let place = plus(centre, plus(times(across, side * half), times(out, bent)));
            mesh.push(Vertex {
                position: place,
                normal: out,
                uv: [0.5 * k as f64 * half / 0.1, 0.3 * i as f64],
            });
        }
    }
    for i in 0..last as u32 {
        for k in 0..2 {
            let (here, next) = (3 * i + k, 3 * i + 3 + k);
            mesh.triangles.push([here, here + 1, next + 1]);
            mesh.triangles.push([here, next + 1, next]);
        }
    }
    mesh.smooth_normals();
    mesh
}

/// A round body with `radii_m` along x, y, z and a rough skin (`rough` as a share of the radius, features of `feature_m`).
pub(super) fn lump(
    centre: Vec3,
    radii_m: Vec3,
    (rough, feature_m): (f64, f64),
    seed: u32,
    subdivisions: u32,
) -> Mesh {
    let tile = Tile { size_m: 8.0, seed };
    let shift = [0, 1, 2].map(|k| 8.0 * f64::from(unit(seed, 40 + k)));
    let mut mesh = icosphere(subdivisions);
    for position in &mut mesh.positions {
        let plain: Vec3 = std::array::from_fn(|k| position[k] * radii_m[k]);
        let at = plus(plain, shift);
        let grown = 1.0 + rough * noise_3d(&tile, at, feature_m, 3, 70);
        *position = plus(centre, times(plain, grown));
    }
    mesh.uvs = (mesh.positions.iter())
        .map(|p| [p[0] + 0.7 * p[2], p[1] + 0.7 * p[2]].map(|v| v / TILE_M))
        .collect();
    mesh.smooth_normals();
    mesh
}

/// A bush of `count` stems from one foot: `length_m` long, `thickness_m` at the foot, spread `spread` (0 upright, 1 to all sides).
pub(super) fn bush(
    foot: Vec3,
    count: u32,
    (length_m, thickness_m): (f64, f64),
    spread: f64,
    seed: u32,
) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count {
        let bits = hash(i, 91, seed);
        let share = |k| f64::from(unit(bits, k));
        let aim = random_direction(bits);
        let ahead = normalised([spread * aim[0], spread * aim[1], 0.35 + 0.65 * share(5)]);
        let length = length_m * (0.6 + 0.4 * share(6));
        let bend = times(random_direction(hash(i, 92, seed)), 0.25 * length);
        let path: Vec<Vec3> = (0..5)
            .map(|k| {
                let t = f64::from(k) / 4.0;
                plus(foot, plus(times(ahead, length * t), times(bend, t * t)))
            })
            .collect();
        mesh.append(&tube(&path, 5, |_, t| thickness_m * (1.0 - 0.55 * t * t)));
        let Some(&tip) = path.last() else { continue };
        mesh.append(&lump(tip, [0.5 * thickness_m; 3], (0.0, 1.0), bits, 0));
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tubes_and_lumps_face_outwards() {
        let path: Vec<Vec3> = (0..6).map(|i| [0.0, 0.0, f64::from(i)]).collect();
        let round = tube(&path, 12, |_, _| 0.5);
        let ball = lump([1.0, 2.0, 3.0], [0.5, 0.7, 0.3], (0.1, 0.2), 3, 2);
        for (mesh, centre) in [(&round, None), (&ball, Some([1.0, 2.0, 3.0]))] {
            for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let middle = centre.unwrap_or([0.0, 0.0, position[2]]);
                assert!(dot(minus(*position, middle), *normal) > 0.0);
            }
        }
    }

    #[test]
    fn ground_faces_up_and_walls_face_their_viewer() {
        let up = ground([0.0, 2.0], [-1.0, 1.0], 0.5, |x, y| 0.1 * x * y);
        assert!(up.normals.iter().all(|n| n[2] > 0.9));
        assert_eq!(up.positions.len(), 25);
        let front = wall([-1.0, 1.0], [0.0, 2.0], 0.5, |y, z| 0.1 * y * z);
        assert!(front.normals.iter().all(|n| n[0] < -0.9));
    }
}
