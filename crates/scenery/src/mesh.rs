//! Triangle meshes in the world frame (+z up, metres) and the shapes that models are made of.

use super::noise::{hash, unit};

/// A point or direction, m.
pub type Vec3 = [f64; 3];

/// An indexed triangle mesh in the world frame: right-handed, +z up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, m.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, one per position.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position, (0, 0) at the upper left corner of the tile; beyond [0, 1]
    /// the tile repeats.
    pub uvs: Vec<[f64; 2]>,
    /// Counter-clockwise triangles, seen from the side that the normals point to.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex with all its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position, m.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: [f64; 2],
}

impl Mesh {
    /// Adds a vertex and returns its index.
    pub fn push(&mut self, vertex: Vertex) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(vertex.position);
        self.normals.push(vertex.normal);
        self.uvs.push(vertex.uv);
        index
    }

    /// A grid of `columns` × `rows` vertices; quads for which `keep(column, row)` is false stay open.
    /// Seen from the front, columns run to the right and rows downwards.
    pub fn grid(
        columns: u32,
        rows: u32,
        vertex: impl Fn(u32, u32) -> Vertex,
        keep: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let mut mesh = Self::default();
        for row in 0..rows {
            for column in 0..columns {
                mesh.push(vertex(column, row));
            }
        }
        for row in 1..rows {
            for column in 1..columns {
                if keep(column - 1, row - 1) {
                    let lower_right = row * columns + column;
                    let upper_right = lower_right - columns;
                    mesh.triangles
                        .push([upper_right - 1, lower_right - 1, lower_right]);
                    mesh.triangles
                        .push([upper_right - 1, lower_right, upper_right]);
                }
            }
        }
        mesh
    }

    /// Adds a flat quad from its corners in counter-clockwise order.
    pub fn push_quad(&mut self, corners: [Vec3; 4]) {
        let normal = normalised(cross(
            minus(corners[1], corners[0]),
            minus(corners[3], corners[0]),
        ));
        const UVS: [[f64; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        let [a, b, c, d] = std::array::from_fn(|i| {
            self.push(Vertex {
                position: corners[i],
                normal,
                uv: UVS[i],
            })
        });
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }

    /// Adds a box given by its centre and its three half edges, which form a right-handed frame.
    pub fn push_box(&mut self, centre: Vec3, [x, y, z]: [Vec3; 3]) {
        for (across, up, out) in [(y, z, x), (z, x, y), (x, y, z)] {
            let (there, here) = (plus(centre, out), minus(centre, out));
            let corner =
                |from: Vec3, s: f64, t: f64| plus(from, plus(times(across, s), times(up, t)));
            self.push_quad(
                [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                    .map(|(s, t)| corner(there, s, t)),
            );
            self.push_quad(
                [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
                    .map(|(s, t)| corner(here, s, t)),
            );
        }
    }

    /// Adds all of another mesh.
    pub fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|index| index + first)));
    }

    /// Replaces the normals by the area-weighted mean of those of the triangles around each vertex.
    pub fn smooth_normals(&mut self) {
        self.normals.fill([0.0; 3]);
        for &triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let area = cross(minus(b, a), minus(c, a));
            for i in triangle {
                self.normals[i as usize] = plus(self.normals[i as usize], area);
            }
        }
        self.normals.iter_mut().for_each(|n| *n = normalised(*n));
    }
}

/// A boulder: an icosahedron, subdivided twice, with flattened sides and lumps. 320 triangles.
pub fn boulder(centre: Vec3, radius_m: f64, seed: u32, uv: impl Fn(Vec3) -> [f64; 2]) -> Mesh {
    let mut mesh = icosphere(2);
    let facets: Vec<Vec3> = (0..9)
        .map(|i| random_direction(hash(i, 17, seed)))
        .collect();
    let stretch: Vec3 = std::array::from_fn(|k| {
        [1.15, 0.95, 0.70][k] * (0.8 + 0.4 * f64::from(unit(seed, 30 + k as u32)))
    });
    for position in &mut mesh.positions {
        // Broken faces: nothing reaches further than 0.8 along a facet's direction.
        let reach = facets
            .iter()
            .map(|f| dot(*f, *position))
            .filter(|&d| d > 0.8)
            .fold(0.8, f64::max);
        let lump = 1.0 + 0.10 * dot(*position, facets[0]) * dot(*position, facets[1]);
        let shape = 0.8 / reach * lump * radius_m;
        *position = plus(
            centre,
            std::array::from_fn(|k| position[k] * shape * stretch[k]),
        );
    }
    mesh.uvs = mesh.positions.iter().map(|&p| uv(p)).collect();
    mesh.smooth_normals();
    mesh
}

