// Adds the newest batch to the held film; a lane takes pixels at equal distances.
// Host: crates/render/src/film.rs (`Row::add`). Checked by: crates/render/src/gpu/functions/picture.rs.
import package::common::picture::{
    DEVIATIONS, FIRST_LAYER, FIXED_LAYERS, TOTAL, batch_at, held_at, hold, levels, picture,
};

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let share = picture.batch_samples / (picture.samples_before + picture.batch_samples);
    for (var pixel = id.x; pixel < picture.pixels; pixel += 64u * groups.x) {
        hold_pixel(pixel, share);
    }
}

/// `share` is that of the batch in all samples.
fn hold_pixel(pixel: u32, share: f32) {
    var total = batch_at(pixel, 0u);
    for (var layer = 0u; layer < picture.film_layers; layer++) {
        let value = batch_at(pixel, layer);
        if layer >= FIXED_LAYERS {
            total += levels[layer - FIXED_LAYERS] * value;
        }
        let plane = FIRST_LAYER + layer;
        let before = held_at(plane, pixel);
        hold(plane, pixel, before + share * (value - before));
    }
    // By deviations, because the difference of two sums of squares would lose its digits.
    let before = held_at(TOTAL, pixel);
    let after = before + share * (total - before);
    hold(TOTAL, pixel, after);
    let spread = picture.batch_samples * (total - before) * (total - after);
    hold(DEVIATIONS, pixel, held_at(DEVIATIONS, pixel) + spread);
}
