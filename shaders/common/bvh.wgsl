// What rays meet: parallelograms one by one, triangles through a tree without a stack.
// Host: crates/render/src/prepare/{geometry,bvh}.rs (rays in double precision). Checked by:
// crates/render/src/gpu/functions/surfaces.rs.
import package::common::layout::{HAS_GLOSS, HAS_NORMAL_MAPS, HAS_QUADS, HAS_TEXTURES, HAS_TRIANGLES, LEAST_ROUGHNESS, NONE, Spectrum, scene, texels};
import package::common::settings::{node_count, quad_count};
import package::common::tables::{material_dielectric, material_emission, material_gloss, material_maps, material_reflectance, material_spectrum, material_texture, node_at, quad_at, quad_normal, table_row, triangle_corner, triangle_edge_1, triangle_edge_2, triangle_material, triangle_normal_0, triangle_normal_1, triangle_normal_2, triangle_smooth_shaded, triangle_textured, triangle_u_0, triangle_u_1, triangle_u_2, triangle_v_0, triangle_v_1, triangle_v_2};
import package::common::spectrum::{emission_at, reflectance_at};

/// Marks the index of a triangle among the primitives.
const TRIANGLE: u32 = 0x80000000u;
/// The link of a leaf: this mark, the first of its triangles, and in the lowest bits their number.
const LEAF: u32 = 0x80000000u;
const COUNT_BITS: u32 = 4u;
const MOST_IN_LEAF: u32 = 15u;
/// Rounding of a computed point over its coordinates.
const START_ROUNDING: f32 = 1e-6;
/// Of rays to their own surface: below it they carry nothing.
const LEAST_COSINE: f32 = 1e-9;
/// Tolerance of barycentric weights, so that rays do not slip between neighbours.
const EDGE_ROUNDING: f32 = 1e-6;

struct Hit {
    t: f32,
    primitive: u32,
    local: vec2f,
}

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

/// Least distance at which a surface counts for a ray that starts on `start_primitive`. What lies in the plane of that is met
/// anywhere within the rounding of the start, which a grazing ray needs long to get out of.
fn start_distance(origin: vec3f, direction: vec3f, start_primitive: u32) -> f32 {
    if start_primitive == NONE {
        return 0.0;
    }
    let reach = max(abs(origin.x), max(abs(origin.y), abs(origin.z)));
    return START_ROUNDING * reach / max(abs(dot(primitive_normal(start_primitive), direction)), LEAST_COSINE);
}

/// Unit normal of a primitive, on either side.
fn primitive_normal(primitive: u32) -> vec3f {
    if (primitive & TRIANGLE) == 0u {
        return quad_normal(primitive);
    }
    let index = primitive & ~TRIANGLE;
    return normalize(cross(triangle_edge_1(index), triangle_edge_2(index)));
}

fn intersect_quad(index: u32, origin: vec3f, direction: vec3f, t_min: f32, best: Hit) -> Hit {
    let quad = quad_at(index);
    let cosine = dot(quad.normal, direction);
    let offset = quad.centre - origin;
    // A ray within the plane does not meet it.
    if cosine == 0.0 {
        return best;
    }
    let t = dot(quad.normal, offset) / cosine;
    if !(t > t_min && t < best.t) {
        return best;
    }
    let p = t * direction - offset;
    let local = vec2f(dot(p, quad.dual_u), dot(p, quad.dual_v));
    if abs(local.x) > 1.0 || abs(local.y) > 1.0 {
        return best;
    }
    return Hit(t, index, local);
}

/// Möller and Trumbore 1997.
fn intersect_triangle(index: u32, origin: vec3f, direction: vec3f, t_min: f32, best: Hit) -> Hit {
    let corner = triangle_corner(index);
    let edge_1 = triangle_edge_1(index);
    let edge_2 = triangle_edge_2(index);
    let p = cross(direction, edge_2);
    let determinant = dot(edge_1, p);
    if determinant == 0.0 {
        return best;
    }
    let s = origin - corner;
    let u = dot(s, p) / determinant;
    let q = cross(s, edge_1);
    let v = dot(direction, q) / determinant;
    let t = dot(edge_2, q) / determinant;
    let inside = u >= -EDGE_ROUNDING && v >= -EDGE_ROUNDING && u + v <= 1.0 + EDGE_ROUNDING;
    if inside && t > t_min && t < best.t {
        return Hit(t, TRIANGLE | index, vec2f(u, v));
    }
    return best;
}