/// A unit sphere made of triangles by halving the edges of an icosahedron.
pub fn icosphere(subdivisions: u32) -> Mesh {
    const GOLDEN: f64 = 1.618_033_988_749_895;
    let mut mesh = Mesh::default();
    let push = |mesh: &mut Mesh, position: Vec3| {
        let normal = normalised(position);
        mesh.push(Vertex {
            position: normal,
            normal,
            uv: [0.0, 0.0],
        })
    };
    for (s, t) in [
        (-1.0, GOLDEN),
        (1.0, GOLDEN),
        (-1.0, -GOLDEN),
        (1.0, -GOLDEN),
    ] {
        for position in [[s, t, 0.0], [0.0, s, t], [t, 0.0, s]] {
            push(&mut mesh, position);
        }
    }
    mesh.triangles = faces_by_distance(&mesh.positions);
    for _ in 0..subdivisions {
        let coarse = std::mem::take(&mut mesh.triangles);
        let mut halves = std::collections::HashMap::new();
        for [a, b, c] in coarse {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| {
                let key = (from.min(to), from.max(to));
                *halves.entry(key).or_insert_with(|| {
                    let middle = plus(mesh.positions[from as usize], mesh.positions[to as usize]);
                    push(&mut mesh, middle)
                })
            });
            mesh.triangles
                .extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
    }
    mesh
}

/// The triangles of neighbouring corners of an icosahedron, turned outwards.
fn faces_by_distance(corners: &[Vec3]) -> Vec<[u32; 3]> {
    // Neighbours enclose 63.4° (cosine 0.447), all others more than 116°.
    let near = |i: usize, j: usize| dot(corners[i], corners[j]) > 0.4;
    let mut faces = Vec::new();
    for i in 0..corners.len() {
        for j in i + 1..corners.len() {
            for k in j + 1..corners.len() {
                if near(i, j) && near(j, k) && near(k, i) {
                    let outwards = dot(cross(corners[i], corners[j]), corners[k]) > 0.0;
                    let (j, k) = if outwards { (j, k) } else { (k, j) };
                    faces.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    faces
}

/// A unit vector that belongs to some random bits.
pub fn random_direction(bits: u32) -> Vec3 {
    normalised(std::array::from_fn(|k| {
        2.0 * f64::from(unit(bits, k as u32)) - 1.0
    }))
}

/// Sine and cosine of an angle in [0, 1.6] rad, from their series to within 1e-9.
pub fn quarter_turn(angle_rad: f64) -> (f64, f64) {
    // The standard library leaves the last bits of sin and cos to the platform; files should not depend on it.
    let (mut sine, mut cosine, mut term) = (0.0, 0.0, 1.0);
    for k in 0..16_u32 {
        match k % 4 {
            0 => cosine += term,
            1 => sine += term,
            2 => cosine -= term,
            _ => sine -= term,
        }
        term *= angle_rad / f64::from(k + 1);
    }
    (sine, cosine)
}

/// Cosine and sine of a share of a whole turn.
pub fn turn(share: f64) -> [f64; 2] {
    let quarters = 4.0 * (share - share.floor());
    let whole = quarters as u32;
    let (sine, cosine) = quarter_turn((quarters - f64::from(whole)) * std::f64::consts::FRAC_PI_2);
    match whole {
        0 => [cosine, sine],
        1 => [-sine, cosine],
        2 => [-cosine, -sine],
        _ => [sine, -cosine],
    }
}

/// a + b.
pub fn plus(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] + b[k])
}

/// a − b.
pub fn minus(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|k| a[k] - b[k])
}

/// a · s.
pub fn times(a: Vec3, s: f64) -> Vec3 {
    a.map(|v| v * s)
}

/// Scalar product.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The unit vector of `a`; +z where `a` has no length.
pub fn normalised(a: Vec3) -> Vec3 {
    let length = dot(a, a).sqrt();
    if length > 0.0 {
        times(a, 1.0 / length)
    } else {
        [0.0, 0.0, 1.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume enclosed by a closed mesh, positive when the triangles face outwards.
    fn volume(mesh: &Mesh) -> f64 {
        let corner = |i: u32| mesh.positions[i as usize];
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| dot(corner(a), cross(corner(b), corner(c))) / 6.0)
            .sum()
    }

    #[test]
    fn closed_shapes_enclose_their_volume() {
        let mut cuboid = Mesh::default();
        cuboid.push_box(
            [1.0, 2.0, 3.0],
            [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.5]],
        );
        assert!((volume(&cuboid) - 6.0).abs() < 1e-12);
        let ball = icosphere(2);
        assert_eq!((ball.positions.len(), ball.triangles.len()), (162, 320));
        // An inscribed polyhedron of 320 faces holds a little less than the sphere's 4.19.
        assert!((3.9..4.1888).contains(&volume(&ball)), "{}", volume(&ball));
    }

    #[test]
    fn a_grid_faces_its_front() {
        // Seen from above: x to the right, rows towards -y.
        let up = [0.0, 0.0, 1.0];
        let vertex = |i, j| Vertex {
            position: [f64::from(i), -f64::from(j), 0.0],
            normal: up,
            uv: [0.0, 0.0],
        };
        let mut grid = Mesh::grid(4, 3, vertex, |column, _| column != 1);
        assert_eq!(grid.triangles.len(), 8);
        grid.smooth_normals();
        assert!(grid.normals.iter().all(|&n| n == up));
    }
}
