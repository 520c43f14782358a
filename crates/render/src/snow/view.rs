//! What the camera sees of the water: its frustum, and how far each pixel sees.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::prepare::{Prepared, Primitive};
use crate::scene::Camera;

/// Distance along the optical axis nearer than which the water stays evenly scattering, m.
pub(super) const NEAR_M: f64 = 0.01;
/// Points along each edge of the image that tell how wide the view is.
const EDGE_POINTS: u32 = 32;

/// The camera's view of the water.
pub(super) struct View<'a> {
    pub(super) camera: &'a Camera,
    /// Distance along the optical axis of what the middle of each pixel sees, m; infinite where there is nothing.
    depth_m: Vec<f64>,
    /// Least and largest image coordinates at unit distance without distortion.
    pub(super) lower: DVec2,
    pub(super) upper: DVec2,
}

impl<'a> View<'a> {
    /// The view of `scene`.
    pub(super) fn new(scene: &'a Prepared) -> Self {
        let camera = &scene.camera;
        let depth_of = |column: u32, row: u32| {
            let direction = camera.direction(f64::from(column) + 0.5, f64::from(row) + 0.5);
            let origin = camera.position_m;
            let hit = scene
                .geometry
                .closest(origin, direction, f64::INFINITY, Primitive::None);
            hit.map_or(f64::INFINITY, |hit| hit.t * direction.dot(camera.forward))
        };
        let rows = (0..camera.height).into_par_iter();
        let depth_m = match scene.geometry.is_empty() {
            true => vec![f64::INFINITY; camera.width as usize * camera.height as usize],
            false => rows
                .flat_map_iter(|row| (0..camera.width).map(move |column| depth_of(column, row)))
                .collect(),
        };
        let (lower, upper) = extent(camera);
        Self {
            camera,
            depth_m,
            lower,
            upper,
        }
    }

    /// Radius, at a distance, of what the lens's opening sees in one point in focus, m.
    pub(super) fn cone_m(&self, distance_m: f64) -> f64 {
        let opening = self.camera.opening.as_ref();
        opening.map_or(0.0, |opening| opening.cone_m(distance_m))
    }

    /// At least that radius up to a distance, m.
    pub(super) fn widest_m(&self, distance_m: f64) -> f64 {
        let opening = self.camera.opening.as_ref();
        opening.map_or(0.0, |opening| opening.widest_m(distance_m))
    }

    /// How far a pixel sees along the optical axis, m.
    pub(super) fn depth_of(&self, pixel: usize) -> f64 {
        self.depth_m[pixel]
    }

    /// How far the pixel that sees farthest does, m.
    pub(super) fn deepest_m(&self) -> f64 {
        self.depth_m.iter().copied().fold(0.0, f64::max)
    }

    /// Area that the image covers on a plane at unit distance, m², at most.
    pub(super) fn area_m2(&self) -> f64 {
        let size = self.upper - self.lower;
        size.x * size.y
    }

    /// Right, down and forward of a place in the world, from the camera, m.
    pub(super) fn to_camera_frame(&self, point_m: DVec3) -> DVec3 {
        self.turned(point_m - self.camera.position_m)
    }

    /// Right, down and forward parts of a vector of the world.
    pub(super) fn turned(&self, vector: DVec3) -> DVec3 {
        let camera = self.camera;
        DVec3::new(
            vector.dot(camera.right),
            vector.dot(camera.down),
            vector.dot(camera.forward),
        )
    }

    /// The world's place of one in the camera's frame.
    pub(super) fn to_world(&self, point: DVec3) -> DVec3 {
        let camera = self.camera;
        camera.position_m
            + point.x * camera.right
            + point.y * camera.down
            + point.z * camera.forward
    }

    /// The pixel that holds an image point.
    pub(super) fn pixel_at(&self, image_point: DVec2) -> Option<usize> {
        let (width, height) = (self.camera.width, self.camera.height);
        let inside = image_point.x >= 0.0
            && image_point.y >= 0.0
            && image_point.x < f64::from(width)
            && image_point.y < f64::from(height);
        inside.then(|| image_point.y as usize * width as usize + image_point.x as usize)
    }

    /// Whether a ball around a point of the camera's frame may reach into the view up to `far_m`.
    pub(super) fn may_see(&self, middle: DVec3, radius_m: f64, far_m: f64) -> bool {
        let beside = |coordinate: f64, edge: f64| {
            (coordinate - edge * middle.z) / (1.0 + edge * edge).sqrt()
        };
        middle.z > NEAR_M - radius_m
            && middle.z < far_m + radius_m
            && beside(middle.x, self.lower.x) > -radius_m
            && beside(middle.y, self.lower.y) > -radius_m
            && beside(middle.x, self.upper.x) < radius_m
            && beside(middle.y, self.upper.y) < radius_m
    }

    /// The corners of the frustum up to `far_m` in the world, m.
    pub(super) fn corners(&self, far_m: f64) -> [DVec3; 5] {
        let at = |x: f64, y: f64| self.to_world(far_m * DVec3::new(x, y, 1.0));
        let (lower, upper) = (self.lower, self.upper);
        [
            self.camera.position_m,
            at(lower.x, lower.y),
            at(upper.x, lower.y),
            at(lower.x, upper.y),
            at(upper.x, upper.y),
        ]
    }
}

/// Image coordinates at unit distance that hold the whole image.
fn extent(camera: &Camera) -> (DVec2, DVec2) {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let along = (0..=EDGE_POINTS).map(|i| f64::from(i) / f64::from(EDGE_POINTS));
    let edges = along.flat_map(|t| {
        [
            (t * width, 0.0),
            (t * width, height),
            (0.0, t * height),
            (width, t * height),
        ]
    });
    let (mut lower, mut upper) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (px, py) in edges {
        let direction = camera.direction(px, py);
        let ideal = DVec2::new(direction.dot(camera.right), direction.dot(camera.down))
            / direction.dot(camera.forward);
        lower = lower.min(ideal);
        upper = upper.max(ideal);
    }
    // Between the points a distorted edge may bend out a little.
    let room = match camera.lens.is_ideal() {
        true => 0.0,
        false => 0.01,
    };
    let room = room * (upper - lower);
    (lower - room, upper + room)
}
