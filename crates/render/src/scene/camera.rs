//! The camera: from image points to rays, and from points of the world to image points.

use glam::{DVec2, DVec3};

use super::lens::{Lens, Opening};
use super::port::{Leaving, Port};
use super::{Camera, Scene};

/// Largest image side, pixels.
pub(super) const MAX_SIDE_PX: u32 = 16_384;
/// Most pixels of an image; about 1.5 GiB for one RGB picture and its variance in float32 and float64.
pub(super) const MAX_PIXELS: u64 = 1 << 26;
/// Smallest focal length, pixels.
pub(super) const LEAST_FOCAL_PX: f64 = 1e-3;
/// Points per image side at which lens and port are checked when a scene is read.
const CHECKED_POINTS: u32 = 16;
/// Sine of the smallest angle from 90° off the optical axis that counts as ahead, which is 0.06°.
pub(super) const LEAST_AHEAD: f64 = 1e-3;
/// Angle by which directions differ for what an angle covers in the image, rad.
const SMALL_ANGLE: f64 = 1e-5;

/// A size that no picture can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "width and height must be in 1..={} pixels and at most {} pixels in all, got {width} × {height}",
    MAX_SIDE_PX,
    MAX_PIXELS
)]
pub struct SizeError {
    /// Width asked for or implied, pixels.
    pub width: u32,
    /// Height asked for or implied, pixels.
    pub height: u32,
}

/// A ray that the camera looks along, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Where it starts, m: the centre of projection, or a point of the outer side of the port.
    pub origin_m: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

impl Scene {
    /// The camera with what its port looks into: the scene's water, or air where the camera is above the surface or there is no
    /// water. A scene that was read has this camera already; one whose camera was moved may not.
    pub fn placed_camera(&self) -> Camera {
        let water_index = self.water.as_ref().map(|water| water.refractive_index);
        let surface_m = self.surface.map(|surface| surface.height_m);
        self.camera.placed(water_index, surface_m)
    }
}

/// Whether a picture can have a size, pixels.
pub(super) fn is_size(width: u32, height: u32) -> bool {
    let is_side = |side| (1..=MAX_SIDE_PX).contains(&side);
    is_side(width) && is_side(height) && u64::from(width) * u64::from(height) <= MAX_PIXELS
}

impl Camera {
    /// An ideal camera with a focal length of one image width and its principal point in the middle.
    /// `forward` and `up` are unit vectors that are not parallel.
    pub(super) fn looking(
        position_m: DVec3,
        forward: DVec3,
        up: DVec3,
        width: u32,
        height: u32,
    ) -> Self {
        let right = forward.cross(up).normalize();
        let size = DVec2::new(f64::from(width), f64::from(height));
        Self {
            position_m,
            forward,
            right,
            down: forward.cross(right),
            width,
            height,
            focal_px: DVec2::splat(size.x),
            centre_px: size / 2.0,
            lens: Lens::default(),
            opening: None,
            port: None,
        }
    }

    /// The same camera with another size, pixels; one side alone keeps the proportions. The horizontal field of view stays,
    /// pixels keep their proportions.
    ///
    /// # Errors
    /// A size that no picture can have.
    pub fn resized(&self, width: Option<u32>, height: Option<u32>) -> Result<Self, SizeError> {
        let scaled = |side: u32, factor: f64| (f64::from(side) * factor).round() as u32;
        let (width, height) = match (width, height) {
            (None, None) => return Ok(self.clone()),
            (Some(width), Some(height)) => (width, height),
            (Some(width), None) => {
                let factor = f64::from(width) / f64::from(self.width);
                (width, scaled(self.height, factor))
            }
            (None, Some(height)) => {
                let factor = f64::from(height) / f64::from(self.height);
                (scaled(self.width, factor), height)
            }
        };
        if !is_size(width, height) {
            return Err(SizeError { width, height });
        }
        let factor = f64::from(width) / f64::from(self.width);
        let below_middle = self.centre_px.y - 0.5 * f64::from(self.height);
        Ok(Self {
            width,
            height,
            focal_px: factor * self.focal_px,
            centre_px: DVec2::new(
                factor * self.centre_px.x,
                0.5 * f64::from(height) + factor * below_middle,
            ),
            ..self.clone()
        })
    }

