// The picture of the held film on the screen: exposure, noise, colours, clipping, encoding, rounding to counts of 8 bits.
// Host: crates/render/src/sensor.rs (`Sensor::expose`) and crates/viewer/src/model/display.rs (`photograph`). Checked
// by: crates/render/src/gpu/functions/picture.rs.
import package::common::layout::Spectrum;
import package::common::noise::standard_normal;
import package::common::picture::{TOTAL, held_at, picture, shown};

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var pixel = id.x; pixel < picture.pixels; pixel += 64u * groups.x) {
        let radiance = held_at(TOTAL, pixel);
        var signal = Spectrum(0.0);
        for (var k = 0u; k < 3u; k++) {
            signal[k] = noisy(radiance[k] * picture.exposure, 3u * pixel + k);
        }
        let counts = Spectrum(
            count(dot(picture.red, signal)),
            count(dot(picture.green, signal)),
            count(dot(picture.blue, signal))
        );
        let pixel_xy = vec2u(pixel % picture.width, pixel / picture.width);
        textureStore(shown, pixel_xy, vec4f(counts / 255.0, 1.0));
    }
}

/// The linear signal with noise. `index` counts channels of pixels row by row.
fn noisy(signal: f32, index: u32) -> f32 {
    let variance = picture.noise_a * max(signal, 0.0) + picture.noise_b;
    if variance == 0.0 {
        return signal;
    }
    return signal + sqrt(variance) * standard_normal(vec2u(picture.noise_low, picture.noise_high), index);
}

/// The count of a linear signal, 0 to 255.
fn count(linear: f32) -> f32 {
    var signal = clamp(linear, 0.0, 1.0);
    if picture.srgb != 0u {
        signal = srgb(signal);
    }
    if picture.bits == 16u {
        // The upper byte of what is stored, as screens show it.
        return floor(floor(65535.0 * signal + 0.5) / 257.0);
    }
    return floor(255.0 * signal + 0.5);
}

fn srgb(linear: f32) -> f32 {
    if linear <= 0.0031308 {
        return 12.92 * linear;
    }
    return 1.055 * pow(linear, 1.0 / 2.4) - 0.055;
}
