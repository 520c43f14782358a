// Lens, its opening, and port of the camera: from image points to rays.
// Host: crates/render/src/scene/{lens,port}.rs. Checked by: crates/render/src/gpu/functions/surfaces.rs,
// tests/system/camera_models.rs.
import package::common::layout::{HAS_DISTORTION, HAS_DOME, HAS_FISHEYE, HAS_OPENING, HAS_PORT, PI, scene};
import package::common::math::{circle, quarter_turns};
import package::common::rng::leading;

const UNDISTORT_STEPS: u32 = 12u;
const FISHEYE_STEPS: u32 = 12u;
/// Least part of a direction along the axis of a flat port.
const LEAST_AHEAD: f32 = 1e-12;

/// Least of one and the cosine from the axis by which a fisheye's opening turns.
const LEAST_TURN: f32 = 1e-6;
/// Leading numbers of a sample that choose the point of the opening.
const OPENING_NUMBERS: vec2u = vec2u(8u, 9u);

/// Where a sample looks from, relative to the camera, and the unit direction in which it looks.
struct Look {
    origin: vec3f,
    direction: vec3f,
}

/// How many times as far from the principal point the lens sees what is at a distance, and the derivative by the distance's square.
fn radial(r2: f32) -> vec2f {
    let k = scene.distortion;
    let k3 = scene.distortion_k3;
    let below = vec3f(scene.distortion_k4, scene.distortion_k5, scene.distortion_k6);
    let denominator = 1.0 + r2 * (below.x + r2 * (below.y + r2 * below.z));
    let factor = (1.0 + r2 * (k.x + r2 * (k.y + r2 * k3))) / denominator;
    let slope = k.x + r2 * (2.0 * k.y + r2 * 3.0 * k3) - factor * (below.x + r2 * (2.0 * below.y + r2 * 3.0 * below.z));
    return vec2f(factor, slope / denominator);
}

/// Point of an image without distortion of what the lens sees at a point, by Newton's method.
fn undistort(seen: vec2f) -> vec2f {
    let k = scene.distortion;
    var ideal = seen;
    for (var i = 0u; i < UNDISTORT_STEPS; i++) {
        let x = ideal.x;
        let y = ideal.y;
        let r2 = x * x + y * y;
        let of_radius = radial(r2);
        let factor = of_radius.x;
        let slope = 2.0 * of_radius.y;
        let tangential = vec2f(
            2.0 * k.z * x * y + k.w * (r2 + 2.0 * x * x),
            k.z * (r2 + 2.0 * y * y) + 2.0 * k.w * x * y,
        );
        let error = ideal * factor + tangential - seen;
        let xx = factor + x * x * slope + 2.0 * k.z * y + 6.0 * k.w * x;
        let xy = x * y * slope + 2.0 * k.z * x + 2.0 * k.w * y;
        let yy = factor + y * y * slope + 6.0 * k.z * y + 2.0 * k.w * x;
        let determinant = xx * yy - xy * xy;
        if dot(error, error) < 1e-16 || determinant == 0.0 {
            break;
        }
        ideal -= vec2f(yy * error.x - xy * error.y, xx * error.y - xy * error.x) / determinant;
    }
    return ideal;
}

/// Angle from the axis that a fisheye shows at a distance from the principal point, in focal lengths, by Newton's method.
fn fisheye_angle(radius: f32) -> f32 {
    let k = scene.distortion;
    var angle = min(radius, PI);
    for (var i = 0u; i < FISHEYE_STEPS; i++) {
        let t2 = angle * angle;
        let error = angle * (1.0 + t2 * (k.x + t2 * (k.y + t2 * (k.z + t2 * k.w)))) - radius;
        let slope = 1.0 + t2 * (3.0 * k.x + t2 * (5.0 * k.y + t2 * (7.0 * k.z + t2 * 9.0 * k.w)));
        if max(slope, 0.0) == 0.0 {
            break;
        }
        let change = error / slope;
        angle = clamp(angle - change, 0.0, PI);
        // The next one would be its square.
        if abs(change) < 1e-6 {
            break;
        }
    }
    return angle;
}

/// Direction (right, down, forward) that the lens sees at a point of the image in focal lengths; not of unit length.
fn lens_direction(seen: vec2f) -> vec3f {
    if HAS_FISHEYE {
        let radius = length(seen);
        let circle = quarter_turns(fisheye_angle(radius) * (2.0 / PI));
        return vec3f(seen * (circle.y / max(radius, 1e-30)), circle.x);
    }
    if HAS_DISTORTION {
        return vec3f(undistort(seen), 1.0);
    }
    return vec3f(seen, 1.0);
}