    /// The camera with what its port looks into: water of that refractive index below a surface at that height, m, or everywhere,
    /// or air.
    pub fn placed(&self, water_index: Option<f64>, surface_m: Option<f64>) -> Self {
        let above = surface_m.is_some_and(|height_m| self.position_m.z > height_m);
        let outside_index = water_index.filter(|_| !above).unwrap_or(1.0);
        Self {
            port: self.port.map(|port| Port {
                outside_index,
                ..port
            }),
            ..self.clone()
        }
    }

    /// The ray through the image point (`px`, `py`), pixels from the top left corner, in the world; with a port as it goes on
    /// outside. Meant for points within the image.
    ///
    /// It is the ray through the middle of the lens's opening, where there is one.
    pub fn ray(&self, px: f64, py: f64) -> CameraRay {
        self.ray_from(px, py, DVec2::ZERO)
    }

    /// The same from a point of the lens's opening (right, down) in its radii, of a length up to 1; without an opening all are one.
    pub fn ray_from(&self, px: f64, py: f64, on_opening: DVec2) -> CameraRay {
        let seen = (DVec2::new(px, py) - self.centre_px) / self.focal_px;
        let chief = self.lens.towards(seen);
        let (from, towards) = match &self.opening {
            None => (DVec3::ZERO, chief),
            Some(opening) => {
                let size = (0.5 * opening.diameter_m, self.focus_inside_m(opening));
                self.lens.through_opening(chief, on_opening, size)
            }
        };
        match &self.port {
            None => CameraRay {
                origin_m: self.position_m + self.turned_to_world(from),
                direction: self.turned_to_world(towards).normalize(),
            },
            Some(port) => {
                let Leaving { point, direction } = port.outwards(from, towards.normalize());
                CameraRay {
                    origin_m: self.position_m + self.turned_to_world(point),
                    direction: self.turned_to_world(direction).normalize(),
                }
            }
        }
    }

    /// Distance in front of the lens at which what is in focus appears, m: behind a port nearer than it is.
    pub(crate) fn focus_inside_m(&self, opening: &Opening) -> f64 {
        let port = self.port.as_ref();
        port.map_or(opening.focus_m, |port| port.appears_at_m(opening.focus_m))
    }

    /// Largest reach of the lens's opening from the centre of projection, m.
    pub(crate) fn opening_radius_m(&self) -> f64 {
        self.opening.map_or(0.0, |opening| 0.5 * opening.diameter_m)
    }

    /// Unit direction, in the world, of [`Camera::ray`].
    pub fn direction(&self, px: f64, py: f64) -> DVec3 {
        self.ray(px, py).direction
    }

    /// Image point, pixels from the top left corner, of a point in the world, m; it may lie outside the image.
    /// `None` for points that the lens does not see, such as those behind a camera without fisheye, or that are not before the
    /// port. What stands in between is not looked at.
    pub fn project(&self, point_m: DVec3) -> Option<DVec2> {
        let seen = self.lens.seen(self.inside(point_m)?)?;
        Some(self.centre_px + seen * self.focal_px)
    }

    /// The image point of [`Camera::project`], and the area that a pixel there covers on a plane perpendicular to the
    /// optical axis at a distance of 1 m along it, m²; for cameras without a port, of points less than 90° off the axis.
    pub fn project_with_area(&self, point_m: DVec3) -> Option<(DVec2, f64)> {
        let (seen, stretch) = self.lens.seen_with_stretch(self.inside(point_m)?)?;
        let area = 1.0 / (stretch * self.focal_px.x * self.focal_px.y);
        Some((self.centre_px + seen * self.focal_px, area))
    }

