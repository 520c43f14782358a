//! The lens: between directions and points of the image, in focal lengths from the principal point.

use glam::{DMat2, DVec2, DVec3};

use crate::sampling::circle;

/// Newton steps of the inverse of the distortion; four or five suffice for real lenses.
const UNDISTORT_STEPS: usize = 40;
/// Error of the inverse of the distortion that ends the iteration, in focal lengths.
const UNDISTORT_ERROR: f64 = 1e-14;
/// Error of the inverse at which a lens counts as not invertible, in focal lengths.
const INVERTIBLE_ERROR: f64 = 1e-9;
/// Newton steps of the inverse of the fisheye; as many as the kernels make (`shaders/common/lens.wgsl`).
const FISHEYE_STEPS: usize = 12;
/// Parts of the way from the principal point to an image point at which the lens must not fold the picture.
const CHECKED_PARTS: u32 = 16;

/// Least of one and the cosine from the axis by which a fisheye's opening turns: it sees less than 180° off its axis.
const LEAST_TURN: f64 = 1e-6;

/// What a lens makes of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Straight lines stay straight but for a Brown-Conrady distortion k1, k2, p1, p2, k3, k4, k5, k6 (OpenCV's `projectPoints`, whose
    /// rational model has the last three; [`Lens::brown_conrady`]), all zero for none.
    Perspective([f64; 8]),
    /// Equidistant: the distance from the principal point is θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) focal lengths at an angle
    /// θ from the optical axis (OpenCV's `fisheye::projectPoints`; Kannala and Brandt 2006). θ is below π.
    Fisheye([f64; 4]),
}

/// The opening of a thin lens: what is not at the distance in focus becomes a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Diameter, m, > 0.
    pub diameter_m: f64,
    /// Distance along the optical axis that is in focus, with a fisheye in every direction, m, > 0; with a port as seen outside.
    pub focus_m: f64,
}

impl Opening {
    /// Radius, at a distance, of the cone of rays that meet in one point in focus, m.
    pub(crate) fn cone_m(&self, distance_m: f64) -> f64 {
        0.5 * self.diameter_m * (distance_m / self.focus_m - 1.0).abs()
    }

    /// At least the radius of the cone up to a distance, m.
    pub(crate) fn widest_m(&self, distance_m: f64) -> f64 {
        0.5 * self.diameter_m * (distance_m / self.focus_m + 1.0)
    }
}

/// Leading numbers of a sample that choose the point of the opening (twin: `shaders/common/lens.wgsl`).
pub(crate) const OPENING_NUMBERS: [usize; 2] = [8, 9];

/// A point of the opening, in its radii, even over its disc, from two numbers in (0, 1).
pub(crate) fn on_opening(u: f64, v: f64) -> DVec2 {
    let (cosine, sine) = circle(v);
    u.sqrt() * DVec2::new(cosine, sine)
}

impl Default for Lens {
    /// Without distortion.
    fn default() -> Self {
        Self::Perspective([0.0; 8])
    }
}

