//! glTF primitives as triangle meshes in world space.

use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};

use super::Mesh;
use super::gltf_accessor::{self as accessor, OF_INDICES, OF_VERTICES};
use super::gltf_json::Primitive;
use super::gltf_material::MaterialReader;
use super::gltf_resource::{GltfError, GltfSource};

/// Largest coordinate of a vertex, m.
const LARGEST_COORDINATE_M: f64 = 1e12;

/// Smallest area, doubled, of a triangle: its normal exists in single precision.
const LEAST_DOUBLED_AREA_M2: f64 = 1e-18;

/// Reads one primitive of one node.
pub(super) struct PrimitiveReader<'w, 'a> {
    pub(super) source: &'a GltfSource,
    pub(super) materials: &'w mut MaterialReader<'a>,
    pub(super) world_from_node: &'w DAffine3,
    /// Name for messages, such as `mesh 0 (hull) primitive 1`.
    pub(super) place: String,
    /// Triangles left out because they have next to no area.
    pub(super) dropped: usize,
}

impl PrimitiveReader<'_, '_> {
    /// The mesh; `None` when no triangle is left.
    pub(super) fn read(&mut self, primitive: &Primitive) -> Result<Option<Mesh>, GltfError> {
        let Some(mode) = Mode::of(primitive.mode) else {
            self.materials.warn(&format!(
                "{}: points and lines are not rendered",
                self.place
            ));
            return Ok(None);
        };
        if primitive.attributes.contains_key("COLOR_0") {
            self.materials
                .warn(&format!("{}: vertex colours are not used", self.place));
        }
        let Some(positions) = self.positions(primitive)? else {
            self.materials.warn(&format!(
                "{}: has no POSITION attribute and is not rendered",
                self.place
            ));
            return Ok(None);
        };
        let surface = self.materials.surface(primitive.material)?;
        let indices = self.indices(primitive, positions.len())?;
        let triangles = self.triangles(mode, &indices, &positions)?;
        if triangles.is_empty() {
            return Ok(None);
        }
        let normals = self.normals(primitive, positions.len())?;
        let uvs = match surface.look_up {
            Some((set, transform)) => self.uvs(primitive, set, transform, positions.len())?,
            None => Vec::new(),
        };
        Ok(Some(Mesh {
            positions,
            normals,
            uvs,
            triangles,
            material: surface.material,
        }))
    }

    /// An attribute with one finite element per vertex; `None` when the primitive has none of that name.
    fn attribute<const N: usize>(
        &self,
        primitive: &Primitive,
        name: &str,
        vertices: Option<usize>,
    ) -> Result<Option<Vec<[f64; N]>>, GltfError> {
        let Some(&accessor) = primitive.attributes.get(name) else {
            return Ok(None);
        };
        let place = format!("{} {name}", self.place);
        let elements: Vec<[f64; N]> = accessor::read(self.source, accessor, OF_VERTICES, &place)?;
        if let Some(vertices) = vertices.filter(|vertices| *vertices != elements.len()) {
            let expected = format!("{vertices}, the number of positions");
            return Err(self
                .source
                .value(format!("{place} count"), &expected, elements.len()));
        }
        match elements
            .iter()
            .position(|element| !element.iter().all(|value| value.is_finite()))
        {
            Some(i) => Err(self
                .source
                .value(format!("{place} {i}"), "finite", elements[i])),
            None => Ok(Some(elements)),
        }
    }

    /// Positions in the world, if there are any.
    fn positions(&self, primitive: &Primitive) -> Result<Option<Vec<DVec3>>, GltfError> {
        let Some(local) = self.attribute::<3>(primitive, "POSITION", None)? else {
            return Ok(None);
        };
        let to_world = |p: &[f64; 3]| self.world_from_node.transform_point3(DVec3::from_array(*p));
        let world: Vec<DVec3> = local.iter().map(to_world).collect();
        let near = |p: &DVec3| p.is_finite() && p.abs().max_element() <= LARGEST_COORDINATE_M;
        match world.iter().position(|p| !near(p)) {
            Some(i) => {
                let place = format!("{} POSITION {i}", self.place);
                Err(self.source.value(
                    place,
                    "within 1e12 m of the origin in the world",
                    world[i].to_array(),
                ))
            }
            None => Ok(Some(world)),
        }
    }

    /// Unit normals in the world; empty where the primitive has none or one of them has no direction.
    fn normals(&mut self, primitive: &Primitive, vertices: usize) -> Result<Vec<DVec3>, GltfError> {
        let Some(local) = self.attribute::<3>(primitive, "NORMAL", Some(vertices))? else {
            return Ok(Vec::new());
        };
        // The cofactor matrix, which is the inverse transpose but for a factor, and exists for any matrix.
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = self.world_from_node.matrix3;
        let sign = self.world_from_node.matrix3.determinant().signum();
        let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        let to_world = |normal: &[f64; 3]| (cofactor * DVec3::from_array(*normal)).try_normalize();
        let world: Option<Vec<DVec3>> = local.iter().map(to_world).collect();
        if world.is_none() {
            self.materials.warn(&format!(
                "{}: a vertex normal has no direction; flat shading is used",
                self.place
            ));
        }
        Ok(world.unwrap_or_default())
    }

