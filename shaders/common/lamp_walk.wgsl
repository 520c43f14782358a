// The state of a camera walk that looks for lamp light.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::camera::CameraRay;
import package::common::interface::{flip, mirror};
import package::common::layout::{HAS_LAYERS, HAS_SURFACE, NONE, scene};
import package::common::medium::{ChannelSampling, channels_start};

/// Largest length whose square is a number, m.
const LONGEST: f32 = 1e15;

struct Walk {
    origin: vec3f,
    direction: vec3f,
    start_primitive: u32,
    mirrored: bool,
    length: f32,
    /// Where the water varies: what of the length was drawn by scattering (common/layers), and ln of the relative scattering
    /// where the walk scattered last.
    drawn: f32,
    ln_relative: f32,
    reflected: f32,
    scatterings: u32,
    events: u32,
    met_surface: bool,
    unscattered: bool,
    channels: ChannelSampling,
    /// Largest prospects so far, before a surface is met.
    best: f32,
}

var<private> walk: Walk;

fn walk_start(ray: CameraRay) {
    walk = Walk(ray.origin, ray.direction, NONE, false, 0.0, 0.0, 0.0, 1.0, 0u, 0u, false, true, channels_start(1u, 0.5), 0.0);
}

fn unfolded(point: vec3f) -> vec3f {
    if HAS_SURFACE && walk.mirrored {
        return mirror(point);
    }
    return point;
}

fn unfolded_direction(direction: vec3f) -> vec3f {
    return select(direction, flip(direction), HAS_SURFACE && walk.mirrored);
}

/// Drawn length of the walk.
fn walk_drawn() -> f32 {
    return select(walk.length, walk.drawn, HAS_LAYERS);
}

fn up_to_free_path(length: f32) -> f32 {
    return min(length, 1.0 / max(scene.c_min, 1.0 / LONGEST));
}
