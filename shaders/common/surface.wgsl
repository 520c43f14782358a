// The surface where a ray meets it: normals, textures and what the material says there.
// Host: crates/render/src/prepare/geometry.rs, scene/texture.rs, kernels/tables.rs (texels). Checked by:
// crates/render/src/gpu/functions/surfaces.rs, tests/system/gloss.rs.
import package::common::bvh::{Hit, TRIANGLE, is_quad, primitive_normal};
import package::common::layout::{HAS_GLOSS, HAS_NORMAL_MAPS, HAS_TEXTURES, LEAST_ROUGHNESS, NONE, Spectrum, scene, texels};
import package::common::spectrum::{emission_at, reflectance_at};
import package::common::tables::{material_dielectric, material_emission, material_gloss, material_maps, material_reflectance, material_spectrum, material_texture, quad_at, table_row, triangle_edge_1, triangle_edge_2, triangle_material, triangle_normal_0, triangle_normal_1, triangle_normal_2, triangle_smooth_shaded, triangle_textured, triangle_u_0, triangle_u_1, triangle_u_2, triangle_v_0, triangle_v_1, triangle_v_2};

struct SurfacePoint {
    normal: vec3f,
    shading_normal: vec3f,
    reflectance: Spectrum,
    emission: Spectrum,
    material: u32,
    /// Roughness; 0 of a Lambertian surface.
    roughness: f32,
    metallic: f32,
    /// Word of the dielectric that it is where it is seen from, and the unit direction from where.
    dielectric: u32,
    towards: vec3f,
}

/// Cosine of the angle between a shading normal and the direction to the eye below which a glossy surface has the geometric one.
const LEAST_FACING: f32 = 1e-3;

/// Texel `index` of a texture whose first word is `first`: a word of three codes, whose 256 values are before them, or
/// three values. Host: crates/render/src/kernels/tables.rs. Without a branch, whose sides drivers would compile wherever a texture is read.
fn texel(first: u32, coded: bool, index: u32) -> Spectrum {
    let codes = vec3u(texels[first + index]) >> vec3u(0u, 8u, 16u);
    let words = select(first + 3u * index + vec3u(0u, 1u, 2u), first - 256u + (codes & vec3u(255u)), vec3<bool>(coded));
    return bitcast<vec3f>(vec3u(texels[words.x], texels[words.y], texels[words.z]));
}

/// Texel before and after a coordinate in texels, repeating.
fn neighbours(x: f32, size: u32) -> vec2u {
    let below = floor(x);
    let before = select(min(u32(max(below, 0.0)), size - 1u), size - 1u, below < 0.0);
    return vec2u(before, select(before + 1u, 0u, before + 1u == size));
}

/// Texture `index` at (u, v), coordinates repeating. Twin: crates/render/src/scene/texture.rs.
fn sample_texture(index: u32, uv: vec2f) -> Spectrum {
    let record = table_row(scene.texture_table + index);
    let first = record.x;
    let width = record.y;
    let height = record.z;
    let texel_uv = (uv - floor(uv)) * vec2f(f32(width), f32(height));
    let coded = (record.w & 2u) != 0u;
    if (record.w & 1u) == 0u {
        let column = min(u32(texel_uv.x), width - 1u);
        let row = min(u32(texel_uv.y), height - 1u);
        return texel(first, coded, row * width + column);
    }
    let at = texel_uv - 0.5;
    let columns = neighbours(at.x, width);
    let rows = neighbours(at.y, height) * width;
    let s = at - floor(at);
    let upper = mix(texel(first, coded, rows.x + columns.x), texel(first, coded, rows.x + columns.y), s.x);
    let lower = mix(texel(first, coded, rows.y + columns.x), texel(first, coded, rows.y + columns.y), s.x);
    return mix(upper, lower, s.y);
}

fn facing(normal: vec3f, direction: vec3f) -> vec3f {
    return select(normal, -normal, dot(normal, direction) > 0.0);
}

