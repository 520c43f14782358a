//! Image points around small lamps that the camera looks at.
//!
//! Towards a point lamp the radiance grows like a power of the angle between 1/θ and 1/θ², in peaked phase functions
//! almost the latter: integrable over a pixel, its square is not. In the pixels around such a lamp half of the image
//! points are drawn with a density of 1/r² about it, r evenly in its logarithm, down to a smallest distance, and evenly within.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::{
    integrator::sampling::circle,
    prepare::{Prepared, PreparedLamp},
};

/// Share of image points drawn around lamps.
const SHARE: f64 = 0.5;
/// Largest distance from the lamp, pixels: a pixel whose centre is closer has a part in its peak.
const REACH_PX: f64 = 1.5;
/// Weight of what is within the smallest distance, in units of ln r: the density has no step there.
const DISC: f64 = 0.5;
/// Smallest distance, pixels. Single directions cannot tell smaller ones apart.
const LEAST_PX: f64 = 1e-9;

/// A small lamp in the image.
#[derive(Clone, Copy, Debug)]
struct Spot {
    centre_px: DVec2,
    /// ln(REACH_PX / smallest distance).
    octaves: f64,
}

/// All small lamps in the image.
#[derive(Clone, Debug, Default)]
pub(super) struct LampPixels {
    spots: Vec<Spot>,
}

/// An image point and the factor of what is seen there; `None` outside the pixel.
pub(super) type Placed = Option<(f64, f64, f64)>;

impl LampPixels {
    /// The lamps in `active` and their mirror images in the water surface, as a camera in the water sees them.
    pub(super) fn new(scene: &Prepared, active: &[usize]) -> Self {
        let mut spots = Vec::new();
        if scene.in_air(scene.camera.position_m) {
            return Self { spots };
        }
        for &i in active {
            let lamp = &scene.lamps[i];
            spots.extend(spot(scene, lamp, lamp.position));
            if scene.boundary.is_some() {
                spots.extend(spot(scene, lamp, scene.mirror(lamp.position)));
            }
        }
        Self { spots }
    }

    /// An image point of pixel (`column`, `row`) from two numbers in (0, 1).
    pub(super) fn place(&self, column: u32, row: u32, u: f64, v: f64) -> Placed {
        let corner = DVec2::new(f64::from(column), f64::from(row));
        let near = |s: &&Spot| s.centre_px.distance(corner + 0.5) < REACH_PX;
        let count = self.spots.iter().filter(near).count();
        if count == 0 {
            return Some((corner.x + u, corner.y + v, 1.0));
        }
        let pick = u / SHARE * count as f64;
        let point = match self.spots.iter().filter(near).nth(pick as usize) {
            Some(spot) if u < SHARE => spot.sample(pick.fract(), v),
            _ => corner + DVec2::new((u - SHARE) / (1.0 - SHARE), v),
        };
        let within = point - corner;
        if within.min_element() < 0.0 || within.max_element() >= 1.0 {
            return None;
        }
        let around: f64 = self
            .spots
            .iter()
            .filter(near)
            .map(|s| s.density(point))
            .sum();
        let density = 1.0 - SHARE + SHARE * around / count as f64;
        Some((point.x, point.y, 1.0 / density))
    }
}

/// The spot of a lamp seen at `position`, where it is smaller than a pixel.
fn spot(scene: &Prepared, lamp: &PreparedLamp, position: glam::DVec3) -> Option<Spot> {
    let camera = &scene.camera;
    let centre_px = camera.project(position)?;
    let distance = position.distance(camera.position_m);
    let radius_px = lamp.radius / distance * camera.focal_px.max_element();
    let seen = centre_px.cmpge(DVec2::splat(-REACH_PX)).all()
        && centre_px.x < f64::from(camera.width) + REACH_PX
        && centre_px.y < f64::from(camera.height) + REACH_PX;
    (seen && radius_px < 0.5).then(|| Spot {
        centre_px,
        octaves: (REACH_PX / radius_px.max(LEAST_PX)).ln(),
    })
}

impl Spot {
    fn sample(&self, u: f64, v: f64) -> DVec2 {
        let x = u * (self.octaves + DISC);
        let r = if x < self.octaves {
            REACH_PX * (-x).exp()
        } else {
            self.least_px() * ((x - self.octaves) / DISC).sqrt()
        };
        let (sin, cos) = circle(v);
        self.centre_px + r * DVec2::new(cos, sin)
    }

    fn least_px(&self) -> f64 {
        REACH_PX * (-self.octaves).exp()
    }

    /// Density per square pixel.
    fn density(&self, point: DVec2) -> f64 {
        let r2 = point.distance_squared(self.centre_px);
        if r2 > REACH_PX * REACH_PX {
            return 0.0;
        }
        1.0 / (TAU * (self.octaves + DISC) * r2.max(self.least_px().powi(2)))
    }
}
