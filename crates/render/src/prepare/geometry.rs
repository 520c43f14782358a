//! What rays can meet: parallelograms tested one by one, triangles through a tree.

use glam::{DVec2, DVec3};
use uw_media::Spectrum;

use super::bvh::{Triangle, TriangleHit, TriangleTree};
use crate::scene::{LEAST_ROUGHNESS, Material, Mesh, Quad, Scene, Texture};

/// Which primitive a ray starts on, so that it cannot meet it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// None: the ray starts in the open.
    None,
    /// Index of a parallelogram.
    Quad(u32),
    /// Index of a triangle in tree order.
    Triangle(u32),
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray, m.
    pub t: f64,
    /// What was met.
    pub primitive: Primitive,
    /// Position on the primitive: ±1 along the half edges of a quad, barycentric weights of a triangle.
    pub local: [f64; 2],
}

/// The surface at a hit.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Unit geometric normal on the side the ray came from.
    pub normal: DVec3,
    /// Unit shading normal on the same side.
    pub shading_normal: DVec3,
    /// Lambertian reflectance per channel, in [0, 1]; the base colour of a glossy surface.
    pub reflectance: Spectrum,
    /// Emitted radiance per channel, W/(m² sr).
    pub emission: Spectrum,
    /// Roughness and metallic of a glossy surface; `None`: Lambertian.
    pub gloss: Option<(f64, f64)>,
    /// Index of the material; of no meaning where nothing was met.
    pub material: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct PreparedQuad {
    pub(crate) quad: Quad,
    pub(crate) dual_u: DVec3,
    pub(crate) dual_v: DVec3,
}

#[derive(Clone, Debug)]
pub(crate) struct TriangleShading {
    pub(crate) material: u32,
    pub(crate) normals: Option<[DVec3; 3]>,
    pub(crate) uvs: Option<[DVec2; 3]>,
}

/// All surfaces of a scene.
#[derive(Clone, Debug)]
pub struct Geometry {
    pub(crate) quads: Vec<PreparedQuad>,
    pub(crate) tree: Option<TriangleTree>,
    pub(crate) shading: Vec<TriangleShading>,
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Texture>,
    bounds: Option<(DVec3, DVec3)>,
    /// Largest coordinate of the camera, m.
    camera_reach: f64,
}

impl Geometry {
    /// Flattens the surfaces of `scene` and builds the tree.
    pub fn build(scene: &Scene) -> Self {
        let quads: Vec<PreparedQuad> = scene.quads.iter().map(PreparedQuad::new).collect();
        let mut triangles = Vec::new();
        let mut shading = Vec::new();
        for mesh in &scene.meshes {
            add_mesh(mesh, &mut triangles, &mut shading);
        }
        let tree = TriangleTree::build(triangles);
        let shading = match &tree {
            Some(t) => t
                .order()
                .iter()
                .map(|&i| shading[i as usize].clone())
                .collect(),
            None => Vec::new(),
        };
        let mut bounds = tree.as_ref().map(TriangleTree::bounds);
        for q in &scene.quads {
            let reach = q.half_u.abs() + q.half_v.abs();
            let own = (q.centre_m - reach, q.centre_m + reach);
            bounds = Some(bounds.map_or(own, |b| (b.0.min(own.0), b.1.max(own.1))));
        }
        Self {
            quads,
            tree,
            shading,
            materials: scene.materials.clone(),
            textures: scene.textures.clone(),
            bounds,
            camera_reach: scene.camera.position_m.abs().max_element(),
        }
    }

