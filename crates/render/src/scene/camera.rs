//! The camera: its table in the scene file, and the map between pixels and directions.

use glam::{DMat2, DVec2, DVec3};

use super::range::Range;
use super::reader::Table;
use super::snow::BLUR_FIELDS;
use super::{Camera, SceneError};

/// Largest image side, pixels.
pub(super) const MAX_SIDE_PX: u32 = 16_384;
/// Smallest field of view, degrees.
const LEAST_FIELD_DEG: f64 = 1e-6;
/// Smallest focal length, pixels.
const LEAST_FOCAL_PX: f64 = 1e-3;
/// Most pixels of an image; about 1.5 GiB for one RGB picture and its variance in float32 and float64.
const MAX_PIXELS: u64 = 1 << 26;
/// Sine of the smallest angle between forward and up.
const PARALLEL_SINE: f64 = 1e-9;
/// Newton steps of the inverse of the distortion; four or five suffice for real lenses.
const UNDISTORT_STEPS: usize = 40;
/// Error of the inverse of the distortion that ends the iteration, in units of the focal length.
const UNDISTORT_ERROR: f64 = 1e-14;
/// Error of the inverse of the distortion at which a lens counts as not invertible.
const INVERTIBLE_ERROR: f64 = 1e-9;
/// Points per image side at which the distortion is checked when a scene is read.
const CHECKED_POINTS: u32 = 16;

pub(super) const FIELDS: [&str; 16] = [
    "position_m",
    "forward",
    "up",
    "hfov_deg",
    "fx",
    "fy",
    "cx",
    "cy",
    "distortion",
    "width",
    "height",
    "response",
    BLUR_FIELDS[0],
    BLUR_FIELDS[1],
    BLUR_FIELDS[2],
    BLUR_FIELDS[3],
];

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

/// What the `[camera]` table says.
pub(super) enum CameraTable {
    /// A whole camera.
    Complete(Camera),
    /// Only the size of the image: the view comes from a glTF file.
    SizeOnly {
        /// Image width, pixels.
        width: u32,
        /// Image height, pixels.
        height: u32,
    },
}

/// Reads the `[camera]` table, `None` when the file has none.
pub(super) fn read(root: &Table<'_>) -> Result<Option<CameraTable>, SceneError> {
    let Some(table) = root.table("camera", &FIELDS)? else {
        return Ok(None);
    };
    let (width, height) = read_size(&table)?;
    if FIELDS[..9]
        .iter()
        .all(|field| table.optional(field).is_none())
    {
        return Ok(Some(CameraTable::SizeOnly { width, height }));
    }
    let forward = table.direction("forward")?;
    let up = table
        .optional("up")
        .map_or(Ok(DVec3::Z), |up| up.as_direction())?;
    if forward.cross(up).length() < PARALLEL_SINE {
        let (field, expected) = match table.optional("up") {
            Some(up) => (up, "a direction not parallel to camera.forward"),
            None => (
                table.required("forward", "")?,
                "a direction that is not vertical, where camera.up is left out",
            ),
        };
        return Err(field.invalid(expected));
    }
    let (focal_px, centre_px) = read_intrinsics(&table, width, height)?;
    let no_distortion = Ok([0.0; 5]);
    let coefficients = table.optional("distortion");
    let distortion = coefficients
        .as_ref()
        .map_or(no_distortion, |k| k.as_numbers(Range::finite("")))?;
    let position_m = table.vector("position_m")?;
    let camera = Camera {
        focal_px,
        centre_px,
        distortion,
        ..Camera::looking(position_m, forward, up, width, height)
    };
    match coefficients {
        Some(value) if !camera.is_invertible() => {
            Err(value
                .invalid("k1, k2, p1, p2, k3 of a distortion that is one-to-one over the image"))
        }
        _ => Ok(Some(CameraTable::Complete(camera))),
    }
}

fn read_size(table: &Table<'_>) -> Result<(u32, u32), SceneError> {
    let side = |field| {
        table
            .required(field, "pixels")?
            .as_whole(1, MAX_SIDE_PX, "pixels")
    };
    let (width, height) = (side("width")?, side("height")?);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        let expected = format!(
            "at most {} for this height ({MAX_PIXELS} pixels in all)",
            MAX_PIXELS / u64::from(height)
        );
        return Err(table.required("width", "pixels")?.invalid(expected));
    }
    Ok((width, height))
}

