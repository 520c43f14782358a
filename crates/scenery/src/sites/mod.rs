//! Places with relief for the shipped scenes: what is near and what is far stand in one picture.
//!
//! `shapes` (heights, tubes, lumps, bushes) → a file per place → `gltf_writer::site_glb_bytes`, with pictures that stand in
//! `textures/` beside the folder of the scenes.

mod harbour_wall;
mod hull_side;
mod kelp;
mod pier;
mod pipeline;
mod reef;
mod shapes;

use super::mesh::{Mesh, Vec3};

/// Parts with their surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Name and stem of the file.
    pub name: &'static str,
    /// What stands there.
    pub parts: Vec<SitePart>,
}

/// A mesh with one surface, at its places.
#[derive(Clone, Debug, PartialEq)]
pub struct SitePart {
    /// Name of the nodes.
    pub name: &'static str,
    /// Geometry.
    pub mesh: Mesh,
    /// Stem of the texture's file, and what it is multiplied by.
    pub skin: (&'static str, [f32; 3]),
    /// Where it stands.
    pub places: Vec<Place>,
}

/// Where a mesh stands, how it is turned about the vertical, and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its origin, m.
    pub at_m: Vec3,
    /// Turn about +z, as a share of a whole one.
    pub turn: f64,
    /// Factor of its size.
    pub size: f64,
}

/// As it was made.
const HERE: Place = Place {
    at_m: [0.0; 3],
    turn: 0.0,
    size: 1.0,
};
/// A texture as it is.
const AS_IT_IS: [f32; 3] = [1.0; 3];

/// All places.
pub fn all(seed: u32) -> [Site; 6] {
    [
        reef::reef(seed),
        pier::pier(seed),
        hull_side::hull_side(seed),
        pipeline::pipeline(seed),
        kelp::kelp(seed),
        harbour_wall::harbour_wall(seed),
    ]
}

/// Shapes of a kind by number, and places that are dealt out to them.
struct Dealt<const N: usize> {
    shapes: [Mesh; N],
    places: [Vec<Place>; N],
}

impl<const N: usize> Dealt<N> {
    fn new(shape: impl Fn(u32) -> Mesh) -> Self {
        Self {
            shapes: std::array::from_fn(|i| shape(i as u32)),
            places: std::array::from_fn(|_| Vec::new()),
        }
    }

    fn put(&mut self, bits: u32, place: Place) {
        self.places[bits as usize % N].push(place);
    }

    fn all(self) -> impl Iterator<Item = (Mesh, Vec<Place>)> {
        self.shapes.into_iter().zip(self.places)
    }
}

impl Site {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            parts: Vec::new(),
        }
    }

    fn with(self, name: &'static str, mesh: Mesh, texture: &'static str, factor: [f32; 3]) -> Self {
        self.with_many(name, [(mesh, vec![HERE])], (texture, factor))
    }

    /// Several shapes of a kind, each at its places.
    fn with_many(
        mut self,
        name: &'static str,
        shapes: impl IntoIterator<Item = (Mesh, Vec<Place>)>,
        skin: (&'static str, [f32; 3]),
    ) -> Self {
        let some = shapes.into_iter().filter(|(_, places)| !places.is_empty());
        self.parts.extend(some.map(|(mesh, places)| SitePart {
            name,
            mesh,
            skin,
            places,
        }));
        self
    }
}
