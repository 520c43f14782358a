//! A guess of the light that comes to the camera by wavelength: what wavelengths are drawn by, so that few samples go where
//! the water leaves nothing. Only the noise depends on it.

use glam::DVec3;
use uw_media::spectral::Curve;
use uw_media::{Iops, Spectrum};

use super::{Boundary, Geometry, PreparedLamp, Primitive, SunBeam};
use crate::scene::{Camera, Scene, Spectral};

/// Points of the image that are looked through, as fractions of its size.
const VIEWS: [(f64, f64); 5] = [(0.5, 0.5), (0.2, 0.2), (0.8, 0.2), (0.2, 0.8), (0.8, 0.8)];
/// Least intensity of a lamp off its axis that counts, over that on it: scattered light arrives from there.
const ASIDE: f64 = 0.02;
/// Share of scattered light that does not go on to the point it was on its way to.
const LOST_OF_SCATTERED: f64 = 0.5;
/// Length of daylight's way to a depth over that depth.
const DAYLIGHT_WAY: f64 = 1.1;
/// Where the middle of the lit water is seen, over the way to a surface or to where little is left of a look.
const VEIL: f64 = 0.5;
/// Spacing of the wavelengths at which the light is guessed, nm.
const STEP_NM: f64 = 2.0;

/// Light that comes from lamps, sun and sky by one point on to the camera.
struct Seen {
    /// Irradiance of the point without water, per channel, and the way of the light to it and on to the camera, m; the last
    /// two entries are sun and sky.
    lights: Vec<(Spectrum, f64)>,
}

/// The light expected in each channel by wavelength, each curve with a mean of 1 over the channel's response; `None`
/// where a channel has no light.
pub(super) fn expected_light(
    scene: &Scene,
    spectral: &Spectral,
    geometry: &Geometry,
) -> Option<[Curve; 3]> {
    let setting = Setting::of(scene, spectral, geometry);
    let seen: Vec<Seen> = VIEWS.iter().flat_map(|&view| setting.seen(view)).collect();
    let lamps = scene.lamps.iter().map(|lamp| lamp.spectrum.as_ref());
    let day = [spectral.sun.as_ref(), spectral.sky.as_ref()];
    let colours: Vec<_> = lamps
        .chain(day)
        .map(|curve| spectral.relative_light(curve))
        .collect();
    let range_nm = spectral.range_nm();
    let count = ((range_nm.1 - range_nm.0) / STEP_NM).ceil().max(1.0) as usize;
    let nodes: Vec<f64> = (0..=count)
        .map(|i| range_nm.0 + (range_nm.1 - range_nm.0) * i as f64 / count as f64)
        .collect();
    let at_node = |nm: f64| {
        let lost = spectral
            .water
            .as_ref()
            .map(|water| lost_per_m(&water.at([nm; 3])));
        let colours: Vec<Spectrum> = colours.iter().map(|colour| colour([nm; 3])).collect();
        let of = |seen: &Seen| seen.light(&colours, lost.unwrap_or(0.0));
        seen.iter().map(of).collect::<Vec<_>>()
    };
    let table: Vec<Vec<Spectrum>> = nodes.iter().map(|&nm| at_node(nm)).collect();
    let curve = |k: usize, i: usize| {
        let nodes = nodes.iter().zip(&table);
        Curve::new(nodes.map(|(&nm, row)| (nm, row[i][k])).collect())
    };
    let mean = |k: usize| mean_of_all(spectral, k, (0..seen.len()).map(|i| curve(k, i)));
    Some([mean(0)?, mean(1)?, mean(2)?])
}

/// The mean of curves that are brought to a mean of 1 over channel `k`; `None` where nothing is left of any.
fn mean_of_all(
    spectral: &Spectral,
    k: usize,
    curves: impl Iterator<Item = Curve>,
) -> Option<Curve> {
    let range = Some(spectral.range_nm());
    let curves = curves.filter_map(|curve| {
        let mean = spectral.response.channel_values(range, |nm| curve.at(nm))[k];
        (mean > 0.0 && mean.is_finite()).then(|| curve.map(|_, light| light / mean))
    });
    let curves: Vec<Curve> = curves.collect();
    let first = curves.first()?;
    let n = curves.len() as f64;
    let sum = |nm: f64| curves.iter().map(|curve| curve.at(nm)).sum::<f64>() / n;
    Some(first.map(|nm, _| sum(nm)))
}

