// What rays meet: parallelograms one by one, triangles through a tree without a stack.
// Host: crates/render/src/prepare/{geometry,bvh}.rs (rays in double precision). Checked by:
// crates/render/src/gpu/functions/surfaces.rs.
import package::common::layout::{HAS_QUADS, HAS_TRIANGLES, NONE, scene};
import package::common::settings::{node_count, quad_count};
import package::common::tables::{node_at, quad_at, quad_normal, triangle_corner, triangle_edge_1, triangle_edge_2};

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

/// Least distance at which a surface counts for a ray that starts on `start_primitive`. What lies in the plane of that is met
/// anywhere within the rounding of the start, which a grazing ray needs long to get out of.
fn start_distance(origin: vec3f, direction: vec3f, start_primitive: u32) -> f32 {
    if start_primitive == NONE {
        return 0.0;
    }
    let reach = max(abs(origin.x), max(abs(origin.y), abs(origin.z)));
    return START_ROUNDING * reach / max(abs(dot(primitive_normal(start_primitive), direction)), LEAST_COSINE);
}

/// Whether a primitive is a parallelogram; where the scene has but one kind, that is known beforehand.
fn is_quad(primitive: u32) -> bool {
    return HAS_QUADS && (!HAS_TRIANGLES || (primitive & TRIANGLE) == 0u);
}

/// Unit normal of a primitive, on either side.
fn primitive_normal(primitive: u32) -> vec3f {
    if is_quad(primitive) {
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
