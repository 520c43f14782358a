//! Where the rays of an image meet a flat target.

use glam::{DVec2, DVec3};
use uw_render::scene::{Camera, Quad, Scene};

/// A camera that sees nothing but a flat target.
#[derive(Clone, Debug)]
pub struct TargetView {
    /// The camera.
    pub camera: Camera,
    /// Unit normal of the target on the camera's side.
    pub normal: DVec3,
    corner: DVec3,
    right: DVec3,
    down: DVec3,
    size_m: DVec2,
    tile_m: DVec2,
}

/// A point of the target as an image point sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Image coordinates in [-1, 1].
    pub image: (f64, f64),
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// Length of the ray, m.
    pub range_m: f64,
    /// The point, m.
    pub point: DVec3,
}

/// A ray of the image misses the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the image must show the target alone, but one of its corners sees past it: go nearer or deeper (a wall ends at the water surface), or take a smaller field of view"
)]
pub struct BeyondTarget;

impl TargetView {
    /// The view of the scene's first quad.
    pub fn new(scene: &Scene) -> Result<Self, BeyondTarget> {
        let quad: &Quad = scene.quads.first().ok_or(BeyondTarget)?;
        let size_m = 2.0 * DVec2::new(quad.half_u.length(), quad.half_v.length());
        let (right, down) = (quad.half_u.normalize(), -quad.half_v.normalize());
        let view = Self {
            camera: scene.camera.clone(),
            normal: quad.normal,
            corner: quad.centre_m - quad.half_u + quad.half_v,
            right,
            down,
            size_m,
            tile_m: quad.tile_m,
        };
        let (w, h) = (f64::from(view.camera.width), f64::from(view.camera.height));
        let seen = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)]
            .into_iter()
            .all(|(x, y)| view.sight(x, y).is_some_and(|s| view.holds(s.point)));
        if seen { Ok(view) } else { Err(BeyondTarget) }
    }

    /// What the image point (`x`, `y`), pixels, sees; `None` where the ray leads away from the target's plane.
    #[inline]
    pub fn sight(&self, x: f64, y: f64) -> Option<Sight> {
        let direction = self.camera.direction(x, y);
        let range_m = self.range_m(self.camera.position_m, direction)?;
        Some(Sight {
            image: self.unit_coordinates(x, y),
            direction,
            range_m,
            point: self.camera.position_m + range_m * direction,
        })
    }

    /// Distance to the target's plane from `origin` along the unit vector `direction`, m.
    #[inline]
    pub fn range_m(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let towards = -self.normal.dot(direction);
        let range = self.normal.dot(origin - self.corner) / towards;
        (towards > 1e-9 && range >= 0.0).then_some(range)
    }

    /// Cosine of the angle at which `direction` meets the target.
    #[inline]
    pub fn incidence(&self, direction: DVec3) -> f64 {
        -self.normal.dot(direction)
    }

    /// Texture coordinates, tiles, of a point of the target's plane.
    #[inline]
    pub fn tiles(&self, point: DVec3) -> (f64, f64) {
        let offset = point - self.corner;
        (
            self.right.dot(offset) / self.tile_m.x,
            self.down.dot(offset) / self.tile_m.y,
        )
    }

    /// A point of the target's plane given by its offset from another one along the texture's axes, m.
    #[inline]
    pub fn offset(&self, from: DVec3, to: DVec3) -> (f64, f64) {
        let offset = to - from;
        (self.right.dot(offset), self.down.dot(offset))
    }

    /// Size of the whole image, pixels.
    pub fn size_px(&self) -> (f64, f64) {
        (f64::from(self.camera.width), f64::from(self.camera.height))
    }

    /// Image coordinates (p, q) in [-1, 1] of the image point (`x`, `y`), pixels.
    #[inline]
    pub fn unit_coordinates(&self, x: f64, y: f64) -> (f64, f64) {
        let (w, h) = self.size_px();
        (2.0 * x / w - 1.0, 2.0 * y / h - 1.0)
    }

    /// Whether a point of the plane lies on the target.
    fn holds(&self, point: DVec3) -> bool {
        let offset = point - self.corner;
        let (u, v) = (self.right.dot(offset), self.down.dot(offset));
        u >= 0.0 && v >= 0.0 && u <= self.size_m.x && v <= self.size_m.y
    }
}