fn lost_per_m(water: &Iops) -> f64 {
    water.a[0] + LOST_OF_SCATTERED * water.b[0]
}

impl Seen {
    /// Light at a wavelength in which the sources have `colours` and each metre loses `lost_per_m`.
    fn light(&self, colours: &[Spectrum], lost_per_m: f64) -> Spectrum {
        let mut sum = [0.0; 3];
        for ((strength, way_m), colour) in self.lights.iter().zip(colours) {
            let left = (-lost_per_m * way_m).exp();
            (0..3).for_each(|k| sum[k] += strength[k] * colour[k] * left);
        }
        sum
    }
}

/// What a guess of the light needs of a scene.
struct Setting<'s> {
    camera: &'s Camera,
    geometry: &'s Geometry,
    boundary: Option<Boundary>,
    lamps: Vec<PreparedLamp>,
    /// Irradiance of sun and sky on a level plane in the water.
    daylight: [Spectrum; 2],
    /// How far a look goes where nothing is met, m.
    reach_m: f64,
}

impl<'s> Setting<'s> {
    fn of(scene: &'s Scene, spectral: &Spectral, geometry: &'s Geometry) -> Self {
        let boundary = Boundary::build(scene);
        let lit = boundary.is_some() || scene.water.is_none();
        let sun = SunBeam::build(scene, boundary.as_ref()).filter(|_| lit);
        let sun = sun.map_or([0.0; 3], |sun| {
            sun.irradiance.map(|e| e * sun.towards.z.max(0.0))
        });
        let c = spectral.wideband().c();
        let least = c.into_iter().fold(f64::INFINITY, f64::min);
        Self {
            camera: &scene.camera,
            geometry,
            boundary,
            lamps: scene.lamps.iter().map(PreparedLamp::build).collect(),
            daylight: [sun, scene.sky_radiance.map(|l| std::f64::consts::PI * l)],
            reach_m: if least > 0.0 { 1.0 / least } else { 1.0 },
        }
    }

    /// The light by two points that are seen at a fraction of the image's size: a surface, and water before it.
    fn seen(&self, (x, y): (f64, f64)) -> [Seen; 2] {
        let camera = self.camera;
        let ray = camera.ray(x * f64::from(camera.width), y * f64::from(camera.height));
        let (eye, direction) = (ray.origin_m, ray.direction);
        let hit = self
            .geometry
            .closest(eye, direction, f64::INFINITY, Primitive::None);
        let range_m = hit.map_or(self.reach_m, |hit| hit.t);
        let veil_m = VEIL * range_m.min(self.reach_m);
        [range_m, veil_m].map(|range_m| self.by(eye + direction * range_m))
    }

    /// The light by a point.
    fn by(&self, point: DVec3) -> Seen {
        let range_m = self.under_water(self.camera.position_m, point);
        let of_lamp = |lamp: &PreparedLamp| {
            let away = point - lamp.position;
            let distance = away.length().max(1e-3);
            let aside = lamp.relative_intensity(away / distance).max(ASIDE);
            let strength = lamp.level * aside / (distance * distance);
            let way_m = range_m + self.under_water(lamp.position, point);
            (lamp.intensity.map(|i| i * strength), way_m)
        };
        let down_m = self.boundary.map_or(0.0, |b| (b.height - point.z).max(0.0));
        let day = self
            .daylight
            .map(|light| (light, range_m + DAYLIGHT_WAY * down_m));
        Seen {
            lights: self.lamps.iter().map(of_lamp).chain(day).collect(),
        }
    }

    /// Length of the part of a straight line that lies in the water, m.
    fn under_water(&self, from: DVec3, to: DVec3) -> f64 {
        let length = from.distance(to);
        let Some(boundary) = self.boundary else {
            return length;
        };
        let depth = |point: DVec3| boundary.height - point.z;
        let (deeper, other) = (depth(from).max(depth(to)), depth(from).min(depth(to)));
        match (deeper > 0.0, other >= 0.0) {
            (false, _) => 0.0,
            (true, true) => length,
            (true, false) => length * deeper / (deeper - other),
        }
    }
}
