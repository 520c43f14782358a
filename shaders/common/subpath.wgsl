// The vertices of a walk that can be joined to a lamp, and where bridges by way of them and of the made bridge's start.
// Checked by: tests/system/ (closed_form, validator, furnace, radiative_transfer; gpu: both precisions).
import package::common::bridge::{bridge, bridge_vertex, drawn_row, extra_row, subpath_row};
import package::common::layer_tables::{BY_BRIDGE, BY_SCATTERING};
import package::common::layers::{drawn_between, relative_at};
import package::common::layout::{HAS_LAYERS, Spectrum, dispatch, scratch};
import package::common::settings::largest_order;

/// Most vertices of a walk that are joined to lamps where the water varies.
const MOST_JOINED: u32 = 12u;
/// Vertices of a walk from which bridges may have any order, and the highest order from those after them. What a connection takes and what is
/// kept of a walk would grow with its length otherwise.
const FREE_VERTICES: u32 = 12u;
const LATE_ORDER: u32 = 32u;
/// Least length of a way whose logarithm is taken, m.
const LEAST_LENGTH: f32 = 1e-30;

/// The vertices of the walk that can be joined to a lamp.
struct CameraSubpath {
    count: u32,
    rooted: bool,
    companions: bool,
    scattered: bool,
}

var<private> subpath: CameraSubpath;

/// What all techniques of making one path share.
struct PathToLamp {
    more: f32,
    last_length: f32,
    /// Drawn length up to the walk's last vertex.
    last_drawn: f32,
    remaining: f32,
    ln_walk_density: Spectrum,
    ln_root_density: Spectrum,
    shift: f32,
}

var<private> path: PathToLamp;

fn subpath_start() {
    subpath = CameraSubpath(0u, false, true, false);
}

fn subpath_root(position: vec3f, length: f32, drawn: f32, reflected: f32, companions: bool, scattered: bool) {
    subpath = CameraSubpath(0u, true, companions, scattered);
    subpath_push(position, length, drawn, 0.0, reflected);
}

/// Whether a walk with that many vertices is joined to lamps: where the water varies only with few, because what a
/// connection takes grows with their square. Bridges of many scatterings make the paths that are left.
fn is_joined(vertices: u32) -> bool {
    return !HAS_LAYERS || vertices <= MOST_JOINED;
}

/// Whether one more vertex of the walk is joined to lamps.
fn subpath_has_room() -> bool {
    return is_joined(subpath.count + 1u);
}

/// Highest order of a bridge from vertex `i` of the walk.
fn most_from(i: u32) -> u32 {
    return select(late_order(), largest_order(), i < FREE_VERTICES);
}

fn late_order() -> u32 {
    let any = largest_order();
    return min(any - min(any, FREE_VERTICES), LATE_ORDER);
}

/// Where vertex `i` is kept: the first ones for good, of the later ones those that bridges of the highest order reach.
fn kept_at(i: u32) -> u32 {
    if i < dispatch.slots {
        return i;
    }
    return FREE_VERTICES + (i - FREE_VERTICES) % (dispatch.slots - FREE_VERTICES);
}

fn vertex_row(i: u32) -> u32 {
    return subpath_row(kept_at(i));
}

fn turn_row(i: u32) -> u32 {
    return extra_row(kept_at(i));
}

/// Adds a vertex. `ln_relative` is of where it scattered.
fn subpath_push(position: vec3f, length: f32, drawn: f32, ln_relative: f32, reflected: f32) {
    if HAS_LAYERS {
        scratch[drawn_row(subpath.count)].x = drawn;
        scratch[drawn_row(subpath.count)].w = ln_relative;
    }
    scratch[vertex_row(subpath.count)] = vec4f(position, length);
    let extra = turn_row(subpath.count);
    scratch[extra].z = 0.0;
    scratch[extra].w = reflected;
    subpath.count += 1u;
}

/// The walk went on from its last vertex with density `scattering_pdf` of its direction.
fn subpath_leave(scattering_pdf: f32) {
    scratch[turn_row(subpath.count - 1u)].z = scattering_pdf;
}

/// Where a technique's bridge starts: length and drawn length of the path up to there, and the straight way to the lamp.
struct BridgeStart {
    length: f32,
    drawn: f32,
    distance2: f32,
    drawn_to_lamp: f32,
    /// Where the water varies: ln of the density of where the bridge scatters, over that of a walk through the same points
    /// and what the bridge would have in water that is as its straight way has it in the mean.
    ln_places: f32,
}

/// A start at `position`, up to which the path has the lengths given, of a bridge by way of the subpath's vertices from
/// `walked` on and the made bridge's from `bridged` on.
fn bridge_start(position: vec3f, length: f32, drawn: f32, lamp: vec3f, walked: u32, bridged: u32) -> BridgeStart {
    let offset = position - lamp;
    let distance2 = dot(offset, offset);
    if HAS_LAYERS {
        let straight = max(drawn_between(position, lamp, BY_SCATTERING), LEAST_LENGTH);
        let ln_scale = log(straight / max(drawn_between(position, lamp, BY_BRIDGE), LEAST_LENGTH));
        let ln_places = ln_places_of(position, length, lamp, ln_scale, walked, bridged);
        return BridgeStart(length, drawn, distance2, straight, ln_places);
    }
    return BridgeStart(length, length, distance2, sqrt(distance2), 0.0);
}

/// Sum over the vertices of a bridge of ln of the density of each fraction of its length, over the relative scattering there.
fn ln_places_of(start: vec3f, length: f32, lamp: vec3f, ln_scale: f32, walked: u32, bridged: u32) -> f32 {
    let total = max(path.last_length + path.remaining - length, LEAST_LENGTH);
    var sum = 0.0;
    var i = walked;
    loop {
        if i >= subpath.count {
            break;
        }
        let u = clamp((scratch[subpath_row(i)].w - length) / total, 0.0, 1.0);
        sum += log(relative_at(mix(start, lamp, u), BY_BRIDGE)) + ln_scale - scratch[drawn_row(i)].w;
        i += 1u;
    }
    var gone = path.last_length;
    i = 0u;
    loop {
        if i >= bridge.order {
            break;
        }
        gone += bridge_vertex(i).w;
        if i >= bridged {
            let u = clamp((gone - length) / total, 0.0, 1.0);
            sum += log(relative_at(mix(start, lamp, u), BY_BRIDGE)) + ln_scale - scratch[drawn_row(i)].z;
        }
        i += 1u;
    }
    return sum;
}

/// Drawn length up to vertex `i` of the subpath, which is `length` away.
fn drawn_up_to(i: u32, length: f32) -> f32 {
    if HAS_LAYERS {
        return scratch[drawn_row(i)].x;
    }
    return length;
}
