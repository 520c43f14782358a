// Light that a narrow beam loses on its way: bridges from beside the beam by way of a scattering in it.
// Checked by: tests/system/beams.rs.
//
// A bridge to the lamp hardly ever leaves it within a narrow beam when it comes from beside it. From the first scattering of a camera walk and
// from surfaces two more bridges are therefore made, one to a point of the beam, drawn first, and one from there to the lamp. The point is the
// first of the path's scatterings that lies in the beam, so that a path has but one; all ways of making it are balanced (common/mis).
import package::common::interface::flip;
import package::common::lamp_targets::Target;
import package::common::layout::{HAS_BEAMS, HAS_SURFACE, INFINITE, PI};
import package::common::math::{angle_of, quarter_turns, turn};
import package::common::rng::uniform_number;
import package::common::tables::{lamp_beam_cosine, lamp_forward};

/// Share of the points drawn in the beam with a density as one over the square of the angle, because water scatters forwards; the others are
/// drawn evenly over it.
const FORWARD_SHARE: f32 = 0.5;
/// The angle at the far end is that at the lamp times this at least: spans are numbers.
const LEAST_SPREAD: f32 = 1.000001;
/// Largest cosine there is: what is above says that a lamp has no beam.
const LARGEST_COSINE: f32 = 1.0;

/// Where the walk's subpath starts, if bridges are led to beams from there; in unfolded space.
struct LedStart {
    is_set: bool,
    position: vec3f,
    /// The surface there, or beyond a scattering: beyond its plane no points of the beam are drawn. No normal: no plane.
    on_surface: bool,
    plane: vec3f,
    normal: vec3f,
}

/// The beam from a lamp point, seen from where bridges start.
struct Beam {
    /// Whether that lies beside it.
    is_beside: bool,
    axis: vec3f,
    cosine: f32,
    /// Where the light comes from, and the start.
    lamp: vec3f,
    start: vec3f,
    /// Whether a bridge is led through it, and the plane up to which.
    is_led: bool,
    plane: vec3f,
    normal: vec3f,
}

/// Places along a ray of the beam by the angle there between the ray and the way to where bridges start, from `first` at the lamp to `last` at a
/// plane.
struct AlongBeam {
    foot: f32,
    height: f32,
    first: f32,
    last: f32,
    longest: f32,
}

var<private> led: LedStart;

fn no_led_start() {
    led = LedStart(false, vec3f(0.0), false, vec3f(0.0), vec3f(0.0));
}

fn no_beam() -> Beam {
    return Beam(false, vec3f(0.0), 0.0, vec3f(0.0), vec3f(0.0), false, vec3f(0.0), vec3f(0.0));
}

/// The beam of `aimed` from its point `lamp`, seen from `start`; all in unfolded space.
fn beam_beside(aimed: Target, lamp: vec3f, start: vec3f) -> Beam {
    let cosine = lamp_beam_cosine(aimed.lamp);
    if !HAS_BEAMS || cosine > LARGEST_COSINE {
        return no_beam();
    }
    let forward = lamp_forward(aimed.lamp);
    let axis = select(forward, flip(forward), HAS_SURFACE && aimed.mirrored);
    let offset = start - lamp;
    let is_beside = dot(offset, axis) < cosine * length(offset);
    return Beam(is_beside, axis, cosine, lamp, start, false, vec3f(0.0), vec3f(0.0));
}

/// The beam through which bridges are led from the start of the walk's subpath.
fn led_beam(aimed: Target, lamp: vec3f) -> Beam {
    if !HAS_BEAMS || !led.is_set {
        return no_beam();
    }
    var beam = beam_beside(aimed, lamp, led.position);
    let is_before = dot(led.plane - lamp, led.normal) < 0.0;
    beam.is_led = beam.is_beside && (is_before || !led.on_surface);
    beam.plane = led.plane;
    beam.normal = select(vec3f(0.0), led.normal, is_before);
    return beam;
}

fn along_beam(beam: Beam, direction: vec3f) -> AlongBeam {
    let offset = beam.start - beam.lamp;
    let foot = dot(offset, direction);
    let height = max(length(offset - foot * direction), 1e-6 * length(offset));
    let towards_plane = dot(direction, beam.normal);
    var longest = INFINITE;
    var last = PI;
    if towards_plane < 0.0 {
        longest = dot(beam.plane - beam.lamp, beam.normal) / towards_plane;
        last = angle_of(height, foot - longest);
    }
    let first = angle_of(height, foot);
    return AlongBeam(foot, height, first, max(last, first * LEAST_SPREAD), longest);
}

fn is_in_beam(beam: Beam, position: vec3f) -> bool {
    let offset = position - beam.lamp;
    return dot(offset, beam.axis) >= beam.cosine * length(offset);
}

/// Density of a point of the beam `distance` away from the lamp along `direction`, per distance and solid angle.
fn beam_pdf(beam: Beam, direction: vec3f, distance: f32) -> f32 {
    let law = along_beam(beam, direction);
    if distance > law.longest {
        return 0.0;
    }
    let rest = law.foot - distance;
    let angle = angle_of(law.height, rest);
    let span = law.last - law.first;
    let per_angle = (1.0 - FORWARD_SHARE + FORWARD_SHARE * law.first * law.last / (angle * angle)) / span;
    return per_angle * law.height / ((law.height * law.height + rest * rest) * beam_solid_angle(beam));
}

fn beam_solid_angle(beam: Beam) -> f32 {
    return 2.0 * PI * (1.0 - beam.cosine);
}

/// Direction of a ray of the beam.
fn beam_ray(beam: Beam) -> vec3f {
    let x = 0.5 * (1.0 - beam.cosine) * uniform_number();
    return turn(beam.axis, x, uniform_number());
}

/// A point of the beam.
fn beam_point(beam: Beam) -> vec3f {
    let direction = beam_ray(beam);
    let law = along_beam(beam, direction);
    let span = law.last - law.first;
    let u = uniform_number();
    var angle: f32;
    if u < FORWARD_SHARE {
        angle = law.first * law.last / (law.last - u / FORWARD_SHARE * span);
    } else {
        angle = law.first + (u - FORWARD_SHARE) / (1.0 - FORWARD_SHARE) * span;
    }
    let c = quarter_turns(0.63661977 * angle);
    return beam.lamp + clamp(law.foot - law.height * c.x / max(c.y, 1e-12), 0.0, law.longest) * direction;
}