    /// Lower and upper corner of everything, m; `None` for an empty scene.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.quads.len() + self.shading.len()
    }

    /// Whether there is nothing to meet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Largest radiance that a surface emits, W/(m² sr) per channel.
    pub fn largest_emission(&self) -> Spectrum {
        let quads = self.quads.iter().map(|q| q.quad.material);
        let triangles = self.shading.iter().map(|s| s.material as usize);
        quads.chain(triangles).fold([0.0; 3], |largest, material| {
            let emission = self.materials[material].emission;
            std::array::from_fn(|k| f64::max(largest[k], emission[k]))
        })
    }

    /// The same surfaces, whose light is what `emission` makes of theirs, W/(m² sr) per channel.
    pub fn with_emission(&self, emission: impl Fn(Spectrum) -> Spectrum) -> Self {
        let mut changed = self.clone();
        for material in &mut changed.materials {
            material.emission = emission(material.emission);
        }
        changed
    }

    /// Nearest surface along the ray closer than `t_max`; the ray starts on `from`.
    pub fn closest(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        from: Primitive,
    ) -> Option<Hit> {
        let t_min = self.start_distance(origin, from);
        let mut best: Option<Hit> = None;
        let mut best_t = t_max;
        for (i, quad) in self.quads.iter().enumerate() {
            if from == Primitive::Quad(i as u32) {
                continue;
            }
            if let Some((t, local)) = quad.intersect(origin, direction, t_min, best_t) {
                best_t = t;
                best = Some(Hit {
                    t,
                    primitive: Primitive::Quad(i as u32),
                    local,
                });
            }
        }
        if let Some(tree) = &self.tree
            && let Some(TriangleHit {
                t,
                triangle,
                barycentric,
            }) = tree.closest(origin, direction, t_min, best_t, skipped_triangle(from))
        {
            best = Some(Hit {
                t,
                primitive: Primitive::Triangle(triangle),
                local: barycentric,
            });
        }
        best
    }

    /// Whether a surface lies closer than `t_max` along the ray, which starts on `from`.
    pub fn occluded(&self, origin: DVec3, direction: DVec3, t_max: f64, from: Primitive) -> bool {
        let t_min = self.start_distance(origin, from);
        let quad_blocks = |(i, quad): (usize, &PreparedQuad)| {
            from != Primitive::Quad(i as u32)
                && quad.intersect(origin, direction, t_min, t_max).is_some()
        };
        self.quads.iter().enumerate().any(quad_blocks)
            || self.tree.as_ref().is_some_and(|tree| {
                tree.occluded(origin, direction, t_min, t_max, skipped_triangle(from))
            })
    }

    /// Least distance at which a surface counts for a ray that starts at a computed point: the rounding of the
    /// point's coordinates, a few parts in 1e12 of them or of those of the camera that it was seen from. Rays from the
    /// camera or a lamp start at exact points.
    #[inline]
    fn start_distance(&self, origin: DVec3, from: Primitive) -> f64 {
        if from == Primitive::None {
            0.0
        } else {
            4e-12 * origin.abs().max_element().max(self.camera_reach)
        }
    }

    /// Normal, reflectance and emission at a hit of a ray that travels along `direction`.
    pub fn surface_point(&self, hit: &Hit, direction: DVec3) -> SurfacePoint {
        let facing = |n: DVec3| if n.dot(direction) > 0.0 { -n } else { n };
        match hit.primitive {
            Primitive::Quad(i) => {
                let quad = &self.quads[i as usize].quad;
                let normal = facing(quad.normal);
                self.material_point(
                    quad.material,
                    Some(quad.texture_coordinates(hit.local)),
                    normal,
                    normal,
                )
            }
            Primitive::Triangle(i) => self.triangle_point(i as usize, hit.local, &facing),
            Primitive::None => SurfacePoint {
                normal: -direction,
                shading_normal: -direction,
                reflectance: [0.0; 3],
                emission: [0.0; 3],
                gloss: None,
                material: 0,
            },
        }
    }

    fn triangle_point(
        &self,
        index: usize,
        [v, w]: [f64; 2],
        facing: &impl Fn(DVec3) -> DVec3,
    ) -> SurfacePoint {
        let shading = &self.shading[index];
        let triangle = self.tree.as_ref().map(|t| t.triangles()[index]);
        let normal = triangle.map_or(DVec3::Z, |t| {
            t.edge_1.cross(t.edge_2).normalize_or(DVec3::Z)
        });
        let normal = facing(normal);
        let u = 1.0 - v - w;
        let smooth = shading
            .normals
            .map(|n| (u * n[0] + v * n[1] + w * n[2]).normalize_or(normal));
        let smooth = smooth.map_or(normal, |n| if n.dot(normal) < 0.0 { -n } else { n });
        let uv = shading.uvs.map(|t| u * t[0] + v * t[1] + w * t[2]);
        let bent = self.bent_normal(index, uv, normal, smooth);
        self.material_point(shading.material as usize, uv, normal, bent)
    }

    /// The normal of a map on a triangle, on the side of `normal`, as `smooth` is; that where there is no map.
    fn bent_normal(&self, index: usize, uv: Option<DVec2>, normal: DVec3, smooth: DVec3) -> DVec3 {
        let shading = &self.shading[index];
        let map = self.materials[shading.material as usize].normal_map;
        let (Some(map), Some(uv), Some(uvs), Some(tree)) = (map, uv, shading.uvs, &self.tree)
        else {
            return smooth;
        };
        let triangle = tree.triangles()[index];
        let own = self.textures[map.texture].sample(uv.x, uv.y);
        let own = 2.0 * DVec3::from(own) - 1.0;
        let [first, second] = [uvs[1] - uvs[0], uvs[2] - uvs[0]];
        let turned = first.perp_dot(second).signum();
        // What is seen from behind is turned over as a whole.
        let side = triangle.edge_1.cross(triangle.edge_2).dot(normal).signum();
        let front = side * smooth;
        let along = turned * (triangle.edge_1 * second.y - triangle.edge_2 * first.y);
        let Some(right) = along.reject_from_normalized(front).try_normalize() else {
            return smooth;
        };
        // v runs downwards in the texture.
        let upwards = -turned * front.cross(right);
        let [x, y] = [map.scale * own.x, map.scale * own.y];
        let bent = side * (x * right + y * upwards + own.z * front);
        match bent.try_normalize() {
            Some(bent) if bent.dot(normal) > 0.0 => bent,
            _ => smooth,
        }
    }

    /// The material of a primitive and the place in its textures of a point there, the origin where it has none; `None` where a map
    /// bends normals.
    pub(crate) fn place_in_texture(
        &self,
        primitive: Primitive,
        local: [f64; 2],
    ) -> Option<(usize, DVec2)> {
        match primitive {
            Primitive::None => None,
            Primitive::Quad(index) => {
                let quad = &self.quads[index as usize].quad;
                Some((quad.material, quad.texture_coordinates(local)))
            }
            Primitive::Triangle(index) => {
                let shading = &self.shading[index as usize];
                let material = &self.materials[shading.material as usize];
                let [v, w] = local;
                let at = |t: [DVec2; 3]| (1.0 - v - w) * t[0] + v * t[1] + w * t[2];
                let place = shading.uvs.map(at);
                let is_plain = material.texture.is_none() && material.emission_texture.is_none();
                let place = place.or(is_plain.then_some(DVec2::ZERO));
                let place = place.filter(|_| material.normal_map.is_none());
                Some((shading.material as usize, place?))
            }
        }
    }

    /// Reflectance of a material at a place in its textures.
    pub(crate) fn reflectance(&self, material: usize, place: DVec2) -> Spectrum {
        let material = &self.materials[material];
        self.textured(material.reflectance, material.texture, place)
    }

    /// Light that a material emits at a place in its textures, W/(m² sr).
    pub(crate) fn emission(&self, material: usize, place: DVec2) -> Spectrum {
        let material = &self.materials[material];
        self.textured(material.emission, material.emission_texture, place)
    }

    /// What a texture makes of values, where there is one.
    fn textured(&self, values: Spectrum, texture: Option<usize>, place: DVec2) -> Spectrum {
        let Some(texture) = texture else {
            return values;
        };
        let [red, green, blue] = self.textures[texture].sample(place.x, place.y);
        [values[0] * red, values[1] * green, values[2] * blue]
    }

    fn material_point(
        &self,
        material: usize,
        uv: Option<DVec2>,
        normal: DVec3,
        shading_normal: DVec3,
    ) -> SurfacePoint {
        let index = material;
        let material = &self.materials[index];
        let looked_up = |texture: Option<usize>| match (texture, uv) {
            (Some(texture), Some(uv)) => self.textures[texture].sample(uv.x, uv.y),
            _ => [1.0; 3],
        };
        let colour = looked_up(material.texture);
        let light = looked_up(material.emission_texture);
        let gloss = material.gloss.map(|gloss| {
            let [_, roughness, metallic] = looked_up(gloss.texture);
            let roughness = (gloss.roughness * roughness).max(LEAST_ROUGHNESS);
            (roughness, gloss.metallic * metallic)
        });
        SurfacePoint {
            normal,
            shading_normal,
            reflectance: std::array::from_fn(|k| material.reflectance[k] * colour[k]),
            emission: std::array::from_fn(|k| material.emission[k] * light[k]),
            gloss,
            material: index,
        }
    }
}

