//! glTF punctual lights as lamps, and glTF cameras.

use glam::{DAffine3, DVec3};

use super::camera::MAX_SIDE_PX;
use super::gltf_resource::{GltfError, GltfSource, item};
use super::{Camera, Falloff, Lamp};

/// Smallest vertical field of view, radians.
const LEAST_FIELD: f64 = 1e-6;
/// Rows of the table for the soft edge of a spot light.
const SOFT_EDGE_ROWS: u32 = 64;
/// Smallest difference of the cosines of a spot light's inner and outer angle (the extension's recommendation).
const SOFT_EDGE_COSINES: f64 = 1e-3;
/// Image width, pixels, of a glTF camera when the scene file states no size.
const DEFAULT_WIDTH: u32 = 1280;
/// Aspect ratio of a glTF camera that has none of its own.
const DEFAULT_ASPECT: f64 = 16.0 / 9.0;

/// Reads a point or spot light, by its index; `None` for any other. Candela count as W/sr.
pub(super) fn read_light(
    source: &GltfSource,
    index: usize,
    world_from_node: &DAffine3,
) -> Result<Option<Lamp>, GltfError> {
    let light = &source.document.extensions.punctual.lights[index];
    let place = item("light", index, light.name.as_deref());
    let (half_angle_deg, falloff) = match light.shape.as_str() {
        "point" => (180.0, Falloff::Uniform),
        "spot" => {
            let Some(spot) = &light.spot else {
                return Err(source.resource(&place, "lacks the required field `spot`"));
            };
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(0.0 <= inner && inner <= outer && 0.0 < outer && outer <= std::f64::consts::PI) {
                let expected = "0 <= inner <= outer <= pi radians, outer > 0";
                return Err(source.value(
                    format!("{place} cone angles [inner, outer]"),
                    expected,
                    [inner, outer],
                ));
            }
            (outer.to_degrees(), spot_falloff(inner, outer))
        }
        _ => return Ok(None),
    };
    let intensity = light.color.map(|channel| channel * light.intensity);
    if !intensity
        .iter()
        .all(|channel| (0.0..=1e12).contains(channel))
    {
        return Err(source.value(
            format!("{place} colour times intensity"),
            ">= 0 and finite",
            intensity,
        ));
    }
    let (position_m, forward, _) = pose(source, world_from_node, &place)?;
    let name = lamp_name(light.name.as_deref(), index);
    Ok(Some(Lamp {
        name,
        position_m,
        forward,
        intensity,
        spectrum: None,
        level_pct: 100.0,
        half_angle_deg,
        falloff,
        radius_m: 0.0,
    }))
}

/// The falloff that KHR_lights_punctual recommends: the square of a ramp in the cosine from outer to inner angle.
fn spot_falloff(inner: f64, outer: f64) -> Falloff {
    let width = inner.cos() - outer.cos();
    if width < SOFT_EDGE_COSINES {
        return Falloff::Uniform;
    }
    let relative = |angle: f64| {
        ((angle.cos() - outer.cos()) / width)
            .clamp(0.0, 1.0)
            .powi(2)
    };
    let edge = (0..=SOFT_EDGE_ROWS)
        .map(|i| inner + (outer - inner) * f64::from(i) / f64::from(SOFT_EDGE_ROWS));
    let axis = (inner > 0.0).then_some((0.0, 1.0));
    Falloff::Profile(
        axis.into_iter()
            .chain(edge.map(|angle| (angle.to_degrees(), relative(angle))))
            .collect(),
    )
}

/// A lamp name out of a light's name: letters, digits, `_` and `-` stay.
fn lamp_name(name: Option<&str>, index: usize) -> String {
    let allowed = |c: char| {
        if c.is_ascii_alphanumeric() || c == '-' {
            c
        } else {
            '_'
        }
    };
    let name: String = name
        .unwrap_or_default()
        .chars()
        .take(48)
        .map(allowed)
        .collect();
    if name.is_empty() {
        format!("light{index}")
    } else {
        name
    }
}

