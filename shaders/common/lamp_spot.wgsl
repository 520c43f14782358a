// Light of the spot that a narrow beam makes, scattered to where a camera ray scatters or meets a surface beside the beam: bridges from there to
// a point of the spot.
// Checked by: tests/system/beams.rs.
//
// A walk hardly ever comes to the spot by itself from beside the beam. From its first scattering and from surfaces a bridge is therefore led to
// where a ray of the beam meets a surface, and one from there to the lamp. The walk that lands in the spot by itself does the same from there;
// both ways of landing are balanced (common/mis), by the part of the path between the places alone. Between two surfaces only ways
// that scatter are led so; the straight one is the walk's.
import package::common::bvh::{closest, primitive_normal};
import package::common::camera::{SURFACE, End};
import package::common::gloss::{surface_albedo, surface_factor, surface_pdf};
import package::common::interface::distance_to_surface;
import package::common::lamp_beam::{Beam, beam_beside, beam_ray, beam_solid_angle, is_in_beam};
import package::common::lamp_targets::{Target, target_centre, target_count, targets};
import package::common::lamp_walk::walk;
import package::common::layout::{HAS_BEAMS, HAS_GLOSS, HAS_SURFACE, NONE, Spectrum};
import package::common::mis::{Stretch, WayToSpot, share_of_walk};
import package::common::settings::largest_order;
import package::common::surface::{SurfacePoint, facing};
import package::common::unfold::segment_factor;

/// The place of the walk from which a bridge was led to spots.
struct SpotStart {
    is_set: bool,
    on_surface: bool,
    position: vec3f,
    length: f32,
    reflected: f32,
    scatterings: u32,
    /// Density of the direction in which the walk went on.
    scattering_pdf: f32,
}

/// Where a ray of a beam meets a surface.
struct Spot {
    end: End,
    position: vec3f,
    normal: vec3f,
    /// Reciprocal of the density of such points, m².
    area: f32,
}

var<private> spot_start: SpotStart;
/// By lamp target: the share that the walk has of its way from there to the surface that it met last.
var<private> arrival_shares: array<f32, 4>;
var<private> lit_spot: Spot;
/// The surface there as the first bridge comes to it.
var<private> lit_ground: SurfacePoint;

fn no_spot_start() {
    spot_start = SpotStart(false, false, vec3f(0.0), 0.0, 1.0, 0u, 0.0);
}

/// Whether bridges are led to beams from where the walk stands: from surfaces, and from its first scattering before those.
fn is_led_start(on_surface: bool) -> bool {
    let is_first = walk.scatterings == 1u && !walk.met_surface;
    return HAS_BEAMS && (on_surface || is_first) && !(HAS_SURFACE && walk.mirrored);
}

/// The walk leaves the place with density `scattering_pdf` of its direction.
fn set_spot_start(on_surface: bool, scattering_pdf: f32) {
    spot_start = SpotStart(true, on_surface, walk.origin, walk.length, walk.reflected, walk.scatterings, scattering_pdf);
}

/// Reciprocal of the density of points on a surface with `normal` that rays of the beam meet, m²; 0 on its back.
fn spot_area(beam: Beam, offset: vec3f, normal: vec3f) -> f32 {
    let cosine = -dot(normal, offset);
    if !(cosine > 0.0) {
        return 0.0;
    }
    let distance2 = dot(offset, offset);
    return beam_solid_angle(beam) * distance2 * sqrt(distance2) / cosine;
}

/// Draws a point of the spot; false where the ray meets nothing.
fn draw_spot(beam: Beam) -> bool {
    let direction = beam_ray(beam);
    let hit = closest(beam.lamp, direction, distance_to_surface(beam.lamp, direction), NONE);
    if hit.primitive == NONE {
        return false;
    }
    let normal = facing(primitive_normal(hit.primitive), direction);
    let offset = hit.t * direction;
    lit_spot = Spot(End(SURFACE, hit.t, hit.primitive, hit.local), beam.lamp + offset, normal, spot_area(beam, offset, normal));
    return lit_spot.area > 0.0;
}

/// Cosine under which light leaves the spot along `emission`; 0 below its surface.
fn spot_cosine(emission: vec3f) -> f32 {
    return max(dot(lit_spot.normal, emission), 0.0);
}

/// What the spot sends on along the first bridge of the light that comes from `towards`, over the density of the spot's point.
fn spot_reflects(emission: vec3f, towards: vec3f) -> Spectrum {
    var reflected = surface_albedo(lit_ground) * surface_pdf(lit_ground, towards);
    if HAS_GLOSS {
        reflected *= surface_factor(lit_ground, towards);
    }
    return reflected * spot_cosine(emission) * lit_spot.area;
}

/// What share two bridges have of a path by way of the spot, of which the first is `to_spot` and leaves with `scattering_pdf`.
fn share_of_bridges(on_surface: bool, to_spot: Stretch, emission: vec3f, reflected: f32, scattering_pdf: f32) -> f32 {
    return 1.0 - share_of_walk(WayToSpot(on_surface, to_spot, scattering_pdf, reflected, spot_cosine(emission) * lit_spot.area));
}

/// The walk has come to `ground`: finds its shares of having done so.
fn share_arrival(ground: SurfacePoint) {
    if !HAS_BEAMS {
        return;
    }
    for (var i = 0u; i < target_count; i++) {
        arrival_shares[i] = 1.0;
        if spot_start.is_set {
            arrival_shares[i] = arrival_share(targets[i], ground);
        }
    }
}

fn arrival_share(aimed: Target, ground: SurfacePoint) -> f32 {
    let order = walk.scatterings - spot_start.scatterings;
    let is_folded = HAS_SURFACE && (walk.mirrored || aimed.mirrored);
    if is_folded || order >= largest_order() || (spot_start.on_surface && order == 0u) {
        return 1.0;
    }
    let centre = target_centre(aimed);
    let beam = beam_beside(aimed, centre, spot_start.position);
    if !beam.is_beside || !is_in_beam(beam, walk.origin) {
        return 1.0;
    }
    let area = spot_area(beam, walk.origin - centre, ground.normal);
    if area == 0.0 || segment_factor(walk.origin, centre, walk.start_primitive) == 0.0 {
        return 1.0;
    }
    let way = spot_start.position - walk.origin;
    let stretch = Stretch(order, walk.length - spot_start.length, dot(way, way));
    let facing_area = -dot(ground.normal, walk.direction) * area;
    return share_of_walk(WayToSpot(spot_start.on_surface, stretch, spot_start.scattering_pdf, walk.reflected / spot_start.reflected, facing_area));
}