    /// Coordinates in the texture: those of the set, transformed.
    fn uvs(
        &self,
        primitive: &Primitive,
        set: u32,
        transform: DAffine2,
        vertices: usize,
    ) -> Result<Vec<[f32; 2]>, GltfError> {
        let name = format!("TEXCOORD_{set}");
        let uvs = self.attribute::<2>(primitive, &name, Some(vertices))?;
        let reason = || format!("must have {name}, which its material's texture needs");
        let uvs = uvs.ok_or_else(|| self.source.resource(&self.place, reason()))?;
        let looked_up = |uv: &[f64; 2]| transform.transform_point2(DVec2::from_array(*uv));
        let uvs: Vec<DVec2> = uvs.iter().map(looked_up).collect();
        match uvs.iter().position(|uv| !uv.as_vec2().is_finite()) {
            Some(i) => Err(self.source.value(
                format!(
                    "{} {name} {i} after its material's KHR_texture_transform",
                    self.place
                ),
                "within single precision",
                uvs[i].to_array(),
            )),
            None => Ok(uvs.iter().map(|uv| uv.as_vec2().to_array()).collect()),
        }
    }

    fn indices(&self, primitive: &Primitive, vertices: usize) -> Result<Vec<u32>, GltfError> {
        let Some(accessor) = primitive.indices else {
            // An accessor has far fewer elements than 2³².
            return Ok((0..vertices as u32).collect());
        };
        let place = format!("{} index", self.place);
        let elements: Vec<[f64; 1]> = accessor::read(self.source, accessor, OF_INDICES, &place)?;
        let valid = |index: f64| index >= 0.0 && index < vertices as f64 && index.fract() == 0.0;
        match elements.iter().position(|[index]| !valid(*index)) {
            Some(i) => {
                let expected = format!("a whole number below {vertices}, the number of vertices");
                Err(self.source.value(
                    format!("{place} {i}"),
                    &expected,
                    format_args!("{}", elements[i][0]),
                ))
            }
            None => Ok(elements.into_iter().map(|[index]| index as u32).collect()),
        }
    }

    /// The triangles that have an area worth the name, their front counter-clockwise in the world.
    fn triangles(
        &mut self,
        mode: Mode,
        indices: &[u32],
        positions: &[DVec3],
    ) -> Result<Vec<[u32; 3]>, GltfError> {
        if mode == Mode::Triangles && !indices.len().is_multiple_of(3) {
            let place = format!("{} number of indices", self.place);
            return Err(self.source.value(place, "a multiple of 3", indices.len()));
        }
        let all = listed_triangles(mode, indices);
        let has_area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            (b - a).cross(c - a).length() >= LEAST_DOUBLED_AREA_M2
        };
        let mut kept: Vec<[u32; 3]> = all.iter().filter(|t| has_area(t)).copied().collect();
        self.dropped += all.len() - kept.len();
        if self.world_from_node.matrix3.determinant() < 0.0 {
            kept.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        Ok(kept)
    }
}

/// How the vertices of a primitive form triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    TriangleStrip,
    TriangleFan,
}

impl Mode {
    /// What the file's code stands for; `None` for points and lines.
    fn of(code: Option<u64>) -> Option<Self> {
        match code {
            None | Some(4) => Some(Self::Triangles),
            Some(5) => Some(Self::TriangleStrip),
            Some(6) => Some(Self::TriangleFan),
            Some(_) => None,
        }
    }
}

/// All triangles of a list, strip or fan, turned alike.
fn listed_triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(i, t): (usize, &[u32])| {
                if i % 2 == 0 {
                    [t[0], t[1], t[2]]
                } else {
                    [t[0], t[2], t[1]]
                }
            };
            indices.windows(3).enumerate().map(turned).collect()
        }
        Mode::TriangleFan => {
            let rim = indices.get(1..).unwrap_or_default();
            rim.windows(2)
                .map(|edge| [indices[0], edge[0], edge[1]])
                .collect()
        }
        _ => indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_orientation() {
        // A unit square in the plane z = 0, counter-clockwise from above, as each mode lists it.
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let cases: [(Mode, &[u32]); 3] = [
            (Mode::Triangles, &[0, 1, 2, 0, 2, 3]),
            (Mode::TriangleStrip, &[0, 1, 3, 2]),
            (Mode::TriangleFan, &[0, 1, 2, 3]),
        ];
        for (mode, indices) in cases {
            let triangles = listed_triangles(mode, indices);
            let doubled: Vec<DVec3> = triangles
                .iter()
                .map(|t| t.map(|i| corners[i as usize]))
                .map(|[a, b, c]| (b - a).cross(c - a))
                .collect();
            assert_eq!(doubled, [DVec3::Z, DVec3::Z], "{mode:?}");
        }
        assert!(listed_triangles(Mode::TriangleFan, &[]).is_empty());
    }
}
