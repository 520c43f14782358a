// Where a walk lands: one of several first surface points, by resampled importance sampling (Talbot et al. 2005) for the
// light that they can bring.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::surface::SurfacePoint;
import package::common::camera::{BOUNDARY, NOTHING, SCATTER, SURFACE, CameraRay, End, end_point, no_point};
import package::common::gloss::surface_albedo;
import package::common::lamp_connect::vertex_count;
import package::common::lamp_flight::{SCATTERED, THROUGH, add_length, add_ln_density, free_end, go_to_scattering, reflect_at_boundary};
import package::common::lamp_spot::{is_led_start, no_spot_start, set_spot_start, spot_start};
import package::common::lamp_survival::{SURE_VERTICES, survival_in_water};
import package::common::lamp_targets::{target_centre, target_count, targets};
import package::common::lamp_walk::{unfolded, walk, walk_drawn, walk_start};
import package::common::layer_distance::distance_of;
import package::common::layer_tables::BY_SCATTERING;
import package::common::layers::{drawn_along, water_at, way_along};
import package::common::layout::{HAS_LAYERS, HAS_SCATTERING, HAS_SURFACE, HAS_VARIED_REFLECTANCE, INFINITE, NONE, Spectrum, scene};
import package::common::light::lamp_relative_intensity;
import package::common::math::{expm1, ln_1p, minus_ln, turn};
import package::common::medium::{channels_after, channels_start, channels_weight, one_minus_exp};
import package::common::phase::{phase_sample_x, phase_value};
import package::common::rng::{leading, leading_bits, next_bits, point_index, scramble, scramble_of, uniform_number};
import package::common::settings::{lamp_strategies, max_events};
import package::common::spectrum::{lamp_sigma, water_c, water_ln_b};

/// Candidates beside a walk that falls freely, and of one that surely scatters.
const CANDIDATES: u32 = 3u;
const CANDIDATES_WHERE_CLEAR: u32 = 2u;
/// Stream of their leading numbers.
const STREAM: u32 = 3u;
/// Light that comes from outside a lamp's beam or along a surface, relative to what comes straight.
const INDIRECT: f32 = 0.2;
/// Distance from a lamp, by the length of the walk, below which it is of no account.
const LEAST_OF_WALK: f32 = 1e-3;
/// Least square of a length, m²: its reciprocal is a number.
const LEAST_SQUARE: f32 = 1e-36;

/// Of the candidate at work, where the water varies: optical depth of its ways, and what its scatterings add up to.
var<private> candidate_depth: Spectrum;
var<private> candidate_ln_b: Spectrum;

/// A place on a surface, if there is one.
struct Landing {
    found: bool,
    point: SurfacePoint,
}

/// Candidates pay where surfaces differ.
fn candidate_count(first: u32) -> u32 {
    if !HAS_VARIED_REFLECTANCE || !HAS_SCATTERING || first == THROUGH {
        return 0u;
    }
    return select(CANDIDATES, CANDIDATES_WHERE_CLEAR, first == SCATTERED);
}

/// One of `landing` (of the walk that made bridges, if it met a surface) and the candidates' landings; `walk` is then the one
/// that landed there.
fn resample_landing(ray: CameraRay, first: u32, landing: Landing) -> Landing {
    let count = candidate_count(first);
    if count == 0u {
        return landing;
    }
    var chosen = landing;
    var chosen_walk = walk;
    var chosen_start = spot_start;
    var target_value = 0.0;
    if landing.found {
        target_value = target_function(landing.point);
    }
    var sum = target_value;
    let own_scramble = scramble;
    let own_index = point_index;
    scramble = scramble_of(STREAM);
    var i = 0u;
    loop {
        point_index = own_index * count + i;
        let found = trace_candidate(ray, first);
        if found.found {
            let its_target = target_function(found.point);
            sum += its_target;
            if its_target > 0.0 {
                if uniform_number() * sum < its_target {
                    chosen = found;
                    chosen_walk = walk;
                    chosen_start = spot_start;
                    target_value = its_target;
                }
            }
        }
        i += 1u;
        if i >= count {
            break;
        }
    }
    scramble = own_scramble;
    point_index = own_index;
    walk = chosen_walk;
    spot_start = chosen_start;
    if !(target_value > 0.0) {
        chosen.found = false;
        return chosen;
    }
    walk.channels.value *= sum / f32(count + 1u) / target_value;
    return chosen;
}

