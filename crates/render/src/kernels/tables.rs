//! Tables of numbers in rows of four words: phase functions, orders, Sobol numbers, lamps' falloffs, textures, records.
//! Twin: `shaders/common/tables.wgsl`.

use std::ops::Range;

use uw_lanes::scalar::word_of;
use uw_media::phase::CellParts;

use glam::DVec3;

use super::{
    layout::Scene,
    order::OrderLaw,
    words::{Record, narrow},
};
use crate::{
    prepare::{AlbedoTable, DaylightField, Layers},
    sampling::sobol::DIRECTIONS,
    scene::{Texels, Texture, TextureFilter},
};

/// Words of a row.
const WIDTH: usize = 4;
/// Bit of a texture's row: its look-up is bilinear.
const BILINEAR: u32 = 1;
/// Bit of a texture's row: its texels are codes, the 256 values they stand for before them.
const CODED: u32 = 2;

/// A piecewise function: per end the smallest key as bits and the first block; the word of the first block and the row of
/// the first cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellTable {
    pub(super) ends: [u32; 4],
    pub(super) blocks: u32,
    pub(super) cells: u32,
}

/// Rows under construction. Each addition returns its address, that of its first row or, where it says so, of its first word.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    words: Vec<u64>,
    /// The words of each table of relative intensities.
    falloffs: Vec<Range<usize>>,
}

impl Rows {
    /// All words; whole rows of them.
    pub(super) fn finish(mut self) -> Vec<u64> {
        self.next_row();
        self.words
    }

    /// The address of the next row, at which the next word goes.
    pub(super) fn next_row(&mut self) -> u32 {
        self.words
            .resize(self.words.len().next_multiple_of(WIDTH), 0);
        (self.words.len() / WIDTH) as u32
    }

    /// Numbers; their address is that of the first word.
    fn floats(&mut self, values: impl IntoIterator<Item = f64>) -> u32 {
        let address = self.words.len() as u32;
        self.words.extend(values.into_iter().map(word_of));
        address
    }

    /// Records of whole rows.
    pub(super) fn records<T: Record>(&mut self, records: &[T]) -> u32 {
        let address = self.next_row();
        for record in records {
            record.put(&mut self.words);
        }
        address
    }

    /// Whole numbers; their address is that of the first word.
    fn whole(&mut self, values: impl IntoIterator<Item = u32>) -> u32 {
        let address = self.words.len() as u32;
        self.words.extend(values.into_iter().map(u64::from));
        address
    }

    /// A piecewise function.
    pub(super) fn cells(&mut self, parts: &CellParts<'_>) -> CellTable {
        let [(low_key, low_block), (high_key, high_block)] = parts.ends;
        let bits = |key: f64| (key as f32).to_bits();
        let blocks = self.next_row() * WIDTH as u32;
        self.whole(parts.blocks.iter().copied());
        let cells = self.next_row();
        self.floats(parts.cells.iter().flatten().copied());
        CellTable {
            ends: [bits(low_key), low_block, bits(high_key), high_block],
            blocks,
            cells,
        }
    }

    /// ln of the tail of the order law up to the largest order; the address is that of the first word.
    pub(super) fn orders(&mut self, law: &OrderLaw, largest: usize) -> u32 {
        self.floats((0..=largest).map(|k| law.ln_tail(k)))
    }

    /// Direction numbers of the Sobol sequence, 32 per dimension; the address is that of the first word.
    pub(super) fn sobol(&mut self) -> u32 {
        self.whole(DIRECTIONS.iter().flatten().copied())
    }

    /// A table of relative intensities, once for all lamps that have it: those of a vehicle are often alike. The address is that of the first
    /// word.
    pub(super) fn falloff(&mut self, table: &[f64]) -> u32 {
        let words = table.iter().copied().map(word_of);
        let same = |place: &&Range<usize>| {
            words
                .clone()
                .eq(self.words[(*place).clone()].iter().copied())
        };
        if let Some(place) = self.falloffs.iter().find(same) {
            return place.start as u32;
        }
        let address = self.floats(table.iter().copied());
        self.falloffs.push(address as usize..self.words.len());
        address
    }

    /// Small lamps in the image: whole pixels and the rest of the centre, and ln of the range of distances; the address is
    /// that of the first word.
    pub(super) fn spots(&mut self, spots: &[(glam::DVec2, f64)]) -> u32 {
        self.floats(spots.iter().flat_map(|&(centre, octaves)| {
            let whole = centre.floor();
            let rest = centre - whole;
            [whole.x, whole.y, rest.x, rest.y, octaves]
        }))
    }

    /// The field of daylight: rows of decays and greatest depth; of narrow rates; of cosine and sine of the sun's azimuth
    /// and the number of nodes in azimuth; of the places of the four tables, whose entries are three channels and padding.
    /// The tables themselves go to `far`.
    pub(super) fn field(&mut self, field: &DaylightField, far: &mut FarRows) -> u32 {
        let (azimuths, tables) = field.table.parts();
        let address = self.next_row();
        let [r, g, b, _] = field.table.decay_per_m.map(f64::from);
        self.floats([r, g, b, field.table.max_depth_m]);
        let [r, g, b] = field.narrow_rate;
        self.floats([r, g, b, 0.0]);
        let (x, y) = field.sun_azimuth.unwrap_or_default();
        self.floats([x, y]);
        self.whole([azimuths as u32, 0]);
        self.whole(tables.map(|entries| far.records(entries)));
        address
    }

