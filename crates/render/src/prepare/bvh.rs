//! Triangles in a compressed wide BVH.
//!
//! The tree works in f32 on scaled coordinates and only proposes candidates; the triangle test is f64.
//! Boxes are padded by more than the f32 rounding of rays and boxes, so no triangle can be missed.

use glam::{DVec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    cwbvh::{CwBvh, builder::build_cwbvh},
    ray::{Ray, RayHit},
};

/// Extent of the scene in the tree's own units. Large, because the tree's box test carries an absolute
/// epsilon of 1e-4 that has to be negligible.
const TREE_EXTENT: f64 = 1048576.0;
/// Padding of boxes, tree units: 2^-19 of the extent, more than the rounding of f32 rays (about 2^-22).
const PADDING: f32 = 2.0;

/// One triangle: a corner and two edges.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// First corner, m.
    pub corner: DVec3,
    /// Second corner minus first, m.
    pub edge_1: DVec3,
    /// Third corner minus first, m.
    pub edge_2: DVec3,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHit {
    /// Distance along the ray, m.
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub barycentric: [f64; 2],
}

impl Triangle {
    /// Distance and barycentric weights of the hit along `origin + t·direction` (Möller and Trumbore 1997).
    #[inline]
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
        let p = direction.cross(self.edge_2);
        let determinant = self.edge_1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let s = origin - self.corner;
        let u = s.dot(p) * inverse;
        if !(-1e-12..=1.0 + 1e-12).contains(&u) {
            return None;
        }
        let q = s.cross(self.edge_1);
        let v = direction.dot(q) * inverse;
        if v < -1e-12 || u + v > 1.0 + 1e-12 {
            return None;
        }
        Some((self.edge_2.dot(q) * inverse, u, v))
    }
}

/// Triangles and the tree over them.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    triangles: Vec<Triangle>,
    tree: CwBvh,
    centre: DVec3,
    scale: f64,
    lower: DVec3,
    upper: DVec3,
}

struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl TriangleTree {
    /// Builds the tree; `None` for no triangles.
    pub fn build(triangles: Vec<Triangle>) -> Option<Self> {
        let mut lower = DVec3::INFINITY;
        let mut upper = DVec3::NEG_INFINITY;
        for t in &triangles {
            for p in [t.corner, t.corner + t.edge_1, t.corner + t.edge_2] {
                lower = lower.min(p);
                upper = upper.max(p);
            }
        }
        if triangles.is_empty() {
            return None;
        }
        let centre = 0.5 * (lower + upper);
        let scale = TREE_EXTENT / (upper - lower).max_element().max(f64::MIN_POSITIVE * 1e9);
        let boxes: Vec<PaddedBox> = triangles
            .iter()
            .map(|t| padded_box(t, centre, scale))
            .collect();
        let mut build_time = std::time::Duration::ZERO;
        let tree = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut build_time);
        let triangles = tree
            .primitive_indices
            .iter()
            .map(|&i| triangles[i as usize])
            .collect();
        Some(Self {
            triangles,
            tree,
            centre,
            scale,
            lower,
            upper,
        })
    }

    /// Original index of every triangle, in the tree's order.
    pub fn order(&self) -> &[u32] {
        &self.tree.primitive_indices
    }

    /// The nodes, whose boxes are in units of their own.
    pub(crate) fn nodes(&self) -> &CwBvh {
        &self.tree
    }

    /// Lower and upper corner of the bounding box, m.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.lower, self.upper)
    }

    /// The triangles in the tree's order.
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Nearest hit with `t_min < t < t_max`, leaving out triangle `skip` (tree order).
    pub fn closest(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        skip: u32,
    ) -> Option<TriangleHit> {
        let (ray, entry) = self.tree_ray(origin, direction, t_max)?;
        let mut best: Option<TriangleHit> = None;
        let mut best_t = t_max;
        self.tree.ray_traverse(ray, &mut RayHit::none(), |_, id| {
            if id as u32 == skip {
                return f32::INFINITY;
            }
            match self.triangles[id].intersect(origin, direction) {
                Some((t, u, v)) if t > t_min && t < best_t => {
                    best_t = t;
                    best = Some(TriangleHit {
                        t,
                        triangle: id as u32,
                        barycentric: [u, v],
                    });
                    self.tree_distance(t - entry)
                }
                _ => f32::INFINITY,
            }
        });
        best
    }

    /// Whether anything but `skip` lies at `t_min < t < t_max`.
    pub fn occluded(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        skip: u32,
    ) -> bool {
        let Some((ray, _)) = self.tree_ray(origin, direction, t_max) else {
            return false;
        };
        !self.tree.ray_traverse_miss(ray, |_, id| {
            if id as u32 == skip {
                return f32::INFINITY;
            }
            match self.triangles[id].intersect(origin, direction) {
                Some((t, _, _)) if t > t_min && t < t_max => 0.0,
                _ => f32::INFINITY,
            }
        })
    }

    /// The ray in tree units, started where it enters the bounding box, and that distance in metres.
    fn tree_ray(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<(Ray, f64)> {
        let margin = DVec3::splat(f64::from(PADDING) / self.scale);
        let inverse = direction.recip();
        let a = (self.lower - margin - origin) * inverse;
        let b = (self.upper + margin - origin) * inverse;
        // 0·inf is NaN where a ray runs inside a slab's face: min and max then keep the other value.
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(0.0);
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)).min(t_max);
        if near > far {
            return None;
        }
        let start = (origin + near * direction - self.centre) * self.scale;
        let reach = self.tree_distance((t_max - near).min(far - near + 1.0 / self.scale));
        let ray = Ray::new(
            Vec3A::new(start.x as f32, start.y as f32, start.z as f32),
            // Adding 0 makes -0, at which the tree's test of boxes fails, a +0.
            Vec3A::new(direction.x as f32, direction.y as f32, direction.z as f32) + Vec3A::ZERO,
            0.0,
            reach,
        );
        Some((ray, near))
    }

    /// A distance in tree units, rounded up beyond the rounding of f32.
    fn tree_distance(&self, t: f64) -> f32 {
        (t * self.scale * (1.0 + 1e-6)) as f32 + PADDING
    }
}