/// Whether a ray meets a box of the grid before `t_max`; `origin` and `inverse` are the ray's in steps of the grid.
fn meets_box(corners: vec3u, origin: vec3f, inverse: vec3f, t_max: f32) -> bool {
    let low = vec3f(corners & vec3u(0xffffu));
    let high = vec3f(corners >> vec3u(16u));
    let a = (vec3f(low.x, high.x, low.y) - origin) * inverse;
    let b = (vec3f(high.y, low.z, high.z) - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    // Widened by more than the rounding of the products.
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    let leave = min(min(far.x, far.y), min(far.z, t_max)) * 1.000002;
    return enter <= leave;
}

/// 1/x without infinities, which WGSL may take for granted not to happen.
fn inverse_of(direction: vec3f) -> vec3f {
    let tiny = vec3f(1e-20);
    let safe = select(direction, select(tiny, -tiny, direction < vec3f(0.0)), abs(direction) < tiny);
    return 1.0 / safe;
}

/// Nearest surface along the ray closer than `t_max`, which starts on `start_primitive`; `any` stops at the first found.
fn trace(origin: vec3f, direction: vec3f, t_max: f32, start_primitive: u32, any: bool) -> Hit {
    let t_min = start_distance(origin, direction, start_primitive);
    var best = Hit(t_max, NONE, vec2f(0.0));
    if HAS_QUADS {
        for (var i = 0u; i < quad_count(); i++) {
            if i != start_primitive {
                best = intersect_quad(i, origin, direction, t_min, best);
            }
        }
    }
    if !HAS_TRIANGLES || (any && best.primitive != NONE) {
        return best;
    }
    return trace_triangles(origin, direction, t_min, start_primitive, any, best);
}

/// The same among triangles, closer than `before`. Twin: crates/lanes/src/tree.rs.
fn trace_triangles(origin: vec3f, direction: vec3f, t_min: f32, start_primitive: u32, any: bool, before: Hit) -> Hit {
    var best = before;
    let inverse = inverse_of(direction) * scene.grid_step;
    let start = (origin - scene.grid_lower) / scene.grid_step;
    var next = 0u;
    loop {
        // Down to the next leaf that the ray meets, so that lanes of a group look at triangles together.
        var leaf = 0u;
        loop {
            let node = node_at(next);
            let met = meets_box(node.corners, start, inverse, best.t);
            let is_leaf = (node.link & LEAF) != 0u;
            leaf = select(0u, node.link, met && is_leaf);
            next = select(node.link, next + 1u, met || is_leaf);
            if leaf != 0u || next >= node_count() {
                break;
            }
        }
        if leaf != 0u {
            var i = (leaf & ~LEAF) >> COUNT_BITS;
            let end = i + (leaf & MOST_IN_LEAF);
            loop {
                if (TRIANGLE | i) != start_primitive {
                    best = intersect_triangle(i, origin, direction, t_min, best);
                }
                i += 1u;
                if i >= end {
                    break;
                }
            }
        }
        if next >= node_count() || (any && best.primitive != NONE) {
            break;
        }
    }
    return best;
}

fn closest(origin: vec3f, direction: vec3f, t_max: f32, start_primitive: u32) -> Hit {
    return trace(origin, direction, t_max, start_primitive, false);
}

fn occluded(origin: vec3f, direction: vec3f, t_max: f32, start_primitive: u32) -> bool {
    return trace(origin, direction, t_max, start_primitive, true).primitive != NONE;
}

/// Texel `index` of a texture whose first word is `first`: a word of three codes, whose 256 values are before them, or
/// three values. Host: crates/render/src/kernels/tables.rs.
fn texel(first: u32, coded: bool, index: u32) -> Spectrum {
    if coded {
        let codes = texels[first + index];
        let values = first - 256u;
        let r = texels[values + (codes & 255u)];
        let g = texels[values + ((codes >> 8u) & 255u)];
        let b = texels[values + ((codes >> 16u) & 255u)];
        return vec3f(bitcast<f32>(r), bitcast<f32>(g), bitcast<f32>(b));
    }
    let word = first + 3u * index;
    return vec3f(bitcast<f32>(texels[word]), bitcast<f32>(texels[word + 1u]), bitcast<f32>(texels[word + 2u]));
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
    if (hit.primitive & TRIANGLE) == 0u {
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