/// A point of the opening in its radii, even over its disc, from the leading numbers that were started.
fn choose_on_opening() -> vec2f {
    if !HAS_OPENING {
        return vec2f(0.0);
    }
    return sqrt(leading(OPENING_NUMBERS.x)) * circle(leading(OPENING_NUMBERS.y));
}

/// The ray inside from a point of the opening, in its radii, whose chief ray runs along `towards`, to what is in focus; right, down,
/// forward. A fisheye's opening stands across the ray.
fn through_opening(towards: vec3f, on_opening: vec2f) -> Look {
    var point = vec3f(on_opening, 0.0);
    var focused = towards;
    if HAS_FISHEYE {
        focused = normalize(towards);
        let along = dot(on_opening, focused.xy);
        point = vec3f(on_opening - focused.xy * (along / max(1.0 + focused.z, LEAST_TURN)), -along);
    }
    point *= scene.opening_radius_m;
    return Look(point, normalize(scene.focus_inside_m * focused - point));
}

/// What a unit direction behind a flat port becomes before it, from a point behind it; right, down, forward.
fn through_plane(start: vec3f, inside: vec3f) -> Look {
    let in_glass = inside.xy * scene.into_glass;
    let outside = in_glass * scene.out_of_glass;
    let through_glass = (scene.port_outer_m - scene.port_inner_m) / sqrt(1.0 - dot(in_glass, in_glass));
    let across = start.xy + inside.xy * ((scene.port_inner_m - start.z) / max(inside.z, LEAST_AHEAD)) + in_glass * through_glass;
    return Look(vec3f(across, scene.port_outer_m), vec3f(outside, sqrt(max(1.0 - dot(outside, outside), 0.0))));
}

/// Snell's law: the direction behind a surface with the unit `normal` along the way, from the index before over that behind.
fn refracted(direction: vec3f, normal: vec3f, ratio: f32) -> vec3f {
    let before = dot(direction, normal);
    let behind = sqrt(max(1.0 - ratio * ratio * (1.0 - before * before), 0.0));
    return ratio * direction + (behind - ratio * before) * normal;
}

/// What a unit direction behind a dome becomes before it, from a point inside; right, down, forward.
fn through_sphere(start: vec3f, inside: vec3f) -> Look {
    let middle = scene.dome_offset - start;
    let along = dot(inside, middle);
    let reach = scene.port_inner_m * scene.port_inner_m - dot(middle, middle);
    let to_glass = along + sqrt(along * along + reach);
    let met = to_glass * inside - middle;
    let in_glass = refracted(inside, met / scene.port_inner_m, scene.into_glass);
    let outward = dot(met, in_glass);
    let through_glass = scene.port_shell_m2 / (outward + sqrt(outward * outward + scene.port_shell_m2));
    let left = met + through_glass * in_glass;
    return Look(scene.dome_offset + left, refracted(in_glass, left / scene.port_outer_m, scene.out_of_glass));
}

/// A vector of the world from its right, down and forward parts.
fn in_world(parts: vec3f) -> vec3f {
    return scene.camera_forward * parts.z + scene.camera_right * parts.x + scene.camera_down * parts.y;
}

/// The ray through the point `offset` of the pixel (`column`, `row`) and a point of the lens's opening in its radii, as it leaves the port
/// where there is one.
fn camera_look(column: u32, row: u32, offset: vec2f, on_opening: vec2f) -> Look {
    let corner = vec2f(f32(column) - scene.centre_x_px, f32(row) - scene.centre_y_px);
    let seen = (corner + offset) / vec2f(scene.focal_x_px, scene.focal_y_px);
    let towards = lens_direction(seen);
    var inside = Look(vec3f(0.0), towards);
    if HAS_OPENING {
        inside = through_opening(towards, on_opening);
    }
    if !HAS_PORT {
        return Look(in_world(inside.origin), normalize(in_world(inside.direction)));
    }
    var left: Look;
    if HAS_DOME {
        left = through_sphere(inside.origin, normalize(inside.direction));
    } else {
        left = through_plane(inside.origin, normalize(inside.direction));
    }
    return Look(in_world(left.origin), normalize(in_world(left.direction)));
}
