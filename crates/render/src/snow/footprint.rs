//! The light of a flake on the pixels that it covers: its own disc, the circle of a lens and the streak of an exposure.
//!
//! Every point of a flake is looked at as a point of the water in the place where it is seen: all that it does there (the
//! lamp's light, what hides it, the pixel) is that of this place. Shifting the points of all flakes alike leaves a cloud as
//! even as it was, so that the mean over clouds stays the water's.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use uw_media::Spectrum;

use super::cloud::Flake;
use super::source::Source;
use super::view::{NEAR_M, View};
use crate::sampling::Rng;
use crate::scene::Blur;

/// Radius of a disc from which on it is drawn pixel by pixel instead of point by point, pixels.
const DISC_PX: f64 = 1.5;
/// Points for each pixel of a streak, and for each square pixel of a disc's circumscribed square.
const POINTS: f64 = 8.0;
/// Most points of a flake drawn by points, and most steps of a streak drawn by discs.
const MOST_POINTS: f64 = 65_536.0;
const MOST_STEPS: f64 = 4096.0;
/// Step along a streak, as a part of the disc's radius.
const STREAK_STEP: f64 = 0.125;
/// Edge of the grid of points in a pixel of discs with a visible edge, and of larger ones.
const FINE: u32 = 2;
/// Radius of the largest disc whose pixels are looked at in more than one point, pixels.
const FINE_PX: f64 = 16.0;
/// Steps of the sequence of points (Roberts 2018, four dimensions).
const STEPS: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_125_9,
    0.628_706_721_037_808_7,
    0.538_597_257_223_61,
];

/// Light in a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) pixel: u32,
    /// Radiance, W/(m² sr).
    pub(super) light: [f32; 3],
}

/// What makes the light of flakes.
pub(super) struct Flakes<'a> {
    pub(super) view: &'a View<'a>,
    pub(super) source: &'a Source<'a>,
    pub(super) blur: Blur,
    /// Velocity of flakes past the camera in the camera's frame, m/s.
    pub(super) velocity_m_s: DVec3,
    /// Water that a flake of 1 m² of squared diameter stands for, times the flakes' share of the light, m³/m².
    pub(super) gain_m: f64,
    /// Distance along the optical axis beyond which the water stays evenly scattering, m.
    pub(super) far_m: f64,
}

/// Discs that a point of a flake is spread over, on the plane of the flake, m.
#[derive(Clone, Copy)]
struct Discs {
    flake_m: f64,
    lens_m: f64,
}

