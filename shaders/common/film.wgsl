// Where the light of a path is counted: sums per lane, moved to the batch's film when a lane has run to its end.
// Host: crates/render/src/film.rs. Checked by: tests/system/layers.rs.
import package::common::layout::{Spectrum, dispatch, film, scene, sums};
import package::common::settings::film_layers;

/// Layers of the film: daylight, what was not scattered, what has not met a surface, then a layer for each lamp.
const AMBIENT: u32 = 0u;
const DIRECT: u32 = 1u;
const BACKSCATTER: u32 = 2u;

/// The lane at work, and the factor of everything that is added.
var<private> lane: u32;
var<private> share: f32;
/// Sums of the lane in the layers that many paths add to; those of the lamps are in `sums`.
var<private> ambient: Spectrum;
var<private> direct: Spectrum;
var<private> backscatter: Spectrum;
/// Contributions of the lane that were left out.
var<private> lost_light: u32;

fn sum_row(layer: u32) -> u32 {
    return layer * dispatch.lanes + lane;
}

/// Takes the sums of `pixel` up where the last dispatch left them, so that numbers are added in one order however the samples
/// are dealt out to dispatches.
fn load_sums(pixel: u32) {
    ambient = film_at(pixel, AMBIENT);
    direct = film_at(pixel, DIRECT);
    backscatter = film_at(pixel, BACKSCATTER);
    lost_light = 0u;
    for (var layer = 0u; layer < film_layers(); layer++) {
        sums[sum_row(layer)] = vec4f(film_at(pixel, layer), 0.0);
    }
}

fn film_word(pixel: u32, layer: u32) -> u32 {
    return 3u * (pixel * scene.film_layers + layer);
}

fn film_at(pixel: u32, layer: u32) -> Spectrum {
    let word = film_word(pixel, layer);
    return Spectrum(film[word], film[word + 1u], film[word + 2u]);
}

/// Whether sums in single precision can hold a contribution. In double precision: crates/lanes/build/scalar.rs.
fn is_light(light: Spectrum) -> bool {
    return all(light >= Spectrum(0.0)) && all(light < Spectrum(1e30));
}

/// Adds radiance of the source whose layer and level are given, by what happened on its way.
fn add_light(layer: u32, level: f32, met_surface: bool, scattered: bool, radiance: Spectrum) {
    let light = share * radiance;
    // A number that is not one would spoil the pixel for good: left out and counted.
    if !is_light(light) {
        lost_light += 1u;
        return;
    }
    if layer == AMBIENT {
        ambient += light;
    } else {
        sums[sum_row(layer)] += vec4f(light, 0.0);
    }
    direct += select(level * light, Spectrum(0.0), scattered);
    backscatter += select(Spectrum(0.0), level * light, scattered && !met_surface);
}

/// Moves the sums to the film of `pixel`.
fn commit_sums(pixel: u32) {
    for (var layer = 0u; layer < film_layers(); layer++) {
        var sum = sums[sum_row(layer)].xyz;
        if layer == AMBIENT {
            sum = ambient;
        } else if layer == DIRECT {
            sum = direct;
        } else if layer == BACKSCATTER {
            sum = backscatter;
        }
        let word = film_word(pixel, layer);
        film[word] = sum.x;
        film[word + 1u] = sum.y;
        film[word + 2u] = sum.z;
    }
}