    /// How many pixels of the image a small angle has, per rad, about a point in the world as it is seen from the centre of
    /// projection: for directions that differ across the optical axis, or, with a fisheye or a port, the larger one of two.
    pub fn pixels_per_rad(&self, point_m: DVec3) -> Option<f64> {
        if self.port.is_none() && matches!(self.lens, Lens::Perspective(_)) {
            return Some(self.focal_px.max_element());
        }
        let middle = self.project(point_m)?;
        let offset = point_m - self.position_m;
        let step_m = SMALL_ANGLE * offset.length();
        let (u, v) = offset.try_normalize()?.any_orthonormal_pair();
        let moved = |across: DVec3| {
            let seen = self.project(point_m + step_m * across)?;
            Some((seen - middle).length() / SMALL_ANGLE)
        };
        Some(moved(u)?.max(moved(v)?))
    }

    /// Right, down and forward parts of the way to a point in the world, m.
    fn parts_of(&self, point_m: DVec3) -> DVec3 {
        let offset = point_m - self.position_m;
        DVec3::new(
            offset.dot(self.right),
            offset.dot(self.down),
            offset.dot(self.forward),
        )
    }

    /// A vector of the world from its right, down and forward parts.
    fn turned_to_world(&self, parts: DVec3) -> DVec3 {
        self.forward * parts.z + self.right * parts.x + self.down * parts.y
    }

    /// Direction (right, down, forward) along which the lens sees a point in the world; not of unit length.
    fn inside(&self, point_m: DVec3) -> Option<DVec3> {
        let towards = self.parts_of(point_m);
        match &self.port {
            None => Some(towards),
            Some(port) => port.inwards(towards),
        }
    }

    /// Whether `holds` at points all over the image, its edges included; they are in focal lengths from the principal point.
    fn all_over(&self, holds: impl Fn(DVec2) -> bool) -> bool {
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        (0..=CHECKED_POINTS).all(|j| {
            (0..=CHECKED_POINTS).all(|i| {
                let corner = DVec2::new(f64::from(i), f64::from(j)) / f64::from(CHECKED_POINTS);
                holds((corner * size - self.centre_px) / self.focal_px)
            })
        })
    }

    /// Whether the inverse of the lens is found all over the image, on the branch that holds its centre.
    pub(super) fn is_invertible(&self) -> bool {
        self.all_over(|seen| self.lens.is_invertible_at(seen))
    }

    /// Whether the camera shows marine snow: without a port, and where all of the image is less than 90° off the optical axis.
    pub fn shows_flakes(&self) -> bool {
        self.port.is_none() && self.looks_ahead(LEAST_AHEAD)
    }

