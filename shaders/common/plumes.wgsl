// Clouds in the water: what they count along a way and at a point.
// Host: crates/render/src/prepare/layers.rs. Checked by: tests/system/varying_water.rs.
import package::common::layer_tables::{BY_ATTENUATION, BY_BRIDGE, plume_row};
import package::common::layout::{HAS_PLUMES, INFINITE};
import package::common::settings::plume_count;

const SQRT_HALF_PI: f32 = 1.2533141373155;
const SQRT_HALF: f32 = 0.70710678118655;
/// Exponent of a cloud beyond which nothing of it is left.
const OUT_OF_REACH: f32 = 80.0;

/// The error function within 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26).
fn erf(x: f32) -> f32 {
    let z = min(abs(x), 6.0);
    let t = 1.0 / (1.0 + 0.3275911 * z);
    let p = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    let value = 1.0 - p * exp(-z * z);
    return select(value, -value, x < 0.0);
}

/// Length of the way through a cloud, m, each metre counted by what the cloud is there of its middle.
fn length_in_plume(middle: vec3f, sigma: f32, origin: vec3f, direction: vec3f, length: f32) -> f32 {
    let offset = middle - origin;
    let along = dot(offset, direction);
    let across = offset - along * direction;
    let aside = dot(across, across) / (2.0 * sigma * sigma);
    if aside > OUT_OF_REACH {
        return 0.0;
    }
    let scale = SQRT_HALF / sigma;
    let inside = erf(min(length - along, INFINITE) * scale) + erf(along * scale);
    return max(sigma * SQRT_HALF_PI * exp(-aside) * inside, 0.0);
}

/// What a cloud is at a point of its middle.
fn plume_share(middle: vec3f, sigma: f32, point: vec3f) -> f32 {
    let offset = point - middle;
    return exp(-min(dot(offset, offset) / (2.0 * sigma * sigma), OUT_OF_REACH));
}

/// Drawn length of a way through the clouds.
fn drawn_in_plumes(origin: vec3f, direction: vec3f, length: f32, by: u32) -> f32 {
    if !HAS_PLUMES {
        return 0.0;
    }
    var sum = 0.0;
    for (var i = 0u; i < plume_count(); i++) {
        let place = plume_row(i, 0u);
        let numbers = plume_row(i, 1u);
        let counted = length_in_plume(place.xyz, place.w, origin, direction, length);
        if by == BY_BRIDGE {
            let blurred = length_in_plume(place.xyz, plume_row(i, 2u).x, origin, direction, length);
            sum += numbers.z * counted + numbers.w * blurred;
        } else {
            sum += select(numbers.x, numbers.y, by == BY_ATTENUATION) * counted;
        }
    }
    return sum;
}

/// What the clouds add to the relative number at a point.
fn number_of_plumes(point: vec3f, by: u32) -> f32 {
    if !HAS_PLUMES {
        return 0.0;
    }
    var sum = 0.0;
    for (var i = 0u; i < plume_count(); i++) {
        let place = plume_row(i, 0u);
        let numbers = plume_row(i, 1u);
        let share = plume_share(place.xyz, place.w, point);
        if by == BY_BRIDGE {
            sum += numbers.z * share + numbers.w * plume_share(place.xyz, plume_row(i, 2u).x, point);
        } else {
            sum += select(numbers.x, numbers.y, by == BY_ATTENUATION) * share;
        }
    }
    return sum;
}
