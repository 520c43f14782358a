//! The prepared geometry as kernels in double precision see it: from the camera, by their own indices.

use glam::DVec3;
use uw_lanes::scalar::{Point, Surfaces};

use crate::{
    kernels::layout::NONE,
    prepare::{Geometry, Hit, Prepared, Primitive},
};

/// Marks the index of a triangle; as in `shaders/common/bvh.wgsl`.
const TRIANGLE: u32 = 1 << 31;

/// Geometry in coordinates relative to the camera.
pub(super) struct FromCamera<'a> {
    geometry: &'a Geometry,
    camera: DVec3,
}

impl<'a> FromCamera<'a> {
    /// Of `scene`.
    pub(super) fn new(scene: &'a Prepared) -> Self {
        Self {
            geometry: &scene.geometry,
            camera: scene.camera.position_m,
        }
    }
}

fn primitive(index: u32) -> Primitive {
    match index {
        NONE => Primitive::None,
        _ if index & TRIANGLE != 0 => Primitive::Triangle(index & !TRIANGLE),
        _ => Primitive::Quad(index),
    }
}

fn index(primitive: Primitive) -> u32 {
    match primitive {
        Primitive::None => NONE,
        Primitive::Quad(i) => i,
        Primitive::Triangle(i) => TRIANGLE | i,
    }
}

impl Surfaces for FromCamera<'_> {
    fn nearest(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        t_max: f64,
        start: u32,
        any: bool,
    ) -> Option<(f64, u32, [f64; 2])> {
        let (origin, direction) = (self.camera + DVec3::from(origin), direction.into());
        let start = primitive(start);
        if any {
            let blocked = self.geometry.occluded(origin, direction, t_max, start);
            // Which surface it is makes no difference.
            return blocked.then_some((0.0, 0, [0.0; 2]));
        }
        let hit = self.geometry.closest(origin, direction, t_max, start)?;
        Some((hit.t, index(hit.primitive), hit.local))
    }

    fn point(&self, met: u32, local: [f64; 2], direction: [f64; 3]) -> Point {
        let hit = Hit {
            t: 0.0,
            primitive: primitive(met),
            local,
        };
        let point = self.geometry.surface_point(&hit, direction.into());
        let (roughness, metallic) = point.gloss.unwrap_or_default();
        Point {
            normal: point.normal.to_array(),
            shading_normal: point.shading_normal.to_array(),
            reflectance: point.reflectance,
            emission: point.emission,
            material: point.material as u32,
            roughness,
            metallic,
        }
    }
}
