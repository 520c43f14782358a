// Light of the lamps: a camera walk whose vertices are joined to the lamps by bridges.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::surface::{SurfacePoint, facing};
import package::common::camera::{BOUNDARY, SCATTER, SURFACE, CameraRay, End, end_point};
import package::common::gloss::{surface_albedo, surface_direction, surface_factor, surface_pdf};
import package::common::bvh::primitive_normal;
import package::common::lamp_beam::{LedStart, led, no_led_start};
import package::common::lamp_connect::{connect_lamps, meet_lamps, vertex_count};
import package::common::lamp_flight::{first_end, go_to_scattering, next_end, reflect_at_boundary};
import package::common::lamp_resampling::{Landing, resample_landing};
import package::common::lamp_spot::{is_led_start, no_spot_start, set_spot_start, share_arrival, spot_start};
import package::common::lamp_survival::{land, lit_length2, lit_length2_of, survives};
import package::common::lamp_targets::{NO_NUMBER, choose_targets, target_centre, target_count, targets};
import package::common::lamp_walk::{unfolded, unfolded_direction, walk, walk_drawn, walk_start};
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::{water_at, way_along};
import package::common::layout::{HAS_BEAMS, HAS_GLOSS, HAS_LAYERS, HAS_SCATTERING, HAS_SURFACE, Spectrum, scene};
import package::common::math::turn;
import package::common::medium::{channels_scatter, channels_start, rest_of_start};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::{leading, leading_bits, next_bits, uniform_number};
import package::common::settings::{lamp_strategies, max_events};
import package::common::spectrum::{lamp_ln_sigma, lamp_sigma};
import package::common::subpath::{subpath, subpath_has_room, subpath_leave, subpath_push, subpath_root, subpath_start};
import package::common::tables::lamp_radius;

/// Distance of a surface from a lamp, in optical depths, below which the water between them is joined to the lamp too.
const CLOSE_SURFACE: f32 = 0.6;

/// What a walk does next.
const LOST: u32 = 0u;
/// It has a direction and goes on, if it survives.
const ON_ITS_WAY: u32 = 1u;
/// It stands where it is joined to the lamps: in the water, or where `ground` is.
const IN_WATER: u32 = 2u;
const LANDED: u32 = 3u;

/// The numbers of a walk's first event.
struct First {
    order: f32,
    bits: u32,
    v: f32,
}

var<private> numbers: First;
/// The end of the segment on which the walk landed, and the surface there.
var<private> landed_at: End;
var<private> ground: SurfacePoint;
/// Where the camera ray meets a surface if nothing scatters, and its normal there; none: no normal.
var<private> seen_at: vec3f;
var<private> seen_normal: vec3f;

/// Traces one walk from `ray` whose first segment ends as `first` says.
///
/// A driver may run through all code of a loop's body, whether a lane takes it or not, so that what is seldom needed
/// stands outside of loops, and every function is called from one place.
fn lamp_walk(ray: CameraRay, first: u32) {
    walk_start(ray);
    lit_length2 = lit_length2_of(ray);
    let chooser = leading(6u);
    walk.channels = channels_start(lamp_strategies(), chooser);
    let aim_number = rest_of_start(walk.channels, chooser);
    walk.channels.value *= ray.entry_factor;
    numbers = First(leading(5u), leading_bits(3u), leading(4u));
    subpath_start();
    no_spot_start();
    no_led_start();
    see_surface(ray);
    choose_targets(ray, aim_number);
    var state = arrive(first_end(ray, first));
    var choosing = true;
    loop {
        // To the first landing; after that was chosen, to the walk's end.
        loop {
            if state == IN_WATER || (state == LANDED && !choosing) {
                state = connect_and_turn(state == LANDED);
            }
            state = go_on(state);
            if state == LANDED {
                ground = end_point(landed_at, walk.direction);
            }
            if state == LOST || (state == LANDED && choosing) {
                break;
            }
        }
        if !choosing {
            break;
        }
        choosing = false;
        let landing = resample_landing(ray, first, Landing(state == LANDED, ground));
        ground = landing.point;
        state = select(LOST, LANDED, landing.found);
        if state == LOST {
            break;
        }
        land();
    }
}

fn see_surface(ray: CameraRay) {
    seen_normal = vec3f(0.0);
    if HAS_BEAMS && ray.end.kind == SURFACE {
        seen_at = ray.origin + ray.length * ray.direction;
        seen_normal = facing(primitive_normal(ray.end.primitive), ray.direction);
    }
}

