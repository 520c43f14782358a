//! Surfaces of a scene as a plain list of flat patches.

use glam::{DVec2, DVec3};
use uw_render::scene::Scene;

/// A triangle or a parallelogram.
pub(super) struct Patch {
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    triangle: bool,
    /// Unit normal of one side.
    pub(super) normal: DVec3,
    /// Texture coordinates of the corner and their change along the edges.
    texture: [DVec2; 3],
    /// Index of the material.
    pub(super) material: usize,
}

/// Where a ray meets a patch.
pub(super) struct Hit {
    /// Index of the patch.
    pub(super) patch: usize,
    /// Distance, m.
    pub(super) distance: f64,
    /// Position in units of the edges.
    uv: DVec2,
}

/// All surfaces of `scene`: quads first, with their upper left corner as the corner, then triangles.
pub(super) fn patches(scene: &Scene) -> Vec<Patch> {
    let mut patches = Vec::new();
    for quad in &scene.quads {
        let (edge_u, edge_v) = (2.0 * quad.half_u, -2.0 * quad.half_v);
        patches.push(Patch {
            corner: quad.centre_m - quad.half_u + quad.half_v,
            edge_u,
            edge_v,
            triangle: false,
            normal: edge_u.cross(edge_v).normalize(),
            texture: [
                DVec2::ZERO,
                DVec2::new(edge_u.length() / quad.tile_m.x, 0.0),
                DVec2::new(0.0, edge_v.length() / quad.tile_m.y),
            ],
            material: quad.material,
        });
    }
    for mesh in &scene.meshes {
        assert!(mesh.normals.is_empty(), "vertex normals are not supported");
        for corners in &mesh.triangles {
            let [corner, second, third] = corners.map(|i| mesh.positions[i as usize]);
            let (edge_u, edge_v) = (second - corner, third - corner);
            let coordinates = corners.map(|i| {
                mesh.uvs.get(i as usize).map_or(DVec2::ZERO, |&[u, v]| {
                    DVec2::new(f64::from(u), f64::from(v))
                })
            });
            patches.push(Patch {
                corner,
                edge_u,
                edge_v,
                triangle: true,
                normal: edge_u.cross(edge_v).normalize(),
                texture: [
                    coordinates[0],
                    coordinates[1] - coordinates[0],
                    coordinates[2] - coordinates[0],
                ],
                material: mesh.material,
            });
        }
    }
    patches
}

impl Patch {
    /// The meeting point of a ray with this patch, whose index is `patch`, if it is closer than `limit` m.
    pub(super) fn meet(
        &self,
        patch: usize,
        origin: DVec3,
        direction: DVec3,
        limit: f64,
    ) -> Option<Hit> {
        // origin + t direction = corner + u edge_u + v edge_v, by Cramer's rule.
        let determinant = direction.dot(self.edge_u.cross(self.edge_v));
        let offset = origin - self.corner;
        let distance = -offset.dot(self.edge_u.cross(self.edge_v)) / determinant;
        let u = direction.dot(offset.cross(self.edge_v)) / determinant;
        let v = direction.dot(self.edge_u.cross(offset)) / determinant;
        let inside = u >= 0.0
            && v >= 0.0
            && if self.triangle {
                u + v <= 1.0
            } else {
                u.max(v) <= 1.0
            };
        // Below a nanometre lies only the neighbour of the patch on whose edge the ray starts.
        (inside && distance > 1e-9 && distance < limit).then_some(Hit {
            patch,
            distance,
            uv: DVec2::new(u, v),
        })
    }

    /// Reflectance per channel at a hit.
    pub(super) fn reflectance(&self, scene: &Scene, hit: &Hit) -> [f64; 3] {
        let material = &scene.materials[self.material];
        let Some(texture) = material.texture else {
            return material.reflectance;
        };
        let [corner, along_u, along_v] = self.texture;
        let at = corner + hit.uv.x * along_u + hit.uv.y * along_v;
        let texel = scene.textures[texture].sample(at.x, at.y);
        std::array::from_fn(|k| material.reflectance[k] * texel[k])
    }
}
