//! The project's models: the side of a ship, a stretch of seabed and a bumpy plate, in the world frame.

mod bumpy_plate;
mod seabed;
mod ship_hull;

pub use bumpy_plate::{bumpy_plate_places, bumpy_tile};
pub use seabed::seabed;
pub use ship_hull::ship_hull;

use super::mesh::Mesh;
use super::textures::Pattern;
use super::tile::Tile;

/// Meshes with their surfaces, ready to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetModel {
    /// Name of the model and stem of its file.
    pub name: &'static str,
    /// Texture tile that the textured parts repeat.
    pub tile: Tile,
    /// Pattern on the tile.
    pub pattern: Pattern,
    /// Parts, each with one surface.
    pub parts: Vec<Part>,
}

/// A mesh with one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name of the node.
    pub name: &'static str,
    /// Geometry.
    pub mesh: Mesh,
    /// Surface.
    pub surface: Surface,
}

/// What a part looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// The model's texture, as it is.
    Textured,
    /// One reflectance, linear R, G, B.
    Plain([f32; 3]),
}

impl AssetModel {
    /// Number of triangles of all parts.
    pub fn triangle_count(&self) -> usize {
        self.parts
            .iter()
            .map(|part| part.mesh.triangles.len())
            .sum()
    }
}