/// Whether bridges are led to beams from where the walk stands; if so, says where that is.
fn start_of_led(on_surface: bool) -> bool {
    if on_surface {
        no_led_start();
    }
    if !is_led_start(on_surface) {
        return false;
    }
    if on_surface {
        led = LedStart(true, walk.origin, true, walk.origin, ground.shading_normal);
    } else {
        led = LedStart(true, walk.origin, false, seen_at, seen_normal);
    }
    return true;
}

/// Flies from scattering to scattering until the walk is joined to the lamps or ends.
fn go_on(start: u32) -> u32 {
    var state = start;
    loop {
        if state == ON_ITS_WAY {
            state = LOST;
            if survives() && walk.events < max_events() {
                state = arrive(next_end(uniform_number()));
            }
        }
        if state != ON_ITS_WAY {
            break;
        }
    }
    return state;
}

/// Takes the walk to the end of its segment.
fn arrive(end: End) -> u32 {
    vertex_count += 1u;
    if end.kind == SURFACE {
        walk.origin += end.t * walk.direction;
        walk.start_primitive = end.primitive;
        landed_at = end;
        return LANDED;
    }
    if HAS_SURFACE && end.kind == BOUNDARY {
        return select(LOST, ON_ITS_WAY, reflect_at_boundary(end.t));
    }
    if !HAS_SCATTERING || end.kind != SCATTER {
        return LOST;
    }
    let way = way_along(walk.origin, walk.direction, end.t, BY_SCATTERING);
    go_to_scattering(end.t, way);
    let here = water_at(walk.origin, BY_SCATTERING);
    if HAS_LAYERS {
        walk.ln_relative = log(here.relative);
    }
    walk.channels = channels_scatter(walk.channels, lamp_sigma(), lamp_ln_sigma(), way.drawn, way.depth, here.ln_b);
    if (!walk.met_surface || subpath.companions) && subpath_has_room() {
        return IN_WATER;
    }
    let bits = next_bits();
    walk.direction = turn(walk.direction, phase_sample_x(bits), uniform_number());
    return ON_ITS_WAY;
}

/// Bridges from where the walk stands, then a new direction.
fn connect_and_turn(on_surface: bool) -> u32 {
    var is_leading = walk.scatterings == 1u && walk.events == 1u;
    if on_surface {
        is_leading = walk.events == 0u;
        if !root_on_surface() {
            return LOST;
        }
    } else {
        subpath_push(unfolded(walk.origin), walk.length, walk_drawn(), walk.ln_relative, walk.reflected);
    }
    let is_start = start_of_led(on_surface);
    connect_lamps(on_surface, is_start, ground, max_events(), select(NO_NUMBER, numbers.order, is_leading));
    var bits = numbers.bits;
    var v = numbers.v;
    if !is_leading {
        bits = next_bits();
        v = uniform_number();
    }
    var scattering_pdf: f32;
    if on_surface {
        walk.direction = surface_direction(ground, bits, v);
        scattering_pdf = surface_pdf(ground, walk.direction);
        if scattering_pdf <= 0.0 {
            return LOST;
        }
        if HAS_GLOSS {
            walk.channels.value *= surface_factor(ground, walk.direction);
        }
    } else {
        let x = phase_sample_x(bits);
        walk.direction = turn(walk.direction, x, v);
        scattering_pdf = phase_value(x);
    }
    subpath_leave(scattering_pdf);
    meet_lamps(scattering_pdf);
    if is_start {
        set_spot_start(on_surface, scattering_pdf);
    } else if on_surface {
        spot_start.is_set = false;
    }
    walk.unscattered = false;
    return ON_ITS_WAY;
}

/// Starts the subpath on the surface where the walk stands; false where nothing is reflected.
fn root_on_surface() -> bool {
    walk.unscattered = walk.unscattered && walk.events == 0u;
    walk.events += 1u;
    walk.met_surface = true;
    walk.channels.value *= surface_albedo(ground);
    if all(walk.channels.value == Spectrum(0.0)) {
        return false;
    }
    let position = unfolded(walk.origin);
    let companions = is_close_to_lamp(position) || is_turned_away(position);
    subpath_root(position, walk.length, walk_drawn(), walk.reflected, companions, walk.unscattered);
    share_arrival(ground);
    return true;
}

/// Whether every lamp lies behind the surface on which the walk stands: bridges would have to go around it, which those of few scatterings
/// seldom do.
fn is_turned_away(position: vec3f) -> bool {
    if !HAS_SCATTERING {
        return false;
    }
    let normal = unfolded_direction(ground.shading_normal);
    for (var i = 0u; i < target_count; i++) {
        if dot(normal, target_centre(targets[i]) - position) > 0.0 {
            return false;
        }
    }
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
