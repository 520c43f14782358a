// How surfaces scatter light: evenly, or, where they have gloss, by GGX microfacets (Walter et al. 2007) over a matt base.
//
// A glossy surface is a mixture of two lobes, one drawn from the facets that are seen (Heitz 2018) and one with the cosine.
// Everything that draws or weighs directions needs the density of that mixture alone; what the surface does beyond it, by
// channel, is a bounded factor of the direction. The matt lobe takes what the facets leave (Ashikhmin and Shirley 2000) and what a
// metal reflects more than once (Kulla and Conty 2017), so that a white surface loses nothing.
// Host: crates/render/src/prepare/gloss.rs (makes the tables). Checked by: tests/system/gloss.rs.
import package::common::surface::SurfacePoint;
import package::common::interface::fresnel_reflectance;
import package::common::layout::{HAS_GLOSS, LEAST_ROUGHNESS, PI, Spectrum, scene};
import package::common::math::{circle, cosine_hemisphere, frame};
import package::common::rng::{uniform_number, unit};
import package::common::tables::{table_f32, table_word};

/// Nodes of the tables of albedos.
const ALBEDO_COSINES: u32 = 24u;
const ALBEDO_ROUGHNESSES: u32 = 16u;
/// Words of a roughness: the albedos, then their mean.
const ALBEDO_STRIDE: u32 = 25u;
/// Cosine of a view along the surface, and the density of directions that are taken to be along it.
const ALONG: f32 = 1e-4;
const LEAST_EVEN: f32 = 1e-6;
/// Least share of directions drawn from either lobe, and least albedo of a glossy surface.
const LEAST_SHARE: f32 = 0.02;
const LEAST_ALBEDO: f32 = 1e-4;

/// A glossy surface as it is seen from one side.
struct Gloss {
    alpha: f32,
    cosine: f32,
    /// Refractive index over that of what is before the surface.
    ratio: f32,
    /// Word of the dielectric's table.
    table: u32,
    /// Factors of what either albedo leaves of light that comes in.
    matt: Spectrum,
    again: Spectrum,
    albedo: Spectrum,
    /// Share of directions that are drawn from the facets.
    share: f32,
}

fn is_glossy(point: SurfacePoint) -> bool {
    return HAS_GLOSS && point.roughness > 0.0;
}

/// Place of a roughness among the nodes, in steps of them.
fn roughness_place(roughness: f32) -> f32 {
    return clamp((roughness - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS), 0.0, 1.0) * f32(ALBEDO_ROUGHNESSES - 1u);
}

/// Entry `i` of every roughness, between those of the nodes around `place`.
fn between_roughnesses(table: u32, i: u32, place: f32) -> f32 {
    let j = min(u32(place), ALBEDO_ROUGHNESSES - 2u);
    let at = table + j * ALBEDO_STRIDE + i;
    return mix(table_f32(at), table_f32(at + ALBEDO_STRIDE), place - f32(j));
}

/// Albedo of the facets seen at `cosine`.
fn facet_albedo(table: u32, place: f32, cosine: f32) -> f32 {
    let steps = sqrt(clamp(cosine, 0.0, 1.0)) * f32(ALBEDO_COSINES - 1u);
    let i = min(u32(steps), ALBEDO_COSINES - 2u);
    return mix(between_roughnesses(table, i, place), between_roughnesses(table, i + 1u, place), steps - f32(i));
}

/// Its mean over the hemisphere.
fn mean_facet_albedo(table: u32, place: f32) -> f32 {
    return between_roughnesses(table, ALBEDO_COSINES, place);
}

/// Schlick's approximation for metals.
fn metal_reflectance(base: Spectrum, cosine: f32) -> Spectrum {
    let x = 1.0 - cosine;
    let x2 = x * x;
    return base + (Spectrum(1.0) - base) * (x2 * x2 * x);
}

fn gloss_of(point: SurfacePoint) -> Gloss {
    let place = roughness_place(point.roughness);
    let cosine = max(dot(point.shading_normal, point.towards), ALONG);
    let ratio = table_f32(point.dielectric);
    let table = table_word(point.dielectric + 1u);
    let metallic = point.metallic;
    let base = point.reflectance;
    let dielectric = facet_albedo(table, place, cosine);
    let mirrors = facet_albedo(scene.mirror_albedos, place, cosine);
    let mirrors_mean = mean_facet_albedo(scene.mirror_albedos, place);
    // A metal's reflectance over all angles, and what it reflects more than once.
    let over_angles = (Spectrum(1.0) + 20.0 * base) / 21.0;
    let more = over_angles * over_angles * mirrors_mean / (Spectrum(1.0) - over_angles * (1.0 - mirrors_mean));
    let below = (1.0 - metallic) * (1.0 - dielectric) * base;
    let again = metallic * (1.0 - mirrors) * more;
    let facets = (1.0 - metallic) * Spectrum(dielectric) + metallic * mirrors * metal_reflectance(base, cosine);
    let even = below + again;
    let sum = facets.x + facets.y + facets.z;
    let share = clamp(sum / max(sum + even.x + even.y + even.z, 1e-20), LEAST_SHARE, 1.0 - LEAST_SHARE);
    let alpha = point.roughness * point.roughness;
    let albedo = max(facets + even, Spectrum(LEAST_ALBEDO));
    return Gloss(
        alpha,
        cosine,
        ratio,
        table,
        below / max(1.0 - mean_facet_albedo(table, place), 1e-6),
        again / max(1.0 - mirrors_mean, 1e-6),
        albedo,
        share,
    );
}

