// The flat water surface: Fresnel, refraction, the mirror.
// Host: crates/media/src/interface.rs. Checked by: crates/render/src/gpu/functions/surfaces.rs.
import package::common::layout::{HAS_REFRACTION, HAS_SURFACE, INFINITE, scene};

/// Share of unpolarised light that is reflected.
fn fresnel_reflectance(cos_i: f32, n_i: f32, n_t: f32) -> f32 {
    let step = (n_t - n_i) * (n_t + n_i);
    if step == 0.0 {
        return 0.0;
    }
    let normal_i = n_i * cos_i;
    let square = normal_i * normal_i + step;
    if square < 0.0 {
        return 1.0;
    }
    let normal_t = sqrt(square);
    let sum = normal_i + normal_t;
    let r_s = step / (sum * sum);
    let cosines = cos_i * normal_t;
    let sines = n_i * (1.0 - cos_i) * (1.0 + cos_i);
    let r_p = r_s * (cosines - sines) / (cosines + sines);
    return min(0.5 * (r_s * r_s + r_p * r_p), 1.0);
}

/// Reflectance for light inside the water, `cosine` > 0 against the vertical.
fn internal_reflectance(cosine: f32) -> f32 {
    if !HAS_REFRACTION {
        return 0.0;
    }
    return fresnel_reflectance(cosine, scene.refractive_index, 1.0);
}

/// Reflectance for light in the air, `cosine` > 0 against the vertical.
fn external_reflectance(cosine: f32) -> f32 {
    if !HAS_REFRACTION {
        return 0.0;
    }
    return fresnel_reflectance(cosine, 1.0, scene.refractive_index);
}

/// Direction in the water of what goes down along `direction` in the air.
fn refract_into_water(direction: vec3f) -> vec3f {
    let across = direction.xy / scene.refractive_index;
    return vec3f(across, -sqrt(max(1.0 - dot(across, across), 0.0)));
}

/// `point` mirrored at the water surface.
fn mirror(point: vec3f) -> vec3f {
    return vec3f(point.xy, 2.0 * scene.surface_height_m - point.z);
}

/// `direction` reflected at the water surface.
fn flip(direction: vec3f) -> vec3f {
    return vec3f(direction.xy, -direction.z);
}

fn is_above(point: vec3f) -> bool {
    return HAS_SURFACE && point.z > scene.surface_height_m;
}

/// Depth below the surface, m; 0 above it or without one.
fn depth_of(point: vec3f) -> f32 {
    if !HAS_SURFACE {
        return 0.0;
    }
    return max(scene.surface_height_m - point.z, 0.0);
}

/// Distance along `direction` from a point in the water to the surface.
fn distance_to_surface(origin: vec3f, direction: vec3f) -> f32 {
    if !HAS_SURFACE || direction.z <= 0.0 {
        return INFINITE;
    }
    return min(max((scene.surface_height_m - origin.z) / direction.z, 0.0), INFINITE);
}
