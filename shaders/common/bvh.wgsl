// What rays meet: parallelograms one by one, triangles through a tree without a stack.
// Twins: crates/render/src/prepare/{geometry,bvh}.rs. Checked by: crates/render/src/gpu/twins/surfaces.rs.
import package::common::layout::{HAS_QUADS, HAS_TEXTURES, HAS_TRIANGLES, NONE, Node, materials, nodes, quads, scene, texels, triangles, words};

/// Marks the index of a triangle among the primitives.
const TRIANGLE: u32 = 0x80000000u;
/// Rounding of a computed point over its coordinates.
const START_ROUNDING: f32 = 1e-6;
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
    reflectance: vec3f,
    emission: vec3f,
}

/// Least distance at which a surface counts for a ray that starts on `start_primitive`.
fn start_distance(origin: vec3f, start_primitive: u32) -> f32 {
    let reach = max(abs(origin.x), max(abs(origin.y), abs(origin.z)));
    return select(START_ROUNDING * reach, 0.0, start_primitive == NONE);
}

fn intersect_quad(index: u32, origin: vec3f, direction: vec3f, t_min: f32, best: Hit) -> Hit {
    let cosine = dot(quads[index].normal, direction);
    let offset = quads[index].centre - origin;
    // A ray within the plane does not meet it.
    if cosine == 0.0 {
        return best;
    }
    let t = dot(quads[index].normal, offset) / cosine;
    if !(t > t_min && t < best.t) {
        return best;
    }
    let p = t * direction - offset;
    let local = vec2f(dot(p, quads[index].dual_u), dot(p, quads[index].dual_v));
    if abs(local.x) > 1.0 || abs(local.y) > 1.0 {
        return best;
    }
    return Hit(t, index, local);
}

/// Möller and Trumbore 1997.
fn intersect_triangle(index: u32, origin: vec3f, direction: vec3f, t_min: f32, best: Hit) -> Hit {
    let edge_1 = triangles[index].edge_1;
    let edge_2 = triangles[index].edge_2;
    let p = cross(direction, edge_2);
    let determinant = dot(edge_1, p);
    if determinant == 0.0 {
        return best;
    }
    let s = origin - triangles[index].corner;
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

fn meets_box(node: u32, origin: vec3f, inverse: vec3f, t_max: f32) -> bool {
    let a = (nodes[node].lower - origin) * inverse;
    let b = (nodes[node].upper - origin) * inverse;
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
    let t_min = start_distance(origin, start_primitive);
    var best = Hit(t_max, NONE, vec2f(0.0));
    if HAS_QUADS {
        for (var i = 0u; i < scene.quad_count; i++) {
            if i != start_primitive {
                best = intersect_quad(i, origin, direction, t_min, best);
            }
        }
    }
    if !HAS_TRIANGLES || (any && best.primitive != NONE) {
        return best;
    }
    let inverse = inverse_of(direction);
    var node = 0u;
    while node < scene.node_count {
        if !meets_box(node, origin, inverse, best.t) {
            node = nodes[node].skip;
            continue;
        }
        let first = nodes[node].first;
        let end = first + nodes[node].count;
        for (var i = first; i < end; i++) {
            if (TRIANGLE | i) != start_primitive {
                best = intersect_triangle(i, origin, direction, t_min, best);
            }
        }
        if any && best.primitive != NONE {
            return best;
        }
        node += 1u;
    }
    return best;
}

fn closest(origin: vec3f, direction: vec3f, t_max: f32, start_primitive: u32) -> Hit {
    return trace(origin, direction, t_max, start_primitive, false);
}

fn occluded(origin: vec3f, direction: vec3f, t_max: f32, start_primitive: u32) -> bool {
    return trace(origin, direction, t_max, start_primitive, true).primitive != NONE;
}

fn texel(place: u32) -> vec3f {
    return vec3f(texels[3u * place], texels[3u * place + 1u], texels[3u * place + 2u]);
}

/// Texel before and after a coordinate in texels, repeating.
fn neighbours(x: f32, size: u32) -> vec2u {
    let below = floor(x);
    let before = select(min(u32(max(below, 0.0)), size - 1u), size - 1u, below < 0.0);
    return vec2u(before, select(before + 1u, 0u, before + 1u == size));
}

/// Texture `index` at (u, v), coordinates repeating. Twin: crates/render/src/scene/texture.rs.
fn sample_texture(index: u32, uv: vec2f) -> vec3f {
    let record = scene.texture_table + 4u * index;
    let first = words[record];
    let width = words[record + 1u];
    let height = words[record + 2u];
    let place = (uv - floor(uv)) * vec2f(f32(width), f32(height));
    if words[record + 3u] == 0u {
        let column = min(u32(place.x), width - 1u);
        let row = min(u32(place.y), height - 1u);
        return texel(first + row * width + column);
    }
    let at = place - 0.5;
    let columns = neighbours(at.x, width);
    let rows = neighbours(at.y, height) * width;
    let s = at - floor(at);
    let upper = mix(texel(first + rows.x + columns.x), texel(first + rows.x + columns.y), s.x);
    let lower = mix(texel(first + rows.y + columns.x), texel(first + rows.y + columns.y), s.x);
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
        let index = hit.primitive;
        normal = facing(quads[index].normal, direction);
        shading = normal;
        material = quads[index].material;
        uv = vec2f((1.0 + hit.local.x) * quads[index].tiles_u, (1.0 - hit.local.y) * quads[index].tiles_v);
    } else {
        let index = hit.primitive & ~TRIANGLE;
        let v = hit.local.x;
        let w = hit.local.y;
        let u = 1.0 - v - w;
        normal = facing(normalize(cross(triangles[index].edge_1, triangles[index].edge_2)), direction);
        shading = normal;
        if triangles[index].smooth_shaded != 0u {
            let blend = u * triangles[index].normal_0 + v * triangles[index].normal_1 + w * triangles[index].normal_2;
            if dot(blend, blend) > 0.0 {
                let smooth_normal = normalize(blend);
                shading = select(smooth_normal, -smooth_normal, dot(smooth_normal, normal) < 0.0);
            }
        }
        material = triangles[index].material;
        textured = triangles[index].textured != 0u;
        uv = u * vec2f(triangles[index].u_0, triangles[index].v_0)
            + v * vec2f(triangles[index].u_1, triangles[index].v_1)
            + w * vec2f(triangles[index].u_2, triangles[index].v_2);
    }
    var reflectance = materials[material].reflectance;
    if HAS_TEXTURES {
        if textured && materials[material].texture != NONE {
            reflectance *= sample_texture(materials[material].texture, uv);
        }
    }
    return SurfacePoint(normal, shading, reflectance, materials[material].emission);
}
