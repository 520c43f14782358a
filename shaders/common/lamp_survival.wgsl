// Russian roulette of a camera walk that looks for lamp light, by what it can still bring.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::camera::{SURFACE, CameraRay};
import package::common::lamp_targets::nearest2_to;
import package::common::lamp_walk::{up_to_free_path, walk};
import package::common::layout::scene;
import package::common::medium::{channels_weight, largest};
import package::common::rng::uniform_number;

/// Volume vertices before which a walk that has met no surface is ended only far from where it has been.
const SURE_VERTICES: u32 = 12u;
/// Roulette sets in where the prospects of a walk fall below the reciprocals of these.
const REACH_IN_WATER: f32 = 3.0;
const REACH_FROM_SURFACE: f32 = 5.0;
/// Roulette of a walk that has met no surface sets in where its prospects fall by this factor below their best.
const FALL: f32 = 10.0;
/// Shares of three lengths of the scene within which a walk is taken to be as close to a lamp as it gets.
const OF_START: f32 = 3.0;
const OF_END: f32 = 0.5;
const OF_RAY: f32 = 0.02;
/// Events after which a walk goes on with a probability of at most 1 - LATE_FALL over their number, so that all come to an end.
const SURE_EVENTS: u32 = 1000u;
const LATE_FALL: f32 = 1.25;
/// Scatterings by which light has come from the lamp, over the square of the lit length in free paths, and their least number; after them walks in
/// water go on with a probability of at most 1 - WATER_FALL over theirs.
const OF_LIT: f32 = 0.2;
const LEAST_ON_ITS_WAY: f32 = 40.0;
const WATER_FALL: f32 = 0.75;

/// Square of the distance from a lamp, m², beyond which prospects fall.
var<private> lit_length2: f32;

/// Russian roulette by what the walk can still bring.
fn survives() -> bool {
    let survival = survival_of_walk(largest(channels_weight(walk.channels)));
    if survival >= 1.0 {
        return true;
    }
    if !(survival > 0.0) || uniform_number() >= survival {
        return false;
    }
    walk.channels.value /= survival;
    return true;
}

/// Probability with which a walk of this weight goes on; 1 or more: for certain. Where free flights are long a walk
/// that has met no surface leaves the lamps behind, and what it brings from there is little beside what it has brought.
fn survival_of_walk(weight: f32) -> f32 {
    let prospects = prospects_of_walk(weight);
    if walk.met_surface {
        return capped_importance(REACH_FROM_SURFACE * prospects);
    }
    walk.best = max(walk.best, prospects);
    let beside_best = FALL * prospects / walk.best;
    if walk.scatterings <= SURE_VERTICES {
        return beside_best;
    }
    return min(min(beside_best, survival_of_long()), capped_importance(REACH_IN_WATER * prospects));
}

/// Probability with which a walk without a surface goes on, however bright it is: light that has diffused to where the walk began has scattered n
/// times with a density of n^(-3/2) at most, once it has had the time to come from the lamp.
fn survival_of_long() -> f32 {
    let scatterings = f32(walk.scatterings);
    let on_its_way = max(LEAST_ON_ITS_WAY, OF_LIT * scene.c_max * scene.c_max * lit_length2);
    return select(1.0, 1.0 - WATER_FALL / scatterings, scatterings > on_its_way);
}

/// The same for a walk before its first surface after many scatterings, whatever it has brought.
fn survival_in_water(weight: f32) -> f32 {
    return capped_importance(REACH_IN_WATER * prospects_of_walk(weight));
}

fn capped_importance(importance: f32) -> f32 {
    return min(importance, select(1.0, 1.0 - LATE_FALL / f32(walk.events), walk.events > SURE_EVENTS));
}

/// Estimate of what a walk of this weight can still bring, relative to what one of weight 1 brings from close to a lamp.
fn prospects_of_walk(weight: f32) -> f32 {
    let nearest2 = nearest2_to(walk.origin);
    return weight * exp(-min(scene.lamp_decay * sqrt(nearest2), 80.0)) / (1.0 + nearest2 / lit_length2);
}

/// Square of the distance from the nearest lamp, m², within which a walk along `ray` is close to it: a length of the
/// scene, so that walks end alike whatever the unit.
fn lit_length2_of(ray: CameraRay) -> f32 {
    let of_ray = OF_RAY * up_to_free_path(ray.length);
    let near = OF_START * OF_START * nearest2_to(ray.origin) + of_ray * of_ray;
    if ray.end.kind != SURFACE {
        return near;
    }
    let of_end2 = OF_END * OF_END * nearest2_to(ray.origin + ray.length * ray.direction);
    return near + of_end2 * exp(-min(4.0 * scene.c_min * sqrt(of_end2), 80.0));
}

/// After the first landing prospects are judged by the lamp's distance from there.
fn land() {
    lit_length2 = max(lit_length2, OF_END * OF_END * nearest2_to(walk.origin));
}
