//! The port of an underwater housing: exact refraction from the air behind it through glass into what surrounds the camera.
//!
//! Points and directions are (right, down, forward) from the centre of projection. Twin of the way outwards:
//! `shaders/common/lens.wgsl`.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

/// Halvings of the angle under which a point is looked for; by then it is exact to the last bit.
const HALVINGS: usize = 64;
/// Least part of a direction along the axis of a flat port: rays that run beside it graze it.
const LEAST_AHEAD: f64 = 1e-12;

/// A port before a camera in air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port {
    /// Shape of its inner side.
    pub shape: PortShape,
    /// Thickness of the glass, m, >= 0.
    pub thickness_m: f64,
    /// Refractive index of the glass against air, in [1, 3].
    pub glass_index: f64,
    /// Refractive index of what is outside: that of the scene's water, or 1 where the camera is in the air.
    pub outside_index: f64,
}

/// Shape of the inner side of a port.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PortShape {
    /// A plane across the optical axis.
    Flat {
        /// Distance of the glass from the centre of projection, m, > 0.
        distance_m: f64,
    },
    /// A sphere around the centre of projection or a point near it.
    Dome {
        /// Radius of the inner side, m, > 0.
        radius_m: f64,
        /// Middle of the sphere (right, down, forward) from the centre of projection, m; shorter than the radius.
        offset_m: DVec3,
    },
}

/// Where and along which unit direction a ray leaves the port.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaving {
    pub(super) point: DVec3,
    pub(super) direction: DVec3,
}

impl Port {
    /// The ray outside that goes on from the unit direction `inside` at the point `from`, which is behind the port.
    pub(super) fn outwards(&self, from: DVec3, inside: DVec3) -> Leaving {
        let left = match self.shape {
            PortShape::Flat { distance_m } => self.through_plane(distance_m - from.z, inside),
            PortShape::Dome { radius_m, offset_m } => {
                self.through_sphere(radius_m, offset_m - from, inside)
            }
        };
        Leaving {
            point: from + left.point,
            ..left
        }
    }

    /// Distance of the outer side along the optical axis, m.
    pub(super) fn outer_m(&self) -> f64 {
        let inner_m = match self.shape {
            PortShape::Flat { distance_m } => distance_m,
            PortShape::Dome { radius_m, offset_m } => offset_m.z + radius_m,
        };
        inner_m + self.thickness_m
    }

    /// Distance at which a point of the optical axis outside appears from within, m, to first order (as if a dome were decentred along the
    /// axis alone); the point is beyond [`Port::outer_m`].
    pub(super) fn appears_at_m(&self, distance_m: f64) -> f64 {
        // One over the radius of a side, negative as its middle lies towards the camera.
        let bend = |side_m: f64| match self.shape {
            PortShape::Flat { .. } => 0.0,
            PortShape::Dome { offset_m, .. } => 1.0 / (offset_m.z - side_m),
        };
        let (outer_m, inner_m) = (self.outer_m(), self.outer_m() - self.thickness_m);
        // A ray to the point, followed back by its slope and its height over the axis: n u = n' u' + y (n' - n) / R.
        let before = |side_m: f64, (slope, height_m): (f64, f64), [n, behind]: [f64; 2]| {
            (behind * slope + height_m * (behind - n) * bend(side_m)) / n
        };
        let height_m = outer_m - distance_m;
        let indices = [self.glass_index, self.outside_index];
        let in_glass = before(outer_m, (1.0, height_m), indices);
        let height_m = height_m - in_glass * self.thickness_m;
        let in_air = before(inner_m, (in_glass, height_m), [1.0, self.glass_index]);
        inner_m - height_m / in_air
    }

    fn through_plane(&self, distance_m: f64, inside: DVec3) -> Leaving {
        let across = inside.truncate();
        let in_glass = across / self.glass_index;
        let outside = across / self.outside_index;
        let to_glass = distance_m / inside.z.max(LEAST_AHEAD);
        let through_glass = self.thickness_m / (1.0 - in_glass.length_squared()).sqrt();
        let point = to_glass * across + through_glass * in_glass;
        let ahead = (1.0 - outside.length_squared()).max(0.0).sqrt();
        Leaving {
            point: point.extend(distance_m + self.thickness_m),
            direction: outside.extend(ahead),
        }
    }

    fn through_sphere(&self, radius_m: f64, middle: DVec3, inside: DVec3) -> Leaving {
        let outer_m = radius_m + self.thickness_m;
        let along = inside.dot(middle);
        let reach = radius_m * radius_m - middle.length_squared();
        let to_glass = along + (along * along + reach).sqrt();
        let from_middle = to_glass * inside - middle;
        let in_glass = refracted(inside, from_middle / radius_m, 1.0 / self.glass_index);
        // The shell is outer² - inner² = thickness · (outer + inner).
        let shell = self.thickness_m * (outer_m + radius_m);
        let outward = from_middle.dot(in_glass);
        let through_glass = shell / (outward + (outward * outward + shell).sqrt());
        let from_middle = from_middle + through_glass * in_glass;
        Leaving {
            point: middle + from_middle,
            direction: refracted(
                in_glass,
                from_middle / outer_m,
                self.glass_index / self.outside_index,
            ),
        }
    }

    /// The unit direction inside along which a point outside is seen; `None` for a point that is not before the port.
    pub(super) fn inwards(&self, point: DVec3) -> Option<DVec3> {
        let (axis, largest) = match self.shape {
            PortShape::Flat { distance_m } => {
                if point.z <= distance_m + self.thickness_m {
                    return None;
                }
                (DVec3::Z, FRAC_PI_2)
            }
            PortShape::Dome { radius_m, offset_m } => {
                if point.distance(offset_m) <= radius_m + self.thickness_m {
                    return None;
                }
                (offset_m.try_normalize().unwrap_or(DVec3::Z), PI)
            }
        };
        // By symmetry the whole ray lies in the plane of the axis and the point.
        let along = point.dot(axis);
        let across = point - along * axis;
        let beside = across
            .try_normalize()
            .unwrap_or(axis.any_orthonormal_vector());
        let inside = |angle: f64| angle.cos() * axis + angle.sin() * beside;
        let in_plane = |v: DVec3| DVec2::new(v.dot(axis), v.dot(beside));
        // On which side of a ray the point lies: further from the axis where positive.
        let side = |angle: f64| {
            let ray = self.outwards(DVec3::ZERO, inside(angle));
            in_plane(ray.direction).perp_dot(in_plane(point - ray.point))
        };
        let (mut low, mut high) = (0.0, largest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match side(middle) > 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        let found = inside(0.5 * (low + high));
        let ray = self.outwards(DVec3::ZERO, found);
        ((point - ray.point).dot(ray.direction) > 0.0).then_some(found)
    }
}

/// Snell's law: the direction behind a surface with the unit `normal` along the way; `ratio` is the index before over that
/// behind.
fn refracted(direction: DVec3, normal: DVec3, ratio: f64) -> DVec3 {
    let before = direction.dot(normal);
    let behind = (1.0 - ratio * ratio * (1.0 - before * before))
        .max(0.0)
        .sqrt();
    ratio * direction + (behind - ratio * before) * normal
}
