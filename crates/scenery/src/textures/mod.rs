//! Textures of the surfaces that underwater vehicles look at, as pictures of linear reflectance.

mod growth;
mod hull;
mod reef;
mod sediment;
mod structures;

pub use hull::{Plating, plating};
pub use sediment::ripple_height;

use super::colour::{Reflectance, plausible, srgb_code};
use super::tile::{Tile, TilePoint};
use rayon::prelude::*;

/// A surface that the generator can draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pattern {
    /// Matt red antifouling paint with weld seams, rust streaks and peeling patches; few features.
    HullRed,
    /// Rippled sand with pebbles, shells and algae; rich at all scales.
    Seabed,
    /// Cast concrete with board marks, pores, cracks and algae.
    ConcretePier,
    /// Rock under coralline crusts, corals and sponges.
    CoralRock,
    /// Silt with drifted kelp blades.
    KelpSediment,
    /// A steel pile covered in flaking rust.
    RustedPile,
    /// Black antifouling paint with slime, weed and barnacle clusters.
    HullBlackFouled,
    /// Densely packed stones.
    Gravel,
    /// Ribbed pipeline coating with field joints and dusted silt.
    PipelineCoating,
    /// A knotted net over a sandy bottom.
    FishingNet,
    /// Rock or steel under all that grows in the sea.
    Encrusted,
    /// A pale living skin, coloured by what it is multiplied with.
    Polyps,
}

impl Pattern {
    /// What clothes the models of places and is no target.
    pub const OF_SITES: [Self; 2] = [Self::Encrusted, Self::Polyps];

    /// All patterns that are targets.
    pub const ALL: [Self; 10] = [
        Self::HullRed,
        Self::Seabed,
        Self::ConcretePier,
        Self::CoralRock,
        Self::KelpSediment,
        Self::RustedPile,
        Self::HullBlackFouled,
        Self::Gravel,
        Self::PipelineCoating,
        Self::FishingNet,
    ];

    /// Name in file names and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::HullRed => "hull_red",
            Self::Seabed => "seabed",
            Self::ConcretePier => "concrete_pier",
            Self::CoralRock => "coral_rock",
            Self::KelpSediment => "kelp_sediment",
            Self::RustedPile => "rusted_pile",
            Self::HullBlackFouled => "hull_black_fouled",
            Self::Gravel => "gravel",
            Self::PipelineCoating => "pipeline_coating",
            Self::FishingNet => "fishing_net",
            Self::Encrusted => "encrusted",
            Self::Polyps => "polyps",
        }
    }

    /// The target of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|pattern| pattern.name() == name)
    }

    /// Edge length of the tile, m, for which the pattern is meant. 6 m are as wide as what a camera of
    /// 90° sees from 3 m; 3.6 m as what one of 60° sees.
    pub fn tile_m(self) -> f32 {
        match self {
            Self::HullRed | Self::Seabed => 6.0,
            _ => 3.6,
        }
    }

    /// Reflectance at one place of a tile.
    pub fn reflectance_at(self, tile: &Tile, at: TilePoint) -> Reflectance {
        plausible(match self {
            Self::HullRed => hull::red(tile, at),
            Self::Seabed => sediment::seabed(tile, at),
            Self::ConcretePier => structures::concrete_pier(tile, at),
            Self::CoralRock => reef::coral_rock(tile, at),
            Self::KelpSediment => sediment::kelp_sediment(tile, at),
            Self::RustedPile => structures::rusted_pile(tile, at),
            Self::HullBlackFouled => hull::black_fouled(tile, at),
            Self::Gravel => sediment::gravel(tile, at),
            Self::PipelineCoating => structures::pipeline_coating(tile, at),
            Self::FishingNet => structures::fishing_net(tile, at),
            Self::Encrusted => growth::encrusted(tile, at),
            Self::Polyps => growth::polyps(tile, at),
        })
    }

    /// Reflectance of one texel of a tile drawn with `width` × `width` texels: the mean of
    /// 2 × 2 places in it.
    pub fn texel(self, tile: &Tile, width: u32, column: u32, row: u32) -> Reflectance {
        let texel_m = tile.size_m / width as f32;
        let mut sum = [0.0_f32; 3];
        for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let at = [(column as f32 + dx) * texel_m, (row as f32 + dy) * texel_m];
            let reflectance = self.reflectance_at(tile, at);
            (0..3).for_each(|k| sum[k] += 0.25 * reflectance[k]);
        }
        sum
    }

    /// The whole tile drawn with `width` × `width` texels. The result does not depend on the number of threads.
    pub fn draw(self, tile: &Tile, width: u32) -> ReflectanceImage {
        let texels = (0..width)
            .into_par_iter()
            .flat_map_iter(|row| (0..width).map(move |column| self.texel(tile, width, column, row)))
            .collect();
        ReflectanceImage {
            width,
            height: width,
            texels,
        }
    }
}

/// A picture of linear reflectances.
#[derive(Clone, Debug, PartialEq)]
pub struct ReflectanceImage {
    /// Width, texels.
    pub width: u32,
    /// Height, texels.
    pub height: u32,
    /// Linear R, G, B inside [`REFLECTANCE_RANGE`](super::colour::REFLECTANCE_RANGE), row 0 at the top.
    pub texels: Vec<Reflectance>,
}

impl ReflectanceImage {
    /// The picture as 8-bit sRGB, three bytes per texel.
    pub fn srgb_bytes(&self) -> Vec<u8> {
        self.texels
            .iter()
            .flatten()
            .map(|&linear| srgb_code(linear))
            .collect()
    }
}

#[cfg(test)]
mod tests;