/// A walk to the first surface; its weights are found at the end, from its length and its scatterings.
fn trace_candidate(ray: CameraRay, first: u32) -> Landing {
    walk_start(ray);
    no_spot_start();
    candidate_depth = Spectrum(0.0);
    candidate_ln_b = Spectrum(0.0);
    walk.channels = channels_start(lamp_strategies(), uniform_number());
    let sigma = lamp_sigma()[walk.channels.chosen];
    var factor = ray.entry_factor;
    var end = candidate_first_end(ray, first, sigma);
    var bits = leading_bits(3u);
    var v = leading(4u);
    vertex_count += 1u;
    loop {
        if end.kind == SCATTER || end.kind == BOUNDARY {
            factor *= candidate_turn(end, factor, bits, v);
            end.kind = NOTHING;
            if factor > 0.0 {
                end = free_end(distance_of(walk.origin, walk.direction, INFINITE, minus_ln(uniform_number()) / sigma, BY_SCATTERING));
                bits = next_bits();
                v = uniform_number();
                vertex_count += 1u;
            }
        }
        if end.kind == SURFACE || end.kind == NOTHING {
            break;
        }
    }
    if end.kind == NOTHING {
        return Landing(false, no_point());
    }
    add_way(end.t);
    walk.origin += end.t * walk.direction;
    walk.start_primitive = end.primitive;
    walk.channels = channels_after(walk.channels, walk.scatterings, walk_drawn(), depth_so_far(), scattered_so_far());
    walk.channels.value *= factor;
    if first == SCATTERED {
        let depth = lamp_sigma() * drawn_along(ray.origin, ray.direction, ray.length, BY_SCATTERING);
        let within = max(one_minus_exp(depth), Spectrum(1e-30));
        add_ln_density(-log(within));
    }
    return Landing(true, end_point(end, walk.direction));
}

/// Takes the candidate to a scattering or the underside of the water surface, and turns it. Returns the reciprocal of the
/// probability with which it goes on; 0 when it does not.
fn candidate_turn(end: End, factor: f32, bits: u32, v: f32) -> f32 {
    if HAS_SURFACE && end.kind == BOUNDARY {
        add_way(end.t);
        return select(0.0, 1.0, reflect_at_boundary(end.t));
    }
    let way = way_along(walk.origin, walk.direction, end.t, BY_SCATTERING);
    go_to_scattering(end.t, way);
    if HAS_LAYERS {
        candidate_depth += way.depth;
        candidate_ln_b += water_at(walk.origin, BY_SCATTERING).ln_b;
    }
    let survival = candidate_survival(factor);
    if survival == 0.0 {
        return 0.0;
    }
    let x = phase_sample_x(bits);
    walk.direction = turn(walk.direction, x, v);
    if is_led_start(false) {
        set_spot_start(false, phase_value(x));
    }
    return 1.0 / survival;
}

/// The end of the first segment.
fn candidate_first_end(ray: CameraRay, first: u32, sigma: f32) -> End {
    let u = leading(2u);
    let drawn = drawn_along(ray.origin, ray.direction, ray.length, BY_SCATTERING);
    var t = minus_ln(u) / sigma;
    if first == SCATTERED {
        t = min(-ln_1p(u * expm1(-sigma * drawn)) / sigma, drawn);
    } else if t >= drawn {
        return ray.end;
    }
    return End(SCATTER, distance_of(ray.origin, ray.direction, ray.length, t, BY_SCATTERING), NONE, vec2f(0.0));
}

/// Adds a way that goes on from where the candidate is.
fn add_way(t: f32) {
    let way = way_along(walk.origin, walk.direction, t, BY_SCATTERING);
    add_length(t, way);
    if HAS_LAYERS {
        candidate_depth += way.depth;
    }
}

/// Optical depth of the candidate's ways.
fn depth_so_far() -> Spectrum {
    return select(water_c() * walk.length, candidate_depth, vec3<bool>(HAS_LAYERS));
}

/// Sum of the logarithms of the scattering coefficients where the candidate scattered, over those of drawn length.
fn scattered_so_far() -> Spectrum {
    if HAS_LAYERS {
        return candidate_ln_b;
    }
    return select(Spectrum(0.0), f32(walk.scatterings) * water_ln_b(), walk.scatterings > 0u);
}

/// Probability with which the candidate goes on from a scattering; 0 when it does not.
fn candidate_survival(factor: f32) -> f32 {
    if walk.events >= max_events() {
        return 0.0;
    }
    if walk.scatterings <= SURE_VERTICES {
        return 1.0;
    }
    let survival = survival_in_water(factor * exp(-min(scene.a_min * walk.length, 80.0)));
    if survival >= 1.0 {
        return 1.0;
    }
    if !(survival > 0.0) || uniform_number() >= survival {
        return 0.0;
    }
    return survival;
}

/// Estimate of the light that `walk` brings from where it landed; positive wherever there can be any.
fn target_function(point: SurfacePoint) -> f32 {
    let reflected = dot(channels_weight(walk.channels), surface_albedo(point));
    let position = unfolded(walk.origin);
    let least = LEAST_OF_WALK * walk.length;
    let least2 = max(least * least, LEAST_SQUARE);
    var light = 0.0;
    for (var i = 0u; i < target_count; i++) {
        let offset = target_centre(targets[i]) - position;
        let distance2 = max(dot(offset, offset), least2);
        let distance = sqrt(distance2);
        let towards = offset / distance;
        let cosine = max(dot(point.shading_normal, towards), 0.0);
        let beam = lamp_relative_intensity(targets[i].lamp, -towards);
        // From what the pixel sees unscattered only the light that scatters on its way there is this walk's.
        let share = select(1.0, max(-expm1(-scene.b_mean * distance), 1e-3), walk.unscattered);
        let attenuated = exp(-min(scene.c_min * distance, 69.0)) / distance2;
        light += (INDIRECT + beam) * (INDIRECT + cosine) * share * attenuated;
    }
    return reflected * light;
}