    /// The nodes of water that varies: depth and relative numbers; the same for bridges; its clouds, three rows each: middle
    /// from `origin` and standard deviation, relative numbers, standard deviation of the blurred cloud; unless they go by
    /// wavelength, attenuation and scattering of nodes and clouds.
    pub(super) fn layers(
        &mut self,
        layers: &Layers,
        origin: DVec3,
        by_wavelength: bool,
        record: &mut Scene,
    ) {
        let (nodes, plumes) = layers.relative.split_at(layers.depths_m.len());
        record.layer_table = self.next_row();
        record.layer_count = nodes.len() as u32;
        record.bridge_node_count = layers.bridge.nodes.len() as u32;
        record.plume_count = plumes.len() as u32;
        for (&depth_m, own) in layers.depths_m.iter().zip(nodes) {
            self.floats([depth_m, own.by_scattering, own.by_attenuation, 0.0]);
        }
        for &(depth_m, number) in &layers.bridge.nodes {
            self.floats([depth_m, number, 0.0, 0.0]);
        }
        let clouds = layers.plumes.iter().zip(plumes).zip(&layers.bridge.plumes);
        for ((&(middle, sigma_m), own), bridge) in clouds {
            let [x, y, z] = (middle - origin).to_array();
            self.floats([x, y, z, sigma_m]);
            self.floats([own.by_scattering, own.by_attenuation]);
            self.floats([bridge.in_place, bridge.blurred]);
            self.floats([bridge.blurred_sigma_m, 0.0, 0.0, 0.0]);
        }
        if !by_wavelength {
            record.layer_rows = self.next_row();
            for [r, g, b] in layers.coefficients.iter().flat_map(|own| [own.c, own.b]) {
                self.floats([r, g, b, 0.0]);
            }
        }
    }

    /// Albedos of glossy surfaces; the address is that of the first word.
    pub(super) fn albedos(&mut self, table: &AlbedoTable) -> u32 {
        self.floats(table.0.iter().copied())
    }

    /// Per texture a row of the first word of its texels, its width and height, and [`BILINEAR`] and [`CODED`] or 0.
    pub(super) fn textures(&mut self, textures: &[Texture], texels: &mut Vec<u32>) -> u32 {
        let address = self.next_row();
        for texture in textures {
            let bilinear = match texture.filter {
                TextureFilter::Bilinear => BILINEAR,
                TextureFilter::Nearest => 0,
            };
            let (first, coded) = add_texels(&texture.texels, texels);
            self.whole([first, texture.width, texture.height, bilinear | coded]);
        }
        address
    }
}

/// Large tables under construction, in single precision: whole rows.
#[derive(Clone, Debug, Default)]
pub(super) struct FarRows(Vec<u32>);

impl FarRows {
    /// All rows.
    pub(super) fn finish(self) -> Vec<[u32; WIDTH]> {
        self.0.as_chunks().0.to_vec()
    }

    /// Records of whole rows; the address is that of the first row.
    pub(super) fn records<T: bytemuck::Pod>(&mut self, records: &[T]) -> u32 {
        const { assert!(size_of::<T>().is_multiple_of(4 * WIDTH)) };
        let address = (self.0.len() / WIDTH) as u32;
        self.0.extend_from_slice(bytemuck::cast_slice(records));
        address
    }
}

/// Rows of kernels in single precision.
pub(super) fn narrow_rows(words: &[u64]) -> Vec<[u32; WIDTH]> {
    let rows = words.as_chunks::<WIDTH>().0;
    rows.iter().map(|row| row.map(narrow)).collect()
}

/// Adds texels of 8 bits as the values of all codes and a word of three codes a texel, others as three words a texel.
/// Returns the word of the first texel, and [`CODED`] or 0.
fn add_texels(texels: &Texels, words: &mut Vec<u32>) -> (u32, u32) {
    let Some((codes, values)) = texels.coded() else {
        let first = words.len() as u32;
        words.extend(texels.iter().flatten().map(f32::to_bits));
        return (first, 0);
    };
    words.extend(values.iter().map(|value| value.to_bits()));
    let first = words.len() as u32;
    words.reserve_exact(texels.len());
    words.extend(codes.map(|[r, g, b]| u32::from_le_bytes([r, g, b, 0])));
    (first, CODED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_that_are_alike_share_a_table() {
        let mut rows = Rows::default();
        rows.sobol();
        let first = rows.falloff(&[1.0, 0.5, 0.0]);
        let other = rows.falloff(&[1.0, 0.25, 0.0]);
        assert_ne!(first, other);
        assert_eq!(rows.falloff(&[1.0, 0.5, 0.0]), first);
        assert_eq!(rows.falloff(&[1.0, 0.25, 0.0]), other);
        assert_eq!(rows.words.len() as u32, other + 3);
    }
}