fn padded_box(t: &Triangle, centre: DVec3, scale: f64) -> PaddedBox {
    let mut lower = Vec3A::INFINITY;
    let mut upper = Vec3A::NEG_INFINITY;
    for p in [t.corner, t.corner + t.edge_1, t.corner + t.edge_2] {
        let q = (p - centre) * scale;
        let q = Vec3A::new(q.x as f32, q.y as f32, q.z as f32);
        lower = lower.min(q);
        upper = upper.max(q);
    }
    PaddedBox(Aabb::new(lower - PADDING, upper + PADDING))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_ray_leaves_a_closed_mesh_along_a_face_of_its_boxes() {
        let corners = [(2, 0, -1), (-1, 2, -1), (-1, -2, -1), (0, 0, 2)]
            .map(|(x, y, z)| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        let triangle = |[i, j, k]: [usize; 3]| Triangle {
            corner: corners[i],
            edge_1: corners[j] - corners[i],
            edge_2: corners[k] - corners[i],
        };
        let faces = [[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let tree = TriangleTree::build(faces.map(triangle).to_vec()).expect("four triangles");
        let parts = [0.0, -0.0, 1e-60, -1e-60, 1e-40, -1e-40, 0.6, -0.6];
        for (x, y, z) in parts.into_iter().flat_map(|x| {
            parts
                .into_iter()
                .flat_map(move |y| parts.into_iter().map(move |z| (x, y, z)))
        }) {
            let direction = DVec3::new(x, y, z);
            if direction.max_element().max(-direction.min_element()) < 0.1 {
                continue;
            }
            let (direction, origin) = (direction.normalize(), DVec3::new(0.1, 0.05, -0.2));
            assert!(
                tree.occluded(origin, direction, 0.0, 100.0, u32::MAX),
                "{direction:?}"
            );
            assert!(
                tree.closest(origin, direction, 0.0, 100.0, u32::MAX)
                    .is_some(),
                "{direction:?}"
            );
        }
    }
}
