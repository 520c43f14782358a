// Numbers of the scene and of the dispatch that conditions depend on. lavapipe (Mesa 22.3) may compile a kernel anew for
// every dispatch, 60 ms each, when a condition depends on uniform buffers alone, so that something is added to these that
// only the lane knows to be nothing. Checked by: tests/system/gpu_conditions.rs.
import package::common::layout::{ONE_LAMP, ONE_QUAD, dispatch, scene};

/// Nothing; of a lane that has been started the compiler cannot tell.
var<private> nothing: u32;

/// Starts lane `id`, of which there are fewer than 2³¹.
fn start_settings(id: u32) {
    nothing = id >> 31u;
}

fn lamp_count() -> u32 {
    return select(scene.lamp_count + nothing, 1u, ONE_LAMP);
}

/// Lamps in the air, whose records follow those of the others.
fn air_lamp_count() -> u32 {
    return scene.air_lamp_count + nothing;
}

/// Groups of lamps that are not in the air; none where these are few.
fn lamp_group_count() -> u32 {
    return scene.lamp_group_count + nothing;
}

fn quad_count() -> u32 {
    return select(scene.quad_count + nothing, 1u, ONE_QUAD);
}

fn node_count() -> u32 {
    return scene.node_count + nothing;
}

fn spot_count() -> u32 {
    return scene.spot_count + nothing;
}

fn layer_count() -> u32 {
    return scene.layer_count + nothing;
}

fn bridge_node_count() -> u32 {
    return scene.bridge_node_count + nothing;
}

fn plume_count() -> u32 {
    return scene.plume_count + nothing;
}

fn film_layers() -> u32 {
    return scene.film_layers + nothing;
}

fn largest_order() -> u32 {
    return scene.largest_order + nothing;
}

fn lamp_strategies() -> u32 {
    return scene.lamp_strategies + nothing;
}

fn ambient_strategies() -> u32 {
    return scene.ambient_strategies + nothing;
}

fn max_events() -> u32 {
    return dispatch.max_events + nothing;
}

/// Iterations of a loop that tells whether a driver has cut the lane's loops.
fn loop_probe() -> u32 {
    return dispatch.loop_probe + nothing;
}

/// Whether a sample counts as made although it does not fit the driver's limit on loops.
fn is_forced() -> bool {
    return (dispatch.forced + nothing) != 0u;
}