impl Flakes<'_> {
    /// How far the points of flakes of a diameter may be seen from their places at a distance, m.
    pub(super) fn reach_m(&self, diameter_m: f64, distance_m: f64) -> f64 {
        let moved_m = self.velocity_m_s.length() * self.blur.exposure_s;
        let lens_m = self.view.widest_m(distance_m.abs() + moved_m);
        0.5 * diameter_m + lens_m + moved_m
    }

    /// Adds the light of a flake at `place` in the camera's frame.
    pub(super) fn add(&self, flake: &Flake, place: DVec3, spots: &mut Vec<Spot>) {
        let moved = self.blur.exposure_s * self.velocity_m_s;
        let nearest_m = place.z.min(place.z + moved.z).max(NEAR_M);
        let discs = self.discs(flake, nearest_m);
        let scale = self.view.camera.focal_px.max_element() / nearest_m;
        let radius_px = scale * discs.flake_m.max(discs.lens_m);
        let aside = place.truncate().length() / nearest_m;
        let streak_px = scale * (moved.truncate().length() + aside * moved.z.abs());
        if radius_px < DISC_PX {
            let points =
                1.0 + POINTS * (2.0 * radius_px * radius_px + streak_px * (1.0 + radius_px));
            self.add_points(flake, place, points.min(MOST_POINTS) as u32, spots);
        } else {
            let steps = (streak_px / (STREAK_STEP * radius_px)).ceil();
            let steps = steps.clamp(1.0, MOST_STEPS) as u32;
            let grid = if radius_px < FINE_PX { FINE } else { 1 };
            for step in 0..steps {
                self.add_disc(flake, place, [step, steps], grid, spots);
            }
        }
    }

    fn discs(&self, flake: &Flake, distance_m: f64) -> Discs {
        Discs {
            flake_m: 0.5 * flake.diameter_m,
            lens_m: self.view.cone_m(distance_m),
        }
    }

    /// Point by point: each lies in one pixel.
    fn add_points(&self, flake: &Flake, place: DVec3, points: u32, spots: &mut Vec<Spot>) {
        let view = self.view;
        let mut rng = Rng::new(u64::from(flake.key), 0, 0, 1);
        let at_time = rng.uniform();
        let shift = [0; 4].map(|_| rng.uniform());
        for i in 0..points {
            let quasi = |k: usize| (shift[k] + f64::from(i) * STEPS[k]).fract();
            let time_s = self.blur.exposure_s * (f64::from(i) + at_time) / f64::from(points);
            let centre = place + time_s * self.velocity_m_s;
            let discs = self.discs(flake, centre.z);
            let offset = discs.flake_m * on_flake(quasi(0), quasi(1))
                + discs.lens_m * on_lens(quasi(2), quasi(3));
            let seen = centre + offset.extend(0.0);
            let Some((pixel, area_m2)) = self.pixel_of(seen) else {
                continue;
            };
            let volume_m2 = seen.z * seen.z * area_m2;
            let gain = self.gain(flake, seen) / (volume_m2 * f64::from(points));
            let light = self
                .source
                .at(view.to_world(seen), [rng.uniform(), rng.uniform()]);
            spots.push(spot(pixel, light, gain));
        }
    }

    /// The pixel that sees a place, and what it covers at unit distance, m².
    fn pixel_of(&self, seen: DVec3) -> Option<(usize, f64)> {
        let view = self.view;
        if !self.holds(seen.z) {
            return None;
        }
        let ideal = seen.truncate() / seen.z;
        if !(ideal.cmpge(view.lower) & ideal.cmple(view.upper)).all() {
            return None;
        }
        let (image_point, area_m2) = view.camera.project_with_area(view.to_world(seen))?;
        let pixel = view.pixel_at(image_point)?;
        (seen.z < view.depth_of(pixel)).then_some((pixel, area_m2))
    }

    /// Whether flakes are seen at a distance.
    fn holds(&self, distance_m: f64) -> bool {
        (NEAR_M..self.far_m).contains(&distance_m)
    }

    /// Water of which a flake holds the light, times the share, m³, over the cosine of the sight.
    fn gain(&self, flake: &Flake, seen: DVec3) -> f64 {
        self.gain_m * flake.diameter_m * flake.diameter_m * seen.length() / seen.z
    }

    /// Pixel by pixel, in the step of `step` = [its number, their number] along the streak: the larger disc is drawn, the
    /// smaller one moves it.
    fn add_disc(
        &self,
        flake: &Flake,
        place: DVec3,
        [step, steps]: [u32; 2],
        grid: u32,
        spots: &mut Vec<Spot>,
    ) {
        let mut rng = Rng::new(u64::from(flake.key), step, 0, 2);
        let time_s = self.blur.exposure_s * (f64::from(step) + rng.uniform()) / f64::from(steps);
        let centre = place + time_s * self.velocity_m_s;
        if !self.holds(centre.z) {
            return;
        }
        let discs = self.discs(flake, centre.z);
        let Some(([left, top], [right, bottom])) = self.pixels_around(centre, discs) else {
            return;
        };
        for row in top..bottom {
            for column in left..right {
                let at = [column, row];
                let light = self.light_of_disc(flake, centre, discs, at, grid, &mut rng);
                if let Some(light) = light {
                    let pixel = row * self.view.camera.width + column;
                    if centre.z < self.view.depth_of(pixel as usize) {
                        spots.push(spot(pixel as usize, light, 1.0 / f64::from(steps)));
                    }
                }
            }
        }
    }

    /// Columns and rows that hold all that discs around `centre` cover: first ones, and those after the last ones.
    fn pixels_around(&self, centre: DVec3, discs: Discs) -> Option<([u32; 2], [u32; 2])> {
        let view = self.view;
        let camera = view.camera;
        let reach = (discs.flake_m + discs.lens_m) / centre.z;
        let ideal = centre.truncate() / centre.z;
        let (lower, upper) = (ideal - reach, ideal + reach);
        if !(lower.cmple(view.upper) & upper.cmpge(view.lower)).all() {
            return None;
        }
        let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        let (mut first, mut last) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (lower, upper) = (lower.max(view.lower), upper.min(view.upper));
        for i in 0..=2 {
            for j in 0..=2 {
                let ideal = lower + 0.5 * DVec2::new(f64::from(i), f64::from(j)) * (upper - lower);
                let corner = camera.project(view.to_world(ideal.extend(1.0)))?;
                first = first.min(corner);
                last = last.max(corner);
            }
        }
        // A distorted edge may bend out between its corners.
        let room = match camera.lens.is_ideal() {
            true => DVec2::ZERO,
            false => 1.0 + 0.1 * (last - first),
        };
        let first = (first - room).floor().max(DVec2::ZERO);
        let last = (last + room).ceil().min(size);
        let whole = |corner: DVec2| [corner.x.max(0.0) as u32, corner.y.max(0.0) as u32];
        Some((whole(first), whole(last)))
    }

    /// Radiance in a pixel that a disc brings, from random points in `grid` × `grid` parts of the pixel; `None` where it
    /// covers none of them.
    fn light_of_disc(
        &self,
        flake: &Flake,
        centre: DVec3,
        discs: Discs,
        [column, row]: [u32; 2],
        grid: u32,
        rng: &mut Rng,
    ) -> Option<Spectrum> {
        let view = self.view;
        let (large_m, of_flake) = match discs.flake_m > discs.lens_m {
            true => (discs.flake_m, true),
            false => (discs.lens_m, false),
        };
        let mut sum = None;
        for part in 0..grid * grid {
            let within =
                |index: u32, rng: &mut Rng| (f64::from(index) + rng.uniform()) / f64::from(grid);
            let px = f64::from(column) + within(part % grid, rng);
            let py = f64::from(row) + within(part / grid, rng);
            let direction = view.turned(view.camera.direction(px, py));
            let seen = centre.z / direction.z * direction;
            let small = [rng.uniform(), rng.uniform()];
            let small = match of_flake {
                true => discs.lens_m * on_lens(small[0], small[1]),
                false => discs.flake_m * on_flake(small[0], small[1]),
            };
            let aside = ((seen - centre).truncate() - small).length_squared() / (large_m * large_m);
            if aside >= 1.0 {
                continue;
            }
            let density = match of_flake {
                true => 2.0 * (1.0 - aside),
                false => 1.0,
            };
            let gain = self.gain(flake, seen) * density / (PI * large_m * large_m);
            let gain = gain / f64::from(grid * grid);
            let on_lamp = [rng.uniform(), rng.uniform()];
            let light = self.source.at(view.to_world(seen), on_lamp);
            let sum = sum.get_or_insert([0.0; 3]);
            (0..3).for_each(|k| sum[k] += gain * light[k]);
        }
        sum
    }
}

fn spot(pixel: usize, light: Spectrum, gain: f64) -> Spot {
    Spot {
        pixel: pixel as u32,
        light: light.map(|light| (gain * light) as f32),
    }
}

/// A point of a flake of radius 1, which is densest in its middle: its density falls as 1 - r².
fn on_flake(u: f64, v: f64) -> DVec2 {
    (1.0 - (1.0 - u).sqrt()).sqrt() * DVec2::from_angle(TAU * v)
}

/// A point of an even disc of radius 1.
fn on_lens(u: f64, v: f64) -> DVec2 {
    u.sqrt() * DVec2::from_angle(TAU * v)
}