impl Lens {
    /// A perspective with the distortion k1, k2, p1, p2, k3.
    pub const fn brown_conrady([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self::Perspective([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0])
    }

    /// Whether it needs OpenCV's rational model: one of k4, k5 and k6 of a perspective is not 0.
    pub fn is_rational(&self) -> bool {
        matches!(self, Self::Perspective([.., k4, k5, k6]) if [*k4, *k5, *k6] != [0.0; 3])
    }

    /// The coefficients as OpenCV counts them: k1, k2, p1, p2, k3, and k4, k5, k6 where it is rational; k1 to k4 of a fisheye.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::Perspective(k) if !self.is_rational() => &k[..5],
            Self::Perspective(k) => k,
            Self::Fisheye(k) => k,
        }
    }

    /// Whether straight lines are straight in the image.
    pub fn is_ideal(&self) -> bool {
        *self == Self::default()
    }

    /// Focal length, pixels, at which an image `width` pixels wide spans `hfov_deg` degrees about its middle, without
    /// distortion but that of a fisheye; `None` where a fisheye folds before that.
    pub fn focal_length_px(&self, hfov_deg: f64, width: u32) -> Option<f64> {
        let half_rad = (hfov_deg / 2.0).to_radians();
        let half_px = f64::from(width) / 2.0;
        match self {
            Self::Perspective(_) => Some(half_px / half_rad.tan()),
            Self::Fisheye(k) => is_growing(k, half_rad).then(|| half_px / fisheye(k, half_rad).0),
        }
    }

    /// Horizontal field of view, degrees, of an image `width` pixels wide about its middle, as [`Lens::focal_length_px`] has
    /// it.
    pub fn hfov_deg(&self, focal_px: f64, width: u32) -> f64 {
        let half = 0.5 * f64::from(width) / focal_px;
        let half_rad = match self {
            Self::Perspective(_) => half.atan(),
            Self::Fisheye(k) => fisheye_angle(k, half),
        };
        2.0 * half_rad.to_degrees()
    }

    /// Direction (right, down, forward) that is seen at a point of the image; not of unit length.
    pub(super) fn towards(&self, seen: DVec2) -> DVec3 {
        match self {
            Self::Perspective(_) if self.is_ideal() => seen.extend(1.0),
            Self::Perspective(k) => undistort(k, seen).extend(1.0),
            Self::Fisheye(k) => {
                let radius = seen.length();
                let (sine, cosine) = fisheye_angle(k, radius).sin_cos();
                let across = match radius > 0.0 {
                    true => sine / radius * seen,
                    false => DVec2::ZERO,
                };
                across.extend(cosine)
            }
        }
    }

    /// From a point of an opening, in its radii, where the chief ray runs along `towards` (of [`Lens::towards`]): that point and the way to
    /// what is in focus `focus_m` ahead. The opening of a fisheye stands across the ray, as its pupil turns towards what it sees
    /// (twin: `shaders/common/lens.wgsl`).
    pub(super) fn through_opening(
        &self,
        towards: DVec3,
        on_opening: DVec2,
        (radius_m, focus_m): (f64, f64),
    ) -> (DVec3, DVec3) {
        let (point, focused) = match self {
            Self::Perspective(_) => (on_opening.extend(0.0), towards),
            Self::Fisheye(_) => {
                let towards = towards.normalize();
                let turn = on_opening.dot(towards.truncate()) / (1.0 + towards.z).max(LEAST_TURN);
                let across = on_opening - turn * towards.truncate();
                let along = -on_opening.dot(towards.truncate());
                (across.extend(along), towards)
            }
        };
        let point = radius_m * point;
        (point, focus_m * focused - point)
    }

    /// Where a direction (right, down, forward), of any length, is seen; `None` where the lens does not see it.
    pub(super) fn seen(&self, towards: DVec3) -> Option<DVec2> {
        match self {
            Self::Perspective(k) => {
                let ideal = towards.truncate() / towards.z;
                (towards.z > 0.0).then(|| distort(k, ideal).0)
            }
            Self::Fisheye(k) => {
                let across = towards.truncate().length();
                let angle = across.atan2(towards.z);
                let radius = fisheye(k, angle).0;
                if !is_growing(k, angle) || (across == 0.0 && towards.z <= 0.0) {
                    return None;
                }
                Some(match across > 0.0 {
                    true => radius / across * towards.truncate(),
                    false => DVec2::ZERO,
                })
            }
        }
    }

    /// The point of [`Lens::seen`] for a direction less than 90° off the axis, and how many times the area on a plane at unit
    /// distance it has in the image; `None` where the lens folds.
    pub(super) fn seen_with_stretch(&self, towards: DVec3) -> Option<(DVec2, f64)> {
        if towards.z <= 0.0 {
            return None;
        }
        let ideal = towards.truncate() / towards.z;
        let (seen, stretch) = match self {
            Self::Perspective(k) => {
                let (seen, jacobian) = distort(k, ideal);
                (seen, jacobian.determinant())
            }
            Self::Fisheye(k) => {
                let tangent = ideal.length();
                let (radius, slope) = fisheye(k, tangent.atan());
                let along = slope / (1.0 + tangent * tangent);
                let around = match tangent > 0.0 {
                    true => radius / tangent,
                    false => 1.0,
                };
                (ideal * around, along * around)
            }
        };
        (stretch > 0.0).then_some((seen, stretch))
    }

    /// Whether the inverse is found at a point of the image, on the branch that holds the principal point.
    pub(super) fn is_invertible_at(&self, seen: DVec2) -> bool {
        let parts = (0..=CHECKED_PARTS).map(|k| f64::from(k) / f64::from(CHECKED_PARTS));
        match self {
            Self::Perspective(k) => {
                let ideal = undistort(k, seen);
                let found = (distort(k, ideal).0 - seen).length()
                    <= INVERTIBLE_ERROR * (1.0 + seen.length());
                let mut parts = parts;
                let is_on_branch = |part: f64| {
                    let at = part * ideal;
                    radial(k, at.length_squared()).denominator > 0.0
                        && distort(k, at).1.determinant() > 0.0
                };
                found && parts.all(is_on_branch)
            }
            Self::Fisheye(k) => {
                let angle = fisheye_angle(k, seen.length());
                let error = (fisheye(k, angle).0 - seen.length()).abs();
                error <= INVERTIBLE_ERROR * (1.0 + seen.length()) && is_growing(k, angle)
            }
        }
    }
}

