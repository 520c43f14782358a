//! Marine snow: flakes that hold a share of what the water scatters once of the lamps' light, so that the mean over clouds is
//! the picture without them (docs/transport.md).
//!
//! [`source`] is that light at a point, [`veil`] the light that flakes take the place of, [`cloud`] where they are, [`view`]
//! what the camera sees of them, [`footprint`] their light on the pixels. All of it happens beside the film, whatever renders.

mod cloud;
mod footprint;
mod source;
#[cfg(test)]
mod tests;
mod veil;
mod view;

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;
use uw_media::Spectrum;

pub use cloud::{Cloud, Flake};

use crate::film::FilmLayer;
use crate::prepare::Prepared;
use crate::scene::Snow;
use footprint::{Flakes, Spot};
use source::Source;
use veil::{Guide, veil};
use view::{NEAR_M, View};

/// Flakes in view are at most this many a pixel, beyond which they would blend into each other ..
const FLAKES_PER_PIXEL: f64 = 8.0;
/// .. or this many.
const FLAKES: f64 = 2e6;
/// Most circles of the lens that lie over each other in a pixel.
const CIRCLES: f64 = 16.0;
/// Flakes that are looked through are at most this many times those in view.
const LOOKED_THROUGH: f64 = 40.0;
/// Distance beyond which there are no flakes, m.
const FARTHEST_M: f64 = 1000.0;
/// Factor by which the distance of the farthest flakes falls until they are few enough.
const NEARER: f64 = 0.8;
/// Flakes that are looked through before their light is added up.
const FLAKES_AT_ONCE: f64 = 1e6;

/// What snow adds to a picture, and takes from it.
#[derive(Clone, Debug, PartialEq)]
pub struct SnowLayers {
    /// For each lamp its change of every pixel's radiance with the lamp at 100 %, W/(m² sr), row by row from the top; `None`
    /// where it has none.
    pub lamps: Vec<Option<Vec<[f32; 3]>>>,
    /// Levels of the lamps as fractions.
    pub levels: Vec<f64>,
}

impl SnowLayers {
    /// Adds the change of a film's layer to `values`, those of all pixels; layers without light of lamps in the water
    /// have none.
    pub(crate) fn add_to(&self, layer: FilmLayer, values: &mut [Spectrum]) {
        for (lamp, light) in self.lamps.iter().enumerate() {
            let level = match layer {
                FilmLayer::Total | FilmLayer::Backscatter => self.levels[lamp],
                FilmLayer::Lamp(own) if own == lamp => 1.0,
                _ => continue,
            };
            for (value, change) in values.iter_mut().zip(light.iter().flatten()) {
                (0..3).for_each(|k| value[k] += level * f64::from(change[k]));
            }
        }
    }
}

/// The snow of `scene`, on the rayon pool in which it is called; `None` where there is none to be seen, and after `cancel`.
/// Lamps at level 0 are left out unless `dark_lamps`. The scene's own seed makes it: the same cloud in every picture of a
/// scene, however it is rendered.
pub fn snow(scene: &Prepared, dark_lamps: bool, cancel: &AtomicBool) -> Option<SnowLayers> {
    let snow = scene.snow.as_ref().filter(|snow| snow.share > 0.0)?;
    let view = View::new(scene);
    let cloud = Cloud::new(snow);
    let far_m = farthest_m(snow, &view, &cloud)?;
    let lit = |lamp: usize| {
        let lamp = &scene.lamps[lamp];
        (dark_lamps || lamp.level > 0.0) && !lamp.in_air
    };
    let of_lamp = |lamp: usize| {
        let source = Source::new(scene, lamp).filter(|_| lit(lamp))?;
        let guide = Guide::new(&view, &source, far_m)?;
        let taken = veil(&view, &source, &guide, snow.seed);
        let flakes = of_view(snow, &view, &source, &cloud, guide.far_m());
        let added = light_of(&flakes, &cloud, snow, cancel)?;
        let pixels = taken.iter().zip(&added);
        let change = |(taken, added): (&Spectrum, &Spectrum)| {
            std::array::from_fn(|k| (added[k] - snow.share * taken[k]) as f32)
        };
        Some(pixels.map(change).collect())
    };
    let layers = SnowLayers {
        lamps: (0..scene.lamps.len()).map(of_lamp).collect(),
        levels: scene.lamps.iter().map(|lamp| lamp.level).collect(),
    };
    (!cancel.load(Ordering::Relaxed)).then_some(layers)
}

fn of_view<'a>(
    snow: &Snow,
    view: &'a View<'a>,
    source: &'a Source<'a>,
    cloud: &Cloud,
    far_m: f64,
) -> Flakes<'a> {
    Flakes {
        view,
        source,
        blur: snow.blur,
        velocity_m_s: view.turned(snow.drift_m_s - snow.blur.velocity_m_s),
        gain_m: snow.share / (snow.per_m3 * cloud.mean_square_m2()),
        far_m,
    }
}

