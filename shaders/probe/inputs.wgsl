// What probes make of numbers in (0, 1).
// Host: crates/render/src/gpu/functions/mod.rs.
import package::common::math::circle;

/// A unit direction.
fn direction_of(u: f32, v: f32) -> vec3f {
    let up = 2.0 * u - 1.0;
    let across = sqrt(max(1.0 - up * up, 0.0));
    return vec3f(across * circle(v), up);
}