fn skipped_triangle(from: Primitive) -> u32 {
    match from {
        Primitive::Triangle(i) => i,
        _ => u32::MAX,
    }
}

impl PreparedQuad {
    fn new(quad: &Quad) -> Self {
        // Dual basis in the plane, also right for a skewed parallelogram.
        let (u, v) = (quad.half_u, quad.half_v);
        let n = u.cross(v);
        let n2 = n.length_squared();
        Self {
            quad: *quad,
            dual_u: v.cross(n) / n2,
            dual_v: n.cross(u) / n2,
        }
    }

    #[inline]
    fn intersect(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(f64, [f64; 2])> {
        let cosine = self.quad.normal.dot(direction);
        let offset = self.quad.centre_m - origin;
        let t = self.quad.normal.dot(offset) / cosine;
        // A ray within the plane gives NaN or infinity, which fails here.
        if !(t > t_min && t < t_max) {
            return None;
        }
        let p = t * direction - offset;
        let local = [p.dot(self.dual_u), p.dot(self.dual_v)];
        (local[0].abs() <= 1.0 && local[1].abs() <= 1.0).then_some((t, local))
    }
}

fn add_mesh(mesh: &Mesh, triangles: &mut Vec<Triangle>, shading: &mut Vec<TriangleShading>) {
    for t in &mesh.triangles {
        let [i, j, k] = t.map(|i| i as usize);
        let corner = mesh.positions[i];
        let (edge_1, edge_2) = (mesh.positions[j] - corner, mesh.positions[k] - corner);
        if edge_1.cross(edge_2).length_squared() == 0.0 {
            continue;
        }
        triangles.push(Triangle {
            corner,
            edge_1,
            edge_2,
        });
        let uv = |i: usize| DVec2::new(f64::from(mesh.uvs[i][0]), f64::from(mesh.uvs[i][1]));
        shading.push(TriangleShading {
            material: mesh.material as u32,
            normals: (!mesh.normals.is_empty()).then(|| [i, j, k].map(|i| mesh.normals[i])),
            uvs: (!mesh.uvs.is_empty()).then(|| [uv(i), uv(j), uv(k)]),
        });
    }
}