fn read_intrinsics(
    table: &Table<'_>,
    width: u32,
    height: u32,
) -> Result<(DVec2, DVec2), SceneError> {
    let centre = DVec2::new(f64::from(width), f64::from(height)) / 2.0;
    if let Some(hfov) = table.optional("hfov_deg") {
        for field in ["fx", "fy", "cx", "cy"] {
            table.refuse(field, "where camera.hfov_deg is given")?;
        }
        let hfov_deg = hfov.as_number(Range::below(LEAST_FIELD_DEG, 180.0, "degrees"))?;
        return Ok((DVec2::splat(focal_length_px(hfov_deg, width)), centre));
    }
    if table.optional("fx").is_none() {
        return Err(table.missing("hfov_deg", "or fx, with fy, cx, cy, in pixels"));
    }
    let positive = Range::at_least(LEAST_FOCAL_PX, "pixels");
    let fx = table.number("fx", positive)?;
    let fy = table.number_or("fy", positive, fx)?;
    let cx = table.number_or("cx", Range::finite("pixels"), centre.x)?;
    let cy = table.number_or("cy", Range::finite("pixels"), centre.y)?;
    Ok((DVec2::new(fx, fy), DVec2::new(cx, cy)))
}

/// Focal length, pixels, of a horizontal field of view.
fn focal_length_px(hfov_deg: f64, width: u32) -> f64 {
    f64::from(width) / 2.0 / (hfov_deg / 2.0).to_radians().tan()
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
            distortion: [0.0; 5],
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
        let is_side = |side| (1..=MAX_SIDE_PX).contains(&side);
        let in_all = u64::from(width) * u64::from(height);
        if !is_side(width) || !is_side(height) || in_all > MAX_PIXELS {
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

    /// Unit direction, in the world, of the ray through the image point (`px`, `py`), pixels from the top left corner.
    pub fn direction(&self, px: f64, py: f64) -> DVec3 {
        let seen = (DVec2::new(px, py) - self.centre_px) / self.focal_px;
        let ideal = if self.distortion == [0.0; 5] {
            seen
        } else {
            self.undistort(seen)
        };
        (self.forward + self.right * ideal.x + self.down * ideal.y).normalize()
    }

    /// Image point, pixels from the top left corner, of a point in the world, m; it may lie outside the image.
    /// `None` for points that are not in front of the camera.
    pub fn project(&self, point_m: DVec3) -> Option<DVec2> {
        let offset = point_m - self.position_m;
        let distance_m = offset.dot(self.forward);
        let ideal = DVec2::new(offset.dot(self.right), offset.dot(self.down)) / distance_m;
        (distance_m > 0.0).then(|| self.centre_px + self.distort(ideal).0 * self.focal_px)
    }

    /// The image point of [`Camera::project`], and the area that a pixel there covers on a plane perpendicular to the
    /// optical axis at a distance of 1 m along it, m².
    pub fn project_with_area(&self, point_m: DVec3) -> Option<(DVec2, f64)> {
        let offset = point_m - self.position_m;
        let distance_m = offset.dot(self.forward);
        let ideal = DVec2::new(offset.dot(self.right), offset.dot(self.down)) / distance_m;
        let (seen, jacobian) = self.distort(ideal);
        let stretch = jacobian.determinant() * self.focal_px.x * self.focal_px.y;
        let in_front = distance_m > 0.0 && stretch > 0.0;
        in_front.then(|| (self.centre_px + seen * self.focal_px, 1.0 / stretch))
    }

    /// Brown-Conrady distortion (OpenCV's model) of a point in the image plane at unit distance,
    /// and its Jacobian.
    fn distort(&self, ideal: DVec2) -> (DVec2, DMat2) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let DVec2 { x, y } = ideal;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        // Derivative of `radial` by r2, twice: times x it is the derivative by x.
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let tangential = DVec2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let by_x = DVec2::new(
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y,
        );
        let by_y = DVec2::new(by_x.y, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x);
        (ideal * radial + tangential, DMat2::from_cols(by_x, by_y))
    }

    /// Inverse of [`Camera::distort`] by Newton's method from the distorted point itself.
    fn undistort(&self, seen: DVec2) -> DVec2 {
        let mut ideal = seen;
        for _ in 0..UNDISTORT_STEPS {
            let (distorted, jacobian) = self.distort(ideal);
            let error = distorted - seen;
            if error.length() <= UNDISTORT_ERROR * (1.0 + seen.length()) {
                break;
            }
            ideal -= jacobian.inverse() * error;
        }
        ideal
    }

    /// Whether the inverse of the distortion is found all over the image, on the branch that holds its centre.
    pub(super) fn is_invertible(&self) -> bool {
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        (0..=CHECKED_POINTS).all(|j| {
            (0..=CHECKED_POINTS).all(|i| {
                let corner = DVec2::new(f64::from(i), f64::from(j)) / f64::from(CHECKED_POINTS);
                let seen = (corner * size - self.centre_px) / self.focal_px;
                let ideal = self.undistort(seen);
                let found = (self.distort(ideal).0 - seen).length()
                    <= INVERTIBLE_ERROR * (1.0 + seen.length());
                let growing = |k| {
                    self.distort(ideal * f64::from(k) / f64::from(CHECKED_POINTS))
                        .1
                        .determinant()
                        > 0.0
                };
                found && (0..=CHECKED_POINTS).all(growing)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(distortion: [f64; 5]) -> Camera {
        let forward = DVec3::new(1.0, 0.2, -0.1).normalize();
        Camera {
            focal_px: DVec2::new(280.0, 275.0),
            centre_px: DVec2::new(161.3, 88.8),
            distortion,
            ..Camera::looking(DVec3::new(0.4, -2.0, 1.0), forward, DVec3::Z, 320, 180)
        }
    }

    #[test]
    fn direction_agrees_with_the_reference_scenes() {
        // The reference pictures say: the ray through (px, py) is (1, -(px - 160) / f, -(py - 90) / f), f = 277.13.
        let mut camera = Camera::looking(DVec3::ZERO, DVec3::X, DVec3::Z, 320, 180);
        camera.focal_px = DVec2::splat(focal_length_px(60.0, 320));
        assert!((camera.focal_px.x - 277.13).abs() < 0.005);
        let f = camera.focal_px.x;
        for (px, py) in [(0.0, 0.0), (320.0, 0.0), (17.5, 170.5), (160.0, 90.0)] {
            let expected = DVec3::new(1.0, -(px - 160.0) / f, -(py - 90.0) / f).normalize();
            assert!((camera.direction(px, py) - expected).length() < 1e-15);
        }
    }

    #[test]
    fn projecting_a_direction_returns_to_its_pixel() {
        for distortion in [
            [0.0; 5],
            [-0.28, 0.11, 0.001, -0.0007, -0.02],
            [0.2, 0.05, -0.002, 0.003, 0.01],
        ] {
            let camera = camera(distortion);
            assert!(camera.is_invertible());
            for i in 0..=32 {
                for j in 0..=18 {
                    let pixel = DVec2::new(f64::from(i), f64::from(j)) * 10.0;
                    let direction = camera.direction(pixel.x, pixel.y);
                    assert!((direction.length() - 1.0).abs() < 1e-14);
                    let back = camera
                        .project(camera.position_m + direction * 3.0)
                        .expect("in front");
                    assert!(
                        (back - pixel).length() < 1e-9,
                        "{pixel} came back as {back}"
                    );
                }
            }
        }
    }

    #[test]
    fn distortion_moves_points_as_the_model_says() {
        // k1 = -0.2 at r = 0.5: the point moves to 0.5 (1 - 0.2 · 0.25) = 0.475 focal lengths from the centre.
        let camera = camera([-0.2, 0.0, 0.0, 0.0, 0.0]);
        let point = camera.position_m + camera.forward + camera.right * 0.5;
        let pixel = camera.project(point).expect("in front");
        assert!((pixel.x - (161.3 + 280.0 * 0.475)).abs() < 1e-9 && (pixel.y - 88.8).abs() < 1e-9);
    }

    #[test]
    fn tangential_distortion_follows_opencv() {
        // p1 = 0.01, p2 = 0.02 at (0.3, -0.2), r² = 0.13:
        // x + 2 p1 x y + p2 (r² + 2 x²) = 0.3 - 0.0012 + 0.0062, y + p1 (r² + 2 y²) + 2 p2 x y = -0.2 + 0.0021 - 0.0024.
        let camera = camera([0.0, 0.0, 0.01, 0.02, 0.0]);
        let (distorted, jacobian) = camera.distort(DVec2::new(0.3, -0.2));
        assert!((distorted - DVec2::new(0.305, -0.2003)).length() < 1e-15);
        let step = 1e-6;
        for (axis, column) in [(DVec2::X, jacobian.x_axis), (DVec2::Y, jacobian.y_axis)] {
            let ahead = camera.distort(DVec2::new(0.3, -0.2) + axis * step).0;
            assert!(((ahead - distorted) / step - column).length() < 1e-6);
        }
    }

    #[test]
    fn points_behind_are_not_seen_and_folding_lenses_are_recognised() {
        let camera = camera([-0.2, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(camera.project(camera.position_m - camera.forward), None);
        let folding = Camera {
            distortion: [-3.0, 0.0, 0.0, 0.0, 0.0],
            ..camera
        };
        assert!(!folding.is_invertible());
    }
}
