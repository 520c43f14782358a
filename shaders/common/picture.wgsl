// The film that a graphics adapter holds while a render goes on, and what it makes of it without the host. Plane after
// plane, three channels per pixel: the mean of the total, the sum of its squared deviations over the batches (weighted
// by their samples), then the means of ambient, direct, backscatter and each lamp at 100 %.
// Host: crates/render/src/film.rs and crates/render/src/gpu/held.rs. Checked by:
// crates/render/src/gpu/functions/picture.rs.
import package::common::layout::Spectrum;

/// Planes of the held film.
const TOTAL: u32 = 0u;
const DEVIATIONS: u32 = 1u;
const FIRST_LAYER: u32 = 2u;
/// Layers of a batch before those of the lamps; twin: common/film.
const FIXED_LAYERS: u32 = 3u;

struct PictureTask {
    mean: Spectrum,
    pixels: u32,
    width: u32,
    film_layers: u32,
    samples_before: f32,
    batch_samples: f32,
    batches: f32,
    exposure: f32,
    srgb: u32,
    bits: u32,
    noise_a: f32,
    noise_b: f32,
    noise_low: u32,
    noise_high: u32,
    /// What red, green and blue become of the signal with noise.
    red: Spectrum,
    padding_1: u32,
    green: Spectrum,
    padding_2: u32,
    blue: Spectrum,
    padding_3: u32,
}

@group(0) @binding(0) var<uniform> picture: PictureTask;
/// Sums of the newest batch, as the kernels leave them.
@group(0) @binding(1) var<storage, read> batch: array<f32>;
/// Level of each lamp, 1 at 100 %.
@group(0) @binding(2) var<storage, read> levels: array<f32>;
@group(0) @binding(3) var<storage, read_write> held: array<f32>;
/// Sums over the pixels of a workgroup.
@group(0) @binding(4) var<storage, read_write> partial_sums: array<vec4f>;
@group(0) @binding(5) var shown: texture_storage_2d<rgba8unorm, write>;

fn held_at(plane: u32, pixel: u32) -> Spectrum {
    let word = 3u * (plane * picture.pixels + pixel);
    return Spectrum(held[word], held[word + 1u], held[word + 2u]);
}

fn hold(plane: u32, pixel: u32, value: Spectrum) {
    let word = 3u * (plane * picture.pixels + pixel);
    held[word] = value.x;
    held[word + 1u] = value.y;
    held[word + 2u] = value.z;
}

/// Mean of layer `layer` of the newest batch at `pixel`.
fn batch_at(pixel: u32, layer: u32) -> Spectrum {
    let word = 3u * (pixel * picture.film_layers + layer);
    return Spectrum(batch[word], batch[word + 1u], batch[word + 2u]) / picture.batch_samples;
}
