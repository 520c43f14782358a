//! Tables of numbers in one buffer of words: phase functions, orders, Sobol numbers, lamps' falloffs, textures.

use uw_media::phase::{CellParts, PhaseTable};

use crate::{
    integrator::{cpu::order::OrderLaw, sampling::sobol::DIRECTIONS},
    prepare::DaylightField,
    scene::{Texture, TextureFilter},
};

/// Words under construction; each addition returns the place of its first word.
#[derive(Clone, Debug, Default)]
pub(super) struct Words(pub(super) Vec<u32>);

impl Words {
    fn place(&self) -> u32 {
        self.0.len() as u32
    }

    fn floats(&mut self, values: impl IntoIterator<Item = f64>) -> u32 {
        let place = self.place();
        self.0
            .extend(values.into_iter().map(|v| (v as f32).to_bits()));
        place
    }

    /// Value and inverse CDF of a phase function.
    pub(super) fn phase(&mut self, table: &PhaseTable) -> (u32, u32) {
        let [value, sample] = table.parts();
        (self.cells(&value), self.cells(&sample))
    }

    /// Per end the smallest key as bits and the first block, then the places of blocks and cells, and these.
    fn cells(&mut self, parts: &CellParts<'_>) -> u32 {
        const HEADER: u32 = 6;
        let place = self.place();
        let blocks = place + HEADER;
        let cells = blocks + parts.blocks.len() as u32;
        for (key, first_block) in parts.ends {
            self.0.extend([(key as f32).to_bits(), first_block]);
        }
        self.0.extend([blocks, cells]);
        self.0.extend_from_slice(parts.blocks);
        self.floats(parts.cells.iter().flatten().copied());
        place
    }

    /// ln of the tail of the order law up to the largest order.
    pub(super) fn orders(&mut self, law: &OrderLaw, largest: usize) -> u32 {
        self.floats((0..=largest).map(|k| law.ln_tail(k)))
    }

    /// Direction numbers of the Sobol sequence, 32 per dimension.
    pub(super) fn sobol(&mut self) -> u32 {
        let place = self.place();
        self.0.extend(DIRECTIONS.iter().flatten());
        place
    }

    /// A table of relative intensities.
    pub(super) fn falloff(&mut self, table: &[f64]) -> u32 {
        self.floats(table.iter().copied())
    }

    /// Small lamps in the image: whole pixels and the rest of the centre, and ln of the range of distances.
    pub(super) fn spots(&mut self, spots: &[(glam::DVec2, f64)]) -> u32 {
        self.floats(spots.iter().flat_map(|&(centre, octaves)| {
            let whole = centre.floor();
            let rest = centre - whole;
            [whole.x, whole.y, rest.x, rest.y, octaves]
        }))
    }

    /// The field of daylight: greatest depth, decays, narrow rates, cosine and sine of the sun's azimuth, number of nodes in
    /// azimuth and the places of the four tables, whose entries are three channels and padding.
    pub(super) fn field(&mut self, field: &DaylightField) -> u32 {
        let (azimuths, tables) = field.table.parts();
        let tables = tables.map(|entries| {
            let place = self.place();
            self.0
                .extend(entries.as_flattened().iter().map(|v| v.to_bits()));
            place
        });
        let (x, y) = field.sun_azimuth.unwrap_or_default();
        let [r, g, b, _] = field.table.decay_per_m.map(f64::from);
        let place = self.floats([field.table.max_depth_m, r, g, b]);
        self.floats(field.narrow_rate);
        self.floats([x, y]);
        self.0.push(azimuths as u32);
        self.0.extend(tables);
        place
    }

    /// Per texture: first texel, width, height, and 1 for a bilinear one; and all texels.
    pub(super) fn textures(&mut self, textures: &[Texture]) -> (u32, Vec<f32>) {
        let place = self.place();
        let mut texels = Vec::new();
        for texture in textures {
            let first = (texels.len() / 3) as u32;
            let bilinear = u32::from(texture.filter == TextureFilter::Bilinear);
            self.0
                .extend([first, texture.width, texture.height, bilinear]);
            texels.extend(texture.texels.iter().flatten());
        }
        (place, texels)
    }
}
