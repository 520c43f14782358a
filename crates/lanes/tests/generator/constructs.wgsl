// Every construct of the language that the generator knows, once.

const SHARE: f32 = 0.1;
const EIGHTH: f32 = 0.125;
const AXIS = vec3f(0.0, 0.0, 1.0);

override HAS_WATER: bool = true;
override HAS_LAMP: bool = true;

struct Scene {
    c: vec3f,
    count: u32,
    ends: vec4u,
}

struct Dispatch {
    lanes: u32,
}

struct Counters {
    cut_paths: atomic<u32>,
}

struct Walk {
    origin: vec3f,
    events: u32,
    alive: bool,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<uniform> dispatch: Dispatch;
@group(0) @binding(2) var<storage, read> near_rows: array<vec4u>;
@group(0) @binding(3) var<storage, read> texels: array<u32>;
@group(0) @binding(4) var<storage, read_write> scratch: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> film: array<f32>;
@group(0) @binding(6) var<storage, read_write> completed: array<u32>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

var<private> lane: u32;
var<private> walks: array<Walk, 2>;

fn operators(x: f32, y: f32, n: u32, i: i32) -> f32 {
    let sum = (x + y) * (x - y) / -x;
    let bits = ((n << 3u) | (n >> 2u)) ^ (~n & 15u);
    let whole = (n + 3u) * n - n / 3u + n % 5u;
    let with_sign = ((i + 1) << 1u) & 3;
    let compared = (x < y) != (x >= y) || !(n == 3u && x <= y) || n > 2u;
    return select(sum, f32(bits + whole) + f32(with_sign), compared);
}

fn numbers(x: f32) -> vec3f {
    let bits = bitcast<u32>(x);
    let rounded = round(x) + floor(x) + fract(x) + abs(x);
    let powers = sqrt(x) + exp(x) + log(x) + SHARE + EIGHTH;
    let bounded = clamp(min(x, 2.0), 0.0, max(x, 1.0));
    let places = f32(firstTrailingBit(reverseBits(bits))) + f32(u32(x)) + f32(i32(x));
    return vec3f(rounded, powers, mix(bounded, places, 0.5));
}

fn vectors(a: vec3f, b: vec3f, k: u32) -> vec4f {
    let m = mat3x3f(a, b, cross(a, b));
    let turned = (2.0 * m) * normalize(a.zyx) + AXIS;
    let small = a < b;
    let chosen = select(a, b, small);
    let whole = select(0.0, 1.0, all(small) || any(small));
    return vec4f(turned.xy * dot(a, chosen), length(b) + distance(a, b), turned[k] + whole);
}

fn branches(x: f32) -> f32 {
    if HAS_WATER && !HAS_LAMP {
        return 1.0;
    }
    var y = x;
    if x > 2.0 {
        y += 1.0;
    } else if x > 1.0 {
        return y;
    } else {
        y = -y;
    }
    return y;
}

fn loops(n: u32) -> u32 {
    var sum = 0u;
    for (var i = 0u; i < n; i++) {
        if i == 2u {
            continue;
        }
        sum += i;
    }
    while sum < 10u {
        sum *= 2u;
    }
    loop {
        if sum > 100u {
            break;
        }
        if sum == 50u {
            return sum;
        }
        sum += 7u;
        continuing {
            sum += 1u;
            break if sum > 90u;
        }
    }
    return sum;
}

fn places(i: u32) -> vec4f {
    let row = near_rows[i];
    let word = near_rows[i >> 2u][i & 3u];
    walks[i & 1u].origin.y = scene.c[i % 3u];
    walks[1].events = scene.ends[i & 3u] + scene.count + word;
    walks[0] = Walk(scene.c, texels[i], true);
    var kept = scratch[i * dispatch.lanes + lane];
    kept.w = bitcast<vec4f>(row).x;
    scratch[i] = kept;
    scratch[i].y = film[i];
    film[i] = kept.x;
    completed[i] = completed[i] + 1u;
    atomicAdd(&counters.cut_paths, 1u);
    return kept;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    lane = id.x;
    let x = operators(1.0, SHARE, id.x, -1) + branches(0.5);
    let v = vectors(numbers(x), AXIS, loops(id.x) % 3u);
    if any(v == places(id.x)) {
        return;
    }
    film[0] = v.x;
}