/// Distance along the optical axis up to which flakes are few enough, m; `None` where it is nearer than the nearest.
fn farthest_m(snow: &Snow, view: &View<'_>, cloud: &Cloud) -> Option<f64> {
    let camera = view.camera;
    let pixels = f64::from(camera.width) * f64::from(camera.height);
    let most = FLAKES.max(FLAKES_PER_PIXEL * pixels);
    let in_view = |far_m: f64| snow.per_m3 * view.area_m2() * far_m.powi(3) / 3.0;
    let circles = |far_m: f64| {
        let is_beyond = (camera.opening).is_some_and(|opening| far_m > opening.focus_m);
        let radius_m = if is_beyond { view.cone_m(far_m) } else { 0.0 };
        snow.per_m3 * std::f64::consts::PI * radius_m * radius_m * far_m / 3.0
    };
    let looked_through = |far_m: f64| {
        let (lower, upper) = bounds(snow, view, far_m);
        let size = upper - lower + cloud.edge_m;
        snow.per_m3 * size.x * size.y * size.z
    };
    let mut far_m = FARTHEST_M;
    while in_view(far_m) > most
        || circles(far_m) > CIRCLES
        || looked_through(far_m) > LOOKED_THROUGH * most
    {
        far_m *= NEARER;
        if far_m <= NEAR_M {
            return None;
        }
    }
    Some(far_m)
}

/// Corners of a box that holds the places of all flakes that are seen up to a distance, m.
fn bounds(snow: &Snow, view: &View<'_>, far_m: f64) -> (DVec3, DVec3) {
    let moved = snow.blur.exposure_s * (snow.drift_m_s - snow.blur.velocity_m_s);
    let reach_m = 0.5 * snow.diameter_m[1] + view.widest_m(far_m + moved.length());
    let corners = view.corners(far_m);
    let all = corners.iter().flat_map(|&corner| [corner, corner - moved]);
    let (lower, upper) = all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, u), c| {
        (l.min(c), u.max(c))
    });
    (lower - reach_m, upper + reach_m)
}

/// Light of all flakes in every pixel, W/(m² sr); `None` after `cancel`.
fn light_of(
    flakes: &Flakes<'_>,
    cloud: &Cloud,
    snow: &Snow,
    cancel: &AtomicBool,
) -> Option<Vec<Spectrum>> {
    let view = flakes.view;
    let camera = view.camera;
    let seen_m = flakes.far_m.min(view.deepest_m());
    let (lower, upper) = bounds(snow, view, seen_m);
    let (from, to) = (cloud.cell_of(lower), cloud.cell_of(upper));
    let slabs = (to[0] - from[0] + 1) as f64;
    let size = upper - lower + cloud.edge_m;
    let of_slab = snow.per_m3 * size.x * size.y * size.z / slabs;
    let at_once = (FLAKES_AT_ONCE / of_slab).clamp(1.0, slabs) as usize;
    let mut light = vec![[0.0; 3]; camera.width as usize * camera.height as usize];
    let of_slab = |x: i64| spots_of_slab(flakes, cloud, snow, seen_m, x, [from, to]);
    for first in (from[0]..=to[0]).step_by(at_once) {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        let last = (first + at_once as i64 - 1).min(to[0]);
        let slabs = (first..=last).into_par_iter();
        let spots: Vec<Vec<Spot>> = slabs.map(of_slab).collect();
        for spot in spots.iter().flatten() {
            let light: &mut Spectrum = &mut light[spot.pixel as usize];
            (0..3).for_each(|k| light[k] += f64::from(spot.light[k]));
        }
    }
    Some(light)
}

/// Light of the flakes in the cells of one index along x.
fn spots_of_slab(
    flakes: &Flakes<'_>,
    cloud: &Cloud,
    snow: &Snow,
    seen_m: f64,
    x: i64,
    [from, to]: [[i64; 3]; 2],
) -> Vec<Spot> {
    let view = flakes.view;
    let half_m = 0.5 * 3.0_f64.sqrt() * cloud.edge_m;
    let mut spots = Vec::new();
    for y in from[1]..=to[1] {
        for z in from[2]..=to[2] {
            let middle = view.to_camera_frame(cloud.middle_of([x, y, z]));
            let reach_m = flakes.reach_m(snow.diameter_m[1], middle.z.abs() + half_m);
            if !view.may_see(middle, half_m + reach_m, seen_m) {
                continue;
            }
            cloud.for_flakes_of([x, y, z], |flake| {
                let place = view.to_camera_frame(flake.position_m);
                let reach_m = flakes.reach_m(flake.diameter_m, place.z);
                if view.may_see(place, reach_m, seen_m) {
                    flakes.add(&flake, place, &mut spots);
                }
            });
        }
    }
    spots
}
