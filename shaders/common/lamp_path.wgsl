// Light of the lamps: a camera walk whose vertices are joined to the lamps by bridges.
// Twin: crates/render/src/integrator/cpu/lamp_path.rs. Checked by: tests/system/gpu.rs.
import package::common::bvh::SurfacePoint;
import package::common::camera::{BOUNDARY, CameraRay, End, SCATTER, SURFACE, no_point};
import package::common::lamp_join::{join_lamps, meet_lamps, vertex_count};
import package::common::lamp_landing::{Landing, choose_landing};
import package::common::lamp_walk::{choose_targets, first_end, go_to_scattering, next_end, reflect_at_boundary, survives, target_centre, target_count, targets, unfolded, walk, walk_start};
import package::common::layout::{HAS_SCATTERING, PI, dispatch, scene};
import package::common::math::{cosine_hemisphere, turn};
import package::common::medium::{rest_of_start, spectral_scatter, spectral_start};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::{leading, leading_bits, next_bits, uniform_number};
import package::common::settings::{lamp_strategies, max_events};
import package::common::tables::lamp_radius;
import package::common::ways::{trail, trail_leave, trail_push, trail_root, trail_start};

/// Distance of a surface from a lamp, in optical depths, below which the water between them is joined to the lamp too.
const CLOSE_SURFACE: f32 = 0.6;

/// Traces one walk from `ray` whose first segment ends as `first` says.
fn lamp_walk(ray: CameraRay, first: u32) {
    walk_start(ray);
    let chooser = leading(6u);
    walk.spectral = spectral_start(lamp_strategies(), chooser);
    let aim_number = rest_of_start(walk.spectral, chooser);
    walk.spectral.value *= ray.entry_factor;
    trail_start();
    choose_targets(ray, aim_number);
    var at_start = true;
    // Whether the first landing is still to be chosen. Every function is called from one place, because compilers copy
    // what is called from several.
    var choosing = true;
    var alive = walk.events < max_events();
    while alive || choosing {
        var landing = Landing(false, no_point());
        if alive {
            var end: End;
            if at_start {
                end = first_end(ray, first);
                at_start = false;
            } else {
                end = next_end(uniform_number());
            }
            vertex_count += 1u;
            alive = false;
            if end.kind == SCATTER {
                alive = scatter(end.t);
            } else if end.kind == SURFACE {
                walk.origin += end.t * walk.direction;
                walk.start_primitive = end.primitive;
                landing = Landing(true, end.point);
            } else if end.kind == BOUNDARY {
                alive = reflect_at_boundary(end.t);
            }
        }
        if choosing && (landing.found || !alive) {
            choosing = false;
            landing = choose_landing(ray, first, landing);
        }
        if landing.found {
            alive = meet_surface(landing.point);
        }
        if alive {
            alive = survives() && walk.events < max_events();
        }
    }
}

/// A scattering after `t`: bridges if no surface was met, then a new direction.
fn scatter(t: f32) -> bool {
    if !HAS_SCATTERING {
        return false;
    }
    go_to_scattering(t);
    walk.spectral = spectral_scatter(walk.spectral, scene.lamp_sigma, scene.lamp_ln_sigma, t);
    let is_leading = walk.scatterings == 1u && walk.events == 1u;
    let joined = !walk.met_surface || trail.companions;
    if joined {
        if trail.count >= dispatch.slots {
            atomicAdd(&counters.cut_paths, 1u);
            return false;
        }
        trail_push(unfolded(walk.origin), walk.length, walk.reflected);
        join_lamps(false, no_point(), max_events(), is_leading);
    }
    var bits: u32;
    var v: f32;
    if is_leading {
        bits = leading_bits(3u);
        v = leading(4u);
    } else {
        bits = next_bits();
        v = uniform_number();
    }
    let x = phase_sample_x(bits);
    walk.direction = turn(walk.direction, x, v);
    if joined {
        let lobe = phase_value(x);
        trail_leave(lobe);
        meet_lamps(lobe);
    }
    return true;
}

/// A surface: bridges to every aimed, then a new direction.
fn meet_surface(point: SurfacePoint) -> bool {
    let is_leading = walk.events == 0u;
    walk.unscattered = walk.unscattered && is_leading;
    walk.events += 1u;
    walk.met_surface = true;
    walk.spectral.value *= point.reflectance;
    if all(walk.spectral.value == vec3f(0.0)) {
        return false;
    }
    let position = unfolded(walk.origin);
    trail_root(position, walk.length, walk.reflected, is_close_to_lamp(position), walk.unscattered);
    join_lamps(true, point, max_events(), is_leading);
    var u: f32;
    var v: f32;
    if is_leading {
        u = leading(3u);
        v = leading(4u);
    } else {
        u = uniform_number();
        v = uniform_number();
    }
    walk.direction = cosine_hemisphere(point.shading_normal, u, v);
    if dot(walk.direction, point.normal) <= 0.0 {
        return false;
    }
    let lobe = dot(point.shading_normal, walk.direction) / PI;
    trail_leave(lobe);
    meet_lamps(lobe);
    walk.unscattered = false;
    return true;
}

/// Whether a lamp is so close to a surface point, in free paths, that bridges alone would have a heavy tail there.
fn is_close_to_lamp(position: vec3f) -> bool {
    if !HAS_SCATTERING {
        return false;
    }
    for (var i = 0u; i < target_count; i++) {
        let gap = distance(target_centre(targets[i]), position) - lamp_radius(targets[i].lamp);
        if gap * scene.c_max < CLOSE_SURFACE {
            return true;
        }
    }
    return false;
}