/// How many times as far from the principal point a distortion sees what is at a distance, as a fraction.
struct Radial {
    /// The fraction, and its derivative by the square of the distance.
    factor: f64,
    slope: f64,
    /// Above 0 up to the first pole.
    denominator: f64,
}

fn radial([k1, k2, _, _, k3, k4, k5, k6]: &[f64; 8], r2: f64) -> Radial {
    let polynomial = |[a, b, c]: [&f64; 3]| {
        let value = 1.0 + r2 * (a + r2 * (b + r2 * c));
        (value, a + r2 * (2.0 * b + r2 * 3.0 * c))
    };
    let (numerator, up) = polynomial([k1, k2, k3]);
    let (denominator, down) = polynomial([k4, k5, k6]);
    let factor = numerator / denominator;
    Radial {
        factor,
        slope: (up - factor * down) / denominator,
        denominator,
    }
}

/// Brown-Conrady distortion of a point in the image plane at unit distance, and its Jacobian.
fn distort(k: &[f64; 8], ideal: DVec2) -> (DVec2, DMat2) {
    let DVec2 { x, y } = ideal;
    let [_, _, p1, p2, ..] = k;
    let r2 = x * x + y * y;
    let Radial { factor, slope, .. } = radial(k, r2);
    // Times x it is the derivative by x.
    let slope = 2.0 * slope;
    let tangential = DVec2::new(
        2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let by_x = DVec2::new(
        factor + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y,
    );
    let by_y = DVec2::new(by_x.y, factor + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x);
    (ideal * factor + tangential, DMat2::from_cols(by_x, by_y))
}

/// Inverse of [`distort`] by Newton's method from the distorted point itself.
fn undistort(k: &[f64; 8], seen: DVec2) -> DVec2 {
    let mut ideal = seen;
    for _ in 0..UNDISTORT_STEPS {
        let (distorted, jacobian) = distort(k, ideal);
        let error = distorted - seen;
        if error.length() <= UNDISTORT_ERROR * (1.0 + seen.length()) {
            break;
        }
        ideal -= jacobian.inverse() * error;
    }
    ideal
}

/// Distance from the principal point at an angle from the axis, in focal lengths, and its derivative.
fn fisheye([k1, k2, k3, k4]: &[f64; 4], angle: f64) -> (f64, f64) {
    let t2 = angle * angle;
    let radius = angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
    let slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)));
    (radius, slope)
}

/// Inverse of [`fisheye`] by Newton's method from the distance itself, as the kernels have it.
fn fisheye_angle(k: &[f64; 4], radius: f64) -> f64 {
    let mut angle = radius.min(std::f64::consts::PI);
    for _ in 0..FISHEYE_STEPS {
        let (found, slope) = fisheye(k, angle);
        if (found - radius).abs() <= UNDISTORT_ERROR * (1.0 + radius) || slope <= 0.0 {
            break;
        }
        angle = (angle - (found - radius) / slope).clamp(0.0, std::f64::consts::PI);
    }
    angle
}