    /// Whether the lens looks ahead all over the image, by an angle of at least `least` (its sine) from 90° off the axis.
    pub(super) fn looks_ahead(&self, least: f64) -> bool {
        self.all_over(|seen| self.lens.towards(seen).normalize().z >= least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PortShape;

    fn camera(lens: Lens) -> Camera {
        let forward = DVec3::new(1.0, 0.2, -0.1).normalize();
        Camera {
            focal_px: DVec2::new(280.0, 275.0),
            centre_px: DVec2::new(161.3, 88.8),
            lens,
            ..Camera::looking(DVec3::new(0.4, -2.0, 1.0), forward, DVec3::Z, 320, 180)
        }
    }

    #[test]
    fn direction_agrees_with_the_reference_scenes() {
        // The reference pictures say: the ray through (px, py) is (1, -(px - 160) / f, -(py - 90) / f), f = 277.13.
        let mut camera = Camera::looking(DVec3::ZERO, DVec3::X, DVec3::Z, 320, 180);
        let focal_px = camera.lens.focal_length_px(60.0, 320);
        camera.focal_px = DVec2::splat(focal_px.expect("perspective"));
        assert!((camera.focal_px.x - 277.13).abs() < 0.005);
        let f = camera.focal_px.x;
        for (px, py) in [(0.0, 0.0), (320.0, 0.0), (17.5, 170.5), (160.0, 90.0)] {
            let expected = DVec3::new(1.0, -(px - 160.0) / f, -(py - 90.0) / f).normalize();
            assert!((camera.direction(px, py) - expected).length() < 1e-15);
        }
    }

    /// Lenses and ports of all kinds.
    fn cameras() -> Vec<Camera> {
        let lenses = [
            Lens::default(),
            Lens::brown_conrady([-0.28, 0.11, 0.001, -0.0007, -0.02]),
            Lens::brown_conrady([0.2, 0.05, -0.002, 0.003, 0.01]),
            Lens::Perspective([0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021]),
            Lens::Fisheye([0.02, -0.01, 0.003, -0.0004]),
        ];
        let shapes = [
            PortShape::Flat { distance_m: 0.02 },
            PortShape::Dome {
                radius_m: 0.05,
                offset_m: DVec3::ZERO,
            },
            PortShape::Dome {
                radius_m: 0.05,
                offset_m: DVec3::new(0.002, -0.004, -0.012),
            },
        ];
        let ports = shapes.map(|shape| {
            Some(Port {
                shape,
                thickness_m: 0.008,
                glass_index: 1.49,
                outside_index: 1.34,
            })
        });
        let with = |lens| {
            [None].into_iter().chain(ports).map(move |port| Camera {
                port,
                ..camera(lens)
            })
        };
        lenses.into_iter().flat_map(with).collect()
    }

    #[test]
    fn projecting_a_point_of_a_ray_returns_to_its_pixel() {
        for camera in cameras() {
            assert!(camera.is_invertible());
            for i in 0..=32 {
                for j in 0..=18 {
                    let pixel = DVec2::new(f64::from(i), f64::from(j)) * 10.0;
                    let ray = camera.ray(pixel.x, pixel.y);
                    assert!((ray.direction.length() - 1.0).abs() < 1e-14);
                    for range_m in [0.05, 3.0, 1e4] {
                        let back = camera.project(ray.origin_m + ray.direction * range_m);
                        let back = back.unwrap_or_else(|| panic!("{pixel} of {camera:?}"));
                        assert!(
                            (back - pixel).length() < 1e-8,
                            "{pixel} came back as {back}: {camera:?}"
                        );
                    }
                }
            }
        }
    }

    /// A wide fisheye behind a dome sees behind itself.
    #[test]
    fn a_dome_shows_what_is_behind_the_camera() {
        let dome = cameras()[3].port;
        let camera = Camera {
            focal_px: DVec2::splat(70.0),
            port: dome,
            ..camera(Lens::Fisheye([0.0; 4]))
        };
        let ray = camera.ray(2.0, 90.0);
        assert!(ray.direction.dot(camera.forward) < -0.5);
        let back = camera.project(ray.origin_m + 2.0 * ray.direction);
        assert!((back.expect("seen") - DVec2::new(2.0, 90.0)).length() < 1e-9);
    }

    #[test]
    fn points_that_cannot_be_seen_have_no_place() {
        let plain = camera(Lens::brown_conrady([-0.2, 0.0, 0.0, 0.0, 0.0]));
        assert_eq!(plain.project(plain.position_m - plain.forward), None);
        for camera in cameras().into_iter().filter(|camera| camera.port.is_some()) {
            let (eye, ahead) = (camera.position_m, camera.forward);
            assert_eq!(camera.project(eye + 0.01 * ahead), None, "{camera:?}");
            assert!(camera.project(eye + 0.1 * ahead).is_some());
        }
        let folding = camera(Lens::brown_conrady([-3.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(!folding.is_invertible());
    }

    /// Of a distant point, a flat port makes its angles as many times larger as the water's index says.
    #[test]
    fn pixels_of_a_small_angle() {
        let plain = camera(Lens::default());
        let flat = Camera {
            port: cameras()[1].port,
            ..plain.clone()
        };
        let far = plain.position_m + 1e4 * plain.forward;
        assert_eq!(plain.pixels_per_rad(far), Some(280.0));
        let behind_glass = flat.pixels_per_rad(far).expect("seen");
        assert!((behind_glass / 280.0 - 1.34).abs() < 1e-3, "{behind_glass}");
    }
}
