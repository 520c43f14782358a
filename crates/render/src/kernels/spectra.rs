//! Sets of wavelengths as rows of the large tables. Twin: `shaders/common/spectrum.wgsl`.

use uw_media::Spectrum;

use super::{
    layout::{NONE, Scene},
    tables::FarRows,
};
use crate::prepare::{AtWavelengths, Prepared, WavelengthSets};

/// Rows of a set before those of the lamps. Lights carry the weights of the wavelengths.
const FIXED_ROWS: usize = 10;

/// Adds the rows of all sets, for the lamps in `active`.
pub(super) fn add(sets: &WavelengthSets, active: &[usize], record: &mut Scene, far: &mut FarRows) {
    let rows: Vec<[f32; 4]> = sets
        .sets
        .iter()
        .flat_map(|set| rows_of(set, active))
        .collect();
    record.wavelength_sets = sets.sets.len() as u32;
    record.spectrum_rows = (rows.len() / sets.sets.len().max(1)) as u32;
    record.spectrum_table = far.records(&rows);
    if let Some(first) = sets.sets.first() {
        record.layer_rows = record.spectrum_rows - 2 * first.layers.len() as u32;
    }
}

fn rows_of(set: &AtWavelengths, active: &[usize]) -> Vec<[f32; 4]> {
    let [red, green, blue] = set.primaries;
    let weighted = |light: Spectrum| std::array::from_fn(|k| set.weight[k] * light[k]);
    let fixed: [[f64; 3]; FIXED_ROWS] = [
        set.c,
        set.b,
        set.by_scattering.sigma,
        set.by_attenuation.sigma,
        weighted(set.sun),
        weighted(set.sky),
        set.weight,
        red,
        green,
        blue,
    ];
    let lamps = active.iter().map(|&i| weighted(set.lamps[i]));
    fixed
        .into_iter()
        .chain(lamps)
        .chain(set.reflectances.iter().copied())
        .chain(set.layers.iter().flat_map(|own| [own.c, own.b]))
        .map(|[r, g, b]| [r as f32, g as f32, b as f32, 0.0])
        .collect()
}

/// For each material the row of its own reflectance spectrum, with `lamps` lamps before it, or [`NONE`]; empty without
/// wavelengths.
pub(crate) fn own_spectra(scene: &Prepared, lamps: usize) -> Vec<u32> {
    let Some(sets) = &scene.spectrum else {
        return Vec::new();
    };
    let row = |own: &Option<usize>| own.map_or(NONE, |own| (FIXED_ROWS + lamps + own) as u32);
    sets.own_reflectance.iter().map(row).collect()
}
