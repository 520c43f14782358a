// Functions whose accuracy WGSL leaves open, and directions without cancellation.
// Host: crates/render/src/sampling/directions.rs. Checked by: crates/render/src/gpu/functions/numbers.rs.
import package::common::layout::PI;

/// e^x − 1, relative error 1e-6. Below −20 the exponential is nothing beside 1.
fn expm1(x: f32) -> f32 {
    let near = x * (1.0 + x * (0.5 + x * (1.6666667e-1 + x * (4.1666668e-2 + x * (8.3333338e-3 + x * (1.3888889e-3 + x * 1.984127e-4))))));
    return select(near, exp(max(x, -20.0)) - 1.0, abs(x) > 0.5);
}

/// ln(1 + x) for x > −1, relative error 1e-6.
fn ln_1p(x: f32) -> f32 {
    if abs(x) > 0.4 {
        return log(1.0 + x);
    }
    let s = x / (2.0 + x);
    let s2 = s * s;
    return 2.0 * s * (1.0 + s2 * (3.3333334e-1 + s2 * (0.2 + s2 * (1.4285715e-1 + s2 * 1.1111111e-1))));
}

/// −ln u for u in (0, 1], also exact next to 1; >= 0.
fn minus_ln(u: f32) -> f32 {
    if u > 0.6 {
        return max(-ln_1p(u - 1.0), 0.0);
    }
    return -log(u);
}

/// Angle of the point (x, y), radians, in (−π, π].
fn angle_of(y: f32, x: f32) -> f32 {
    let large = max(abs(x), abs(y));
    let small = min(abs(x), abs(y));
    if large == 0.0 {
        return 0.0;
    }
    let t = small / large;
    // Halved once more, so that the series is short: atan t = atan s + π/8 with s = (t − k)/(1 + k t), k = tan(π/8).
    let far = t > 0.41421356;
    let s = select(t, (t - 0.41421356) / (1.0 + 0.41421356 * t), far);
    let s2 = s * s;
    var angle = s * (1.0 + s2 * (-3.3333334e-1 + s2 * (0.2 + s2 * (-1.4285715e-1 + s2 * (1.1111111e-1 + s2 * -9.0909094e-2)))));
    angle += select(0.0, 0.125 * PI, far);
    angle = select(angle, 0.5 * PI - angle, abs(y) > abs(x));
    angle = select(angle, PI - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}

/// Cosine and sine of an angle in quarters of a turn.
fn quarter_turns(quarters: f32) -> vec2f {
    let whole = round(quarters);
    let a = (quarters - whole) * (0.5 * PI);
    let a2 = a * a;
    let sine = a * (1.0 + a2 * (-1.6666667e-1 + a2 * (8.3333338e-3 + a2 * (-1.9841270e-4 + a2 * 2.7557319e-6))));
    let cosine = 1.0 + a2 * (-0.5 + a2 * (4.1666668e-2 + a2 * (-1.3888889e-3 + a2 * 2.4801587e-5)));
    let quadrant = i32(whole) & 3;
    if quadrant == 0 {
        return vec2f(cosine, sine);
    }
    if quadrant == 1 {
        return vec2f(-sine, cosine);
    }
    if quadrant == 2 {
        return vec2f(-cosine, -sine);
    }
    return vec2f(sine, -cosine);
}

/// Cosine and sine of 2π·u.
fn circle(u: f32) -> vec2f {
    return quarter_turns(4.0 * u);
}

/// sin²(θ/2) of the angle between two unit directions.
fn sin2_half(a: vec3f, b: vec3f) -> f32 {
    let d = a - b;
    return min(0.25 * dot(d, d), 1.0);
}

struct Frame {
    u: vec3f,
    v: vec3f,
}

/// Two unit vectors that complete `axis` to an orthonormal frame (Duff et al. 2017).
fn frame(axis: vec3f) -> Frame {
    let side = select(1.0, -1.0, axis.z < 0.0);
    let a = -1.0 / (side + axis.z);
    let b = axis.x * axis.y * a;
    return Frame(
        vec3f(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x),
        vec3f(b, side + axis.y * axis.y * a, -axis.y),
    );
}

/// What turning `direction` by the angle θ with sin²(θ/2) = `x`, at azimuth 2π·`u`, adds to it.
fn turn_change(direction: vec3f, x: f32, u: f32) -> vec3f {
    let sine = 2.0 * sqrt(max(x * (1.0 - x), 0.0));
    let azimuth = circle(u);
    let f = frame(direction);
    return sine * azimuth.x * f.u + sine * azimuth.y * f.v - 2.0 * x * direction;
}

/// `direction` and what turning adds to it, of unit length over any number of turns.
fn turned(direction: vec3f, change: vec3f) -> vec3f {
    let sum = direction + change;
    return sum * (1.5 - 0.5 * dot(sum, sum));
}

/// `direction` turned by the angle θ with sin²(θ/2) = `x`, at azimuth 2π·`u`; stays a unit vector.
fn turn(direction: vec3f, x: f32, u: f32) -> vec3f {
    return turned(direction, turn_change(direction, x, u));
}

/// A direction around `normal` with density cos/π.
fn cosine_hemisphere(normal: vec3f, u: f32, v: f32) -> vec3f {
    let r = sqrt(u);
    let azimuth = circle(v);
    let f = frame(normal);
    return normalize(r * azimuth.x * f.u + r * azimuth.y * f.v + sqrt(max(1.0 - u, 0.0)) * normal);
}