/// Normal, reflectance and emission at a hit of a ray that travels along `direction`.
fn surface_point(hit: Hit, direction: vec3f) -> SurfacePoint {
    var normal: vec3f;
    var shading: vec3f;
    var material: u32;
    var uv = vec2f(0.0);
    var textured = true;
    if is_quad(hit.primitive) {
        let quad = quad_at(hit.primitive);
        normal = facing(quad.normal, direction);
        shading = normal;
        material = quad.material;
        uv = vec2f((1.0 + hit.local.x) * quad.tiles_u, (1.0 - hit.local.y) * quad.tiles_v);
    } else {
        let index = hit.primitive & ~TRIANGLE;
        let v = hit.local.x;
        let w = hit.local.y;
        let u = 1.0 - v - w;
        normal = facing(primitive_normal(hit.primitive), direction);
        shading = normal;
        if triangle_smooth_shaded(index) != 0u {
            let blend = u * triangle_normal_0(index) + v * triangle_normal_1(index) + w * triangle_normal_2(index);
            if dot(blend, blend) > 0.0 {
                let smooth_normal = normalize(blend);
                shading = select(smooth_normal, -smooth_normal, dot(smooth_normal, normal) < 0.0);
            }
        }
        material = triangle_material(index);
        textured = triangle_textured(index) != 0u;
        uv = u * vec2f(triangle_u_0(index), triangle_v_0(index))
            + v * vec2f(triangle_u_1(index), triangle_v_1(index))
            + w * vec2f(triangle_u_2(index), triangle_v_2(index));
    }
    var reflectance = material_reflectance(material);
    var emission = material_emission(material);
    var roughness = 0.0;
    var metallic = 0.0;
    if HAS_GLOSS {
        let gloss = material_gloss(material);
        roughness = gloss.x;
        metallic = gloss.y;
    }
    if HAS_TEXTURES {
        if textured {
            let texture = material_texture(material);
            if texture != NONE {
                reflectance *= sample_texture(texture, uv);
            }
            if any(emission != Spectrum(0.0)) {
                let light = material_maps(material).x;
                if light != NONE {
                    emission *= sample_texture(light, uv);
                }
            }
            if HAS_GLOSS {
                let factors = material_maps(material).y;
                if factors != NONE {
                    let texel = sample_texture(factors, uv);
                    roughness *= texel.y;
                    metallic *= texel.z;
                }
            }
            if HAS_NORMAL_MAPS {
                let map = material_maps(material);
                if map.z != NONE {
                    let scale = vec3f(vec2f(bitcast<f32>(map.w)), 1.0);
                    let own = scale * (2.0 * sample_texture(map.z, uv) - 1.0);
                    shading = bent_normal(hit.primitive & ~TRIANGLE, normal, shading, own);
                }
            }
        }
    }
    if HAS_GLOSS {
        roughness = select(0.0, max(roughness, LEAST_ROUGHNESS), material_gloss(material).x >= 0.0);
    }
    return SurfacePoint(normal, shading, reflectance, emission, material, roughness, metallic, 0u, vec3f(0.0));
}

/// The normal of a map on a triangle, given to the right and upwards in its texture and out of the surface; on the side of
/// `normal`, as `smooth_normal` is.
fn bent_normal(index: u32, normal: vec3f, smooth_normal: vec3f, own: vec3f) -> vec3f {
    let u = vec2f(triangle_u_1(index), triangle_u_2(index)) - triangle_u_0(index);
    let v = vec2f(triangle_v_1(index), triangle_v_2(index)) - triangle_v_0(index);
    // What is seen from behind is turned over as a whole.
    let side = select(1.0, -1.0, dot(cross(triangle_edge_1(index), triangle_edge_2(index)), normal) < 0.0);
    let turned = select(1.0, -1.0, u.x * v.y - u.y * v.x < 0.0);
    let front = side * smooth_normal;
    let along = turned * (triangle_edge_1(index) * v.y - triangle_edge_2(index) * v.x);
    let right = along - dot(along, front) * front;
    let length2 = dot(right, right);
    if !(length2 > 0.0) {
        return smooth_normal;
    }
    let tangent = right / sqrt(length2);
    // v runs downwards in the texture.
    let upwards = -turned * cross(front, tangent);
    let bent = side * (own.x * tangent + own.y * upwards + own.z * front);
    let bent2 = dot(bent, bent);
    if !(bent2 > 0.0) || dot(bent, normal) <= 0.0 {
        return smooth_normal;
    }
    return bent / sqrt(bent2);
}

/// The surface at a hit, at the wavelengths of the sample, seen through the air or not.
fn lit_point(hit: Hit, direction: vec3f, in_air: bool) -> SurfacePoint {
    var point = surface_point(hit, direction);
    point.reflectance = reflectance_at(point.reflectance, material_spectrum(point.material));
    point.emission = emission_at(point.emission);
    if HAS_GLOSS {
        point.dielectric = material_dielectric(point.material, in_air);
        point.towards = -direction;
        if point.roughness > 0.0 && dot(point.shading_normal, point.towards) < LEAST_FACING {
            point.shading_normal = point.normal;
        }
    }
    return point;
}
