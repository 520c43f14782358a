// Where the light of a path is counted: sums per lane, moved to the film when a lane has run to its end.
// Twins: crates/render/src/integrator/cpu/score.rs and crates/render/src/film.rs. Checked by: tests/system/gpu.rs.
import package::common::layout::{counters, dispatch, film, scene, sums};

/// Layers of the film before those of the lamps.
const AMBIENT: u32 = 0u;
const DIRECT: u32 = 1u;
const BACKSCATTER: u32 = 2u;

/// The lane at work, and the factor of everything that is added.
var<private> lane: u32;
var<private> share: f32;

fn sum_place(layer: u32) -> u32 {
    return 3u * (layer * dispatch.lanes + lane);
}

fn clear_sums() {
    for (var layer = 0u; layer < scene.film_layers; layer++) {
        let place = sum_place(layer);
        sums[place] = 0.0;
        sums[place + 1u] = 0.0;
        sums[place + 2u] = 0.0;
    }
}

fn add_to(layer: u32, radiance: vec3f) {
    let place = sum_place(layer);
    sums[place] += radiance.x;
    sums[place + 1u] += radiance.y;
    sums[place + 2u] += radiance.z;
}

/// Adds radiance of the source whose layer and level are given, by what happened on its way.
fn add_light(layer: u32, level: f32, met_surface: bool, scattered: bool, radiance: vec3f) {
    let light = share * radiance;
    // A number that is not one would spoil the pixel for good: left out and counted.
    if !(all(light >= vec3f(0.0)) && all(light < vec3f(1e30))) {
        atomicAdd(&counters.not_finite, 1u);
        return;
    }
    add_to(layer, light);
    if !scattered {
        add_to(DIRECT, level * light);
    } else if !met_surface {
        add_to(BACKSCATTER, level * light);
    }
}

/// Moves the sums to the film of `pixel`, times `weight`.
fn commit_sums(pixel: u32, weight: f32) {
    for (var layer = 0u; layer < scene.film_layers; layer++) {
        let from_place = sum_place(layer);
        let to_place = 3u * (pixel * scene.film_layers + layer);
        film[to_place] += weight * sums[from_place];
        film[to_place + 1u] += weight * sums[from_place + 1u];
        film[to_place + 2u] += weight * sums[from_place + 2u];
    }
}