/// Whether an angle is below π, and the distance from the principal point grows all the way up to it.
fn is_growing(k: &[f64; 4], angle: f64) -> bool {
    let parts = 4 * CHECKED_PARTS;
    angle < std::f64::consts::PI
        && (0..=parts).all(|i| fisheye(k, angle * f64::from(i) / f64::from(parts)).1 > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distortion_moves_points_as_the_model_says() {
        // k1 = -0.2 at r = 0.5: the point moves to 0.5 (1 - 0.2 · 0.25) = 0.475.
        let lens = Lens::brown_conrady([-0.2, 0.0, 0.0, 0.0, 0.0]);
        let seen = lens.seen(DVec3::new(0.5, 0.0, 1.0)).expect("in front");
        assert!((seen - DVec2::new(0.475, 0.0)).length() < 1e-12);
    }

    #[test]
    fn tangential_distortion_follows_opencv() {
        // p1 = 0.01, p2 = 0.02 at (0.3, -0.2), r² = 0.13:
        // x + 2 p1 x y + p2 (r² + 2 x²) = 0.3 - 0.0012 + 0.0062, y + p1 (r² + 2 y²) + 2 p2 x y = -0.2 + 0.0021 - 0.0024.
        let k = [0.0, 0.0, 0.01, 0.02, 0.0, 0.0, 0.0, 0.0];
        let point = DVec2::new(0.3, -0.2);
        let distorted = distort(&k, point).0;
        assert!((distorted - DVec2::new(0.305, -0.2003)).length() < 1e-15);
        let step = 1e-6;
        for k in [k, RATIONAL] {
            let (distorted, jacobian) = distort(&k, point);
            for (axis, column) in [(DVec2::X, jacobian.x_axis), (DVec2::Y, jacobian.y_axis)] {
                let ahead = distort(&k, point + axis * step).0;
                assert!(((ahead - distorted) / step - column).length() < 1e-6);
            }
        }
    }

    /// Of a wide lens.
    const RATIONAL: [f64; 8] = [0.62, 0.11, 0.0004, -0.0003, 0.006, 0.93, 0.21, 0.021];

    #[test]
    fn a_rational_lens_is_known_up_to_its_pole() {
        let lens = Lens::Perspective(RATIONAL);
        for towards in [DVec3::new(0.3, -0.2, 1.0), DVec3::new(-0.9, 0.7, 1.0)] {
            let seen = lens.seen(towards).expect("in front");
            assert!(lens.is_invertible_at(seen), "{seen}");
            assert!((lens.towards(seen) - towards).length() < 1e-12);
        }
        // (1 - r²) / (1 - 1.001 r²) is about 1 on both sides of its pole, which no step along the way meets.
        let pole = Lens::Perspective([-1.0, 0.0, 0.0, 0.0, 0.0, -1.001, 0.0, 0.0]);
        assert!(pole.is_invertible_at(DVec2::new(0.9, 0.0)));
        assert!(!pole.is_invertible_at(DVec2::new(1.5, 0.0)));
    }

    #[test]
    fn a_fisheye_sees_all_around_and_back() {
        for k in [[0.0; 4], [0.05, -0.01, 0.002, -0.0001]] {
            let lens = Lens::Fisheye(k);
            for angle in [0.0, 1e-9, 0.3, 1.2, 1.7, 2.6] {
                let (sine, cosine) = f64::sin_cos(angle);
                let towards = DVec3::new(0.6 * sine, -0.8 * sine, cosine);
                let seen = lens.seen(7.0 * towards).expect("seen");
                assert!((seen.length() - fisheye(&k, angle).0).abs() < 1e-14);
                assert!((lens.towards(seen) - towards).length() < 1e-13, "{angle}");
                assert!(lens.is_invertible_at(seen));
            }
            assert_eq!(lens.seen(DVec3::NEG_Z), None);
        }
        // 1 - 3 · 0.2 θ² = 0 at θ = 1.29: beyond, the picture folds.
        let folding = Lens::Fisheye([-0.2, 0.0, 0.0, 0.0]);
        assert!(
            folding
                .seen(DVec3::new(1.28_f64.sin(), 0.0, 1.28_f64.cos()))
                .is_some()
        );
        assert_eq!(
            folding.seen(DVec3::new(1.4_f64.sin(), 0.0, 1.4_f64.cos())),
            None
        );
        assert!(!folding.is_invertible_at(DVec2::new(1.0, 0.0)));
    }

    #[test]
    fn areas_are_those_of_small_squares() {
        let lenses = [
            Lens::brown_conrady([-0.2, 0.05, 0.001, -0.002, 0.0]),
            Lens::Perspective(RATIONAL),
            Lens::Fisheye([0.05, -0.01, 0.002, -0.0001]),
        ];
        let step = 1e-6;
        for lens in lenses {
            for (x, y) in [(0.0, 0.0), (0.4, -0.3), (-0.1, 0.7)] {
                let at = |dx: f64, dy: f64| {
                    lens.seen(DVec3::new(x + dx, y + dy, 1.0))
                        .expect("in front")
                };
                let along = (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step);
                let across = (at(0.0, step) - at(0.0, -step)) / (2.0 * step);
                let (seen, stretch) = lens
                    .seen_with_stretch(DVec3::new(x, y, 1.0))
                    .expect("in front");
                assert!((seen - at(0.0, 0.0)).length() < 1e-15);
                assert!((stretch - along.perp_dot(across)).abs() < 1e-8, "{lens:?}");
            }
        }
    }

    #[test]
    fn fields_of_view_and_focal_lengths_belong_together() {
        let fisheye = Lens::Fisheye([0.05, -0.01, 0.002, -0.0001]);
        for (lens, hfov_deg) in [(Lens::default(), 75.0), (fisheye, 75.0), (fisheye, 200.0)] {
            let focal_px = lens.focal_length_px(hfov_deg, 640).expect("does not fold");
            assert!((lens.hfov_deg(focal_px, 640) - hfov_deg).abs() < 1e-10);
        }
        let equidistant = Lens::Fisheye([0.0; 4]);
        let focal_px = equidistant
            .focal_length_px(180.0, 640)
            .expect("does not fold");
        assert!((focal_px - 640.0 / std::f64::consts::PI).abs() < 1e-12);
        let folding = Lens::Fisheye([-0.2, 0.0, 0.0, 0.0]);
        assert_eq!(folding.focal_length_px(160.0, 640), None);
    }
}