/// Share of light that the surface sends on, by channel: exactly of a matt one, about so of a glossy one.
fn surface_albedo(point: SurfacePoint) -> Spectrum {
    if is_glossy(point) {
        return gloss_of(point).albedo;
    }
    return point.reflectance;
}

fn masking(alpha: f32, cosine: f32) -> f32 {
    let tan2 = max(1.0 - cosine * cosine, 0.0) / (cosine * cosine);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

/// Density with which light that leaves along `towards` is drawn from the facets.
fn facet_pdf(point: SurfacePoint, gloss: Gloss, towards: vec3f) -> f32 {
    let f = frame(point.shading_normal);
    let half = normalize(point.towards + towards);
    let up = dot(half, point.shading_normal);
    let slopes = vec2f(dot(half, f.u), dot(half, f.v)) / gloss.alpha;
    let stretched = dot(slopes, slopes) + up * up;
    let facets = 1.0 / (PI * gloss.alpha * gloss.alpha * stretched * stretched);
    return facets / (4.0 * gloss.cosine * (1.0 + masking(gloss.alpha, gloss.cosine)));
}

/// Density with which a surface sends walks on towards `towards`, 1/sr.
fn surface_pdf(point: SurfacePoint, towards: vec3f) -> f32 {
    if dot(point.normal, towards) <= 0.0 {
        return 0.0;
    }
    let even = max(dot(point.shading_normal, towards), 0.0) / PI;
    if !is_glossy(point) || even <= LEAST_EVEN {
        return even;
    }
    let gloss = gloss_of(point);
    return gloss.share * facet_pdf(point, gloss, towards) + (1.0 - gloss.share) * even;
}

/// What light from `towards` that the surface sends on has beyond `surface_pdf` and `surface_albedo`.
fn surface_factor(point: SurfacePoint, towards: vec3f) -> Spectrum {
    if !is_glossy(point) {
        return Spectrum(1.0);
    }
    let cosine = dot(point.shading_normal, towards);
    let even = max(cosine, 0.0) / PI;
    if even <= LEAST_EVEN {
        return Spectrum(0.0);
    }
    let gloss = gloss_of(point);
    let facets = facet_pdf(point, gloss, towards);
    let half = normalize(point.towards + towards);
    let incidence = clamp(dot(half, towards), 0.0, 1.0);
    let own = masking(gloss.alpha, gloss.cosine);
    let seen = (1.0 + own) / (1.0 + own + masking(gloss.alpha, cosine));
    let dielectric = fresnel_reflectance(incidence, 1.0, gloss.ratio);
    let reflected = (1.0 - point.metallic) * Spectrum(dielectric) + point.metallic * metal_reflectance(point.reflectance, incidence);
    let place = roughness_place(point.roughness);
    let left = gloss.matt * (1.0 - facet_albedo(gloss.table, place, cosine));
    let again = gloss.again * (1.0 - facet_albedo(scene.mirror_albedos, place, cosine));
    let light = facets * seen * reflected + even * (left + again);
    return light / ((gloss.share * facets + (1.0 - gloss.share) * even) * gloss.albedo);
}

/// A direction with the density `surface_pdf`; it may be on the wrong side, where that is 0.
fn surface_direction(point: SurfacePoint, bits: u32, v: f32) -> vec3f {
    if !is_glossy(point) {
        return cosine_hemisphere(point.shading_normal, unit(bits), v);
    }
    let gloss = gloss_of(point);
    if uniform_number() >= gloss.share {
        return cosine_hemisphere(point.shading_normal, unit(bits), v);
    }
    return facet_direction(point, gloss.alpha, unit(bits), v);
}

/// Reflected at a facet that is seen.
fn facet_direction(point: SurfacePoint, alpha: f32, u: f32, v: f32) -> vec3f {
    let f = frame(point.shading_normal);
    let view = vec3f(dot(point.towards, f.u), dot(point.towards, f.v), max(dot(point.towards, point.shading_normal), ALONG));
    let stretched = normalize(vec3f(alpha * view.xy, view.z));
    let across = dot(stretched.xy, stretched.xy);
    var first = vec3f(1.0, 0.0, 0.0);
    if across > 1e-12 {
        first = vec3f(-stretched.y, stretched.x, 0.0) / sqrt(across);
    }
    let second = cross(stretched, first);
    let azimuth = circle(v);
    let p = sqrt(u) * azimuth.x;
    let part = 0.5 * (1.0 + stretched.z);
    let q = (1.0 - part) * sqrt(max(1.0 - p * p, 0.0)) + part * sqrt(u) * azimuth.y;
    let rest = sqrt(max(1.0 - p * p - q * q, 0.0));
    let facet = p * first + q * second + rest * stretched;
    let half = normalize(vec3f(alpha * facet.xy, max(facet.z, 1e-12)));
    let world = half.x * f.u + half.y * f.v + half.z * point.shading_normal;
    return normalize(2.0 * dot(point.towards, world) * world - point.towards);
}
