// What probes make of numbers in (0, 1). Twin: crates/render/src/gpu/twins/mod.rs.
import package::common::math::circle;
import package::common::rng::uniform_number;

/// A unit direction.
fn direction_of(u: f32, v: f32) -> vec3f {
    let up = 2.0 * u - 1.0;
    let across = sqrt(max(1.0 - up * up, 0.0));
    return vec3f(across * circle(v), up);
}

/// A point around the lamps and on both sides of the water surface.
fn in_box(u: vec3f) -> vec3f {
    return vec3f(3.0, 3.0, 8.0) * u - vec3f(0.5, 1.5, 1.5);
}

/// Three random numbers.
fn three_numbers() -> vec3f {
    let x = uniform_number();
    let y = uniform_number();
    return vec3f(x, y, uniform_number());
}