/// Position, unit direction of view (the node's -z) and unit up direction (its +y).
fn pose(
    source: &GltfSource,
    world: &DAffine3,
    place: &str,
) -> Result<(DVec3, DVec3, DVec3), GltfError> {
    let axes = world.matrix3;
    match (
        axes.mul_vec3(-DVec3::Z).try_normalize(),
        axes.mul_vec3(DVec3::Y).try_normalize(),
    ) {
        (Some(forward), Some(up)) => Ok((world.translation, forward, up)),
        _ => Err(source.value(
            format!("{place} scale of its node"),
            "not zero",
            axes.to_cols_array(),
        )),
    }
}

/// A perspective camera of a glTF file, in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct GltfCamera {
    position_m: DVec3,
    forward: DVec3,
    up: DVec3,
    vertical_field: f64,
    aspect: f64,
}

/// Reads a perspective camera; `None` for others and for views of half a turn and more, which no picture can show.
pub(super) fn read_camera(
    source: &GltfSource,
    index: usize,
    world_from_node: &DAffine3,
) -> Result<Option<GltfCamera>, GltfError> {
    let camera = &source.document.cameras[index];
    let place = item("camera", index, camera.name.as_deref());
    if camera.projection != "perspective" {
        return Ok(None);
    }
    let Some(perspective) = &camera.perspective else {
        return Err(source.resource(&place, "lacks the required field `perspective`"));
    };
    let vertical_field = perspective.yfov;
    if vertical_field >= std::f64::consts::PI {
        return Ok(None);
    }
    if vertical_field < LEAST_FIELD {
        return Err(source.value(
            format!("{place} yfov"),
            "in [1e-6, pi) radians",
            vertical_field,
        ));
    }
    let aspect = perspective.aspect_ratio.unwrap_or(DEFAULT_ASPECT);
    if !(aspect > 0.0 && aspect.is_finite()) {
        return Err(source.value(format!("{place} aspectRatio"), "> 0", aspect));
    }
    let (position_m, forward, up) = pose(source, world_from_node, &place)?;
    if forward.cross(up).length() < 1e-9 {
        return Err(source.value(
            format!("{place} up direction"),
            "not parallel to its view",
            up.to_array(),
        ));
    }
    Ok(Some(GltfCamera {
        position_m,
        forward,
        up,
        vertical_field,
        aspect,
    }))
}

impl GltfCamera {
    /// With an image of the given size: the vertical field of view is kept, pixels are square.
    pub(super) fn with_size(&self, width: u32, height: u32) -> Camera {
        let mut camera = Camera::looking(self.position_m, self.forward, self.up, width, height);
        camera.focal_px =
            glam::DVec2::splat(f64::from(height) / 2.0 / (self.vertical_field / 2.0).tan());
        camera
    }

    /// With an image 1280 pixels wide in the camera's own aspect ratio.
    pub(super) fn with_own_size(&self) -> Camera {
        let height = (f64::from(DEFAULT_WIDTH) / self.aspect)
            .round()
            .clamp(1.0, f64::from(MAX_SIDE_PX));
        self.with_size(DEFAULT_WIDTH, height as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spot_falloff_is_flat_inside_and_ends_at_the_outer_angle() {
        let (inner, outer) = (0.2_f64, 0.6_f64);
        let falloff = spot_falloff(inner, outer);
        for angle in [0.0_f64, 0.1, 0.2, 0.3, 0.45, 0.59, 0.6, 0.7] {
            let ramp = ((angle.cos() - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
            let got = falloff.relative(angle.to_degrees());
            // 64 straight pieces of h = 0.4 / 64 under a second derivative of 26: h²/8 · 26 = 1.3e-4.
            assert!((got - ramp * ramp).abs() < 1.4e-4, "{angle}: {got}");
        }
        assert_eq!(spot_falloff(0.5, 0.5), Falloff::Uniform);
    }

    #[test]
    fn names_become_layer_names() {
        assert_eq!(lamp_name(Some("Spot.001 left"), 0), "Spot_001_left");
        assert_eq!(lamp_name(None, 4), "light4");
    }
}
