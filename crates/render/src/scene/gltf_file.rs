//! glTF files: the walk over their nodes, and triangles in world space.

use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use gltf::Semantic;
use gltf::mesh::Mode;

use super::gltf_accessor as accessor;
use super::gltf_light::{self, GltfCamera};
use super::gltf_material::MaterialReader;
use super::gltf_resource::{GltfError, GltfSource, item};
use super::object::Objects;
use super::{Lamp, Mesh};

/// Largest coordinate of a vertex, m.
const LARGEST_COORDINATE_M: f64 = 1e12;
/// Extensions that are honoured; any other gets a warning.
const HONOURED: [&str; 3] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_mesh_quantization",
];
/// glTF has +y up, the world +z: x → x, y → z, z → -y.
const WORLD_FROM_GLTF: DMat3 = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);

/// What glTF files bring besides materials and textures.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) meshes: Vec<Mesh>,
    pub(super) lamps: Vec<Lamp>,
    /// The first perspective camera.
    pub(super) camera: Option<GltfCamera>,
    pub(super) warnings: Vec<String>,
}

/// Reads the file's default scene (else its first, else all root nodes) and adds what it holds to `objects`.
/// `placement` acts on the file's contents once they are in metres with +z up.
pub(super) fn read_into(
    path: &Path,
    placement: DAffine3,
    objects: &mut Objects,
) -> Result<(), GltfError> {
    let source = GltfSource::read(path)?;
    let Contents {
        meshes,
        lamps,
        camera,
        warnings,
    } = &mut objects.gltf;
    let materials = MaterialReader::new(
        &source,
        &mut objects.materials,
        &mut objects.textures,
        warnings,
    );
    let mut walk = Walk {
        source: &source,
        materials,
        meshes,
        lamps,
        camera,
        dropped: 0,
    };
    walk.warn_about_file();
    walk.visit_all(placement * DAffine3::from_mat3(WORLD_FROM_GLTF))?;
    if walk.dropped > 0 {
        walk.materials
            .warn(&format!("{} triangles without area left out", walk.dropped));
    }
    Ok(())
}

struct Walk<'a> {
    source: &'a GltfSource,
    materials: MaterialReader<'a>,
    meshes: &'a mut Vec<Mesh>,
    lamps: &'a mut Vec<Lamp>,
    camera: &'a mut Option<GltfCamera>,
    /// Triangles without area.
    dropped: usize,
}

impl<'a> Walk<'a> {
    fn warn_about_file(&mut self) {
        let document = &self.source.document;
        for extension in document
            .extensions_used()
            .filter(|name| !HONOURED.contains(name))
        {
            self.materials
                .warn(&format!("extension {extension} is not used"));
        }
        if document.animations().len() > 0 {
            self.materials
                .warn("animations are not used; nodes stand in their rest position");
        }
        if document.skins().len() > 0 {
            self.materials
                .warn("skins are not used; meshes stand in their rest position");
        }
    }

    fn root_nodes(&self) -> Vec<gltf::Node<'a>> {
        let document = &self.source.document;
        if let Some(scene) = document
            .default_scene()
            .or_else(|| document.scenes().next())
        {
            return scene.nodes().collect();
        }
        let mut is_child = vec![false; document.nodes().len()];
        document
            .nodes()
            .flat_map(|node| node.children())
            .for_each(|child| is_child[child.index()] = true);
        document
            .nodes()
            .filter(|node| !is_child[node.index()])
            .collect()
    }

    fn visit_all(&mut self, world_from_gltf: DAffine3) -> Result<(), GltfError> {
        let mut visited = vec![false; self.source.document.nodes().len()];
        let mut waiting: Vec<_> = self
            .root_nodes()
            .into_iter()
            .rev()
            .map(|node| (node, world_from_gltf))
            .collect();
        while let Some((node, world_from_parent)) = waiting.pop() {
            let place = item("node", node.index(), node.name());
            if std::mem::replace(&mut visited[node.index()], true) {
                return Err(self.source.resource(
                    &place,
                    "must be reached once, but has two parents or is inside itself",
                ));
            }
            let world_from_node = world_from_parent * self.local_transform(&node, &place)?;
            self.visit(&node, &world_from_node)?;
            let children: Vec<_> = node.children().collect();
            waiting.extend(
                children
                    .into_iter()
                    .rev()
                    .map(|child| (child, world_from_node)),
            );
        }
        Ok(())
    }

    fn local_transform(&self, node: &gltf::Node<'_>, place: &str) -> Result<DAffine3, GltfError> {
        let transform = match node.transform() {
            gltf::scene::Transform::Matrix { matrix } => DAffine3::from_mat4(
                DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))),
            ),
            gltf::scene::Transform::Decomposed {
                translation,
                rotation,
                scale,
            } => {
                let rotation = DQuat::from_array(rotation.map(f64::from));
                if !(rotation.length() > 0.0 && rotation.is_finite()) {
                    return Err(self.source.value(
                        format!("{place} rotation"),
                        "a unit quaternion",
                        rotation.to_array(),
                    ));
                }
                DAffine3::from_scale_rotation_translation(
                    DVec3::from_array(scale.map(f64::from)),
                    rotation.normalize(),
                    DVec3::from_array(translation.map(f64::from)),
                )
            }
        };
        if !transform.is_finite() {
            return Err(self.source.value(
                format!("{place} transform"),
                "finite",
                transform.to_cols_array(),
            ));
        }
        Ok(transform)
    }

    fn visit(
        &mut self,
        node: &gltf::Node<'_>,
        world_from_node: &DAffine3,
    ) -> Result<(), GltfError> {
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                let place = format!(
                    "{} primitive {}",
                    item("mesh", mesh.index(), mesh.name()),
                    primitive.index()
                );
                self.add_primitive(&primitive, world_from_node, &place)?;
            }
        }
        if let Some(light) = node.light() {
            match gltf_light::read_light(self.source, &light, world_from_node)? {
                Some(lamp) => self.lamps.push(lamp),
                None => self
                    .materials
                    .warn("directional lights are not used; describe the sun in the scene file"),
            }
        }
        if let (Some(camera), None) = (node.camera(), &self.camera) {
            *self.camera = gltf_light::read_camera(self.source, &camera, world_from_node)?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        world_from_node: &DAffine3,
        place: &str,
    ) -> Result<(), GltfError> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            self.materials
                .warn(&format!("{place}: points and lines are not rendered"));
            return Ok(());
        }
        if primitive.get(&Semantic::Colors(0)).is_some() {
            self.materials
                .warn(&format!("{place}: vertex colours are not used"));
        }
        let surface = self.materials.surface(&primitive.material())?;
        let positions = self.positions(primitive, world_from_node, place)?;
        let indices = self.indices(primitive, positions.len(), place)?;
        let mirrored = world_from_node.matrix3.determinant() < 0.0;
        let triangles = self.triangles(primitive.mode(), &indices, &positions, mirrored, place)?;
        if triangles.is_empty() {
            return Ok(());
        }
        let normals = self.normals(primitive, world_from_node, positions.len(), place)?;
        let uvs = match surface.tex_coord {
            Some(set) => self.uvs(primitive, set, positions.len(), place)?,
            None => Vec::new(),
        };
        self.meshes.push(Mesh {
            positions,
            normals,
            uvs,
            triangles,
            material: surface.material,
        });
        Ok(())
    }

    /// An attribute with one finite element per vertex; `None` when the primitive has none of that name.
    fn attribute<const N: usize>(
        &self,
        primitive: &gltf::Primitive<'_>,
        semantic: &Semantic,
        vertices: Option<usize>,
        place: &str,
    ) -> Result<Option<Vec<[f64; N]>>, GltfError> {
        let Some(accessor) = primitive.get(semantic) else {
            return Ok(None);
        };
        let place = format!("{place} {}", semantic.to_string());
        let elements: Vec<[f64; N]> = accessor::read(self.source, &accessor, &place)?;
        if vertices.is_some_and(|vertices| vertices != elements.len()) {
            let expected = format!(
                "as many as there are positions ({})",
                vertices.unwrap_or_default()
            );
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

    fn positions(
        &self,
        primitive: &gltf::Primitive<'_>,
        world_from_node: &DAffine3,
        place: &str,
    ) -> Result<Vec<DVec3>, GltfError> {
        let local = self.attribute::<3>(primitive, &Semantic::Positions, None, place)?;
        let local = local.ok_or_else(|| {
            self.source
                .resource(place, "must have a POSITION attribute")
        })?;
        let world: Vec<DVec3> = local
            .iter()
            .map(|p| world_from_node.transform_point3(DVec3::from_array(*p)))
            .collect();
        match world
            .iter()
            .position(|p| !(p.abs().max_element() <= LARGEST_COORDINATE_M))
        {
            Some(i) => {
                let expected = "within 1e12 m of the origin in the world";
                Err(self.source.value(
                    format!("{place} POSITION {i}"),
                    expected,
                    world[i].to_array(),
                ))
            }
            None => Ok(world),
        }
    }

    /// Unit normals in the world; empty where the primitive has none or one of them has no direction.
    fn normals(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        world_from_node: &DAffine3,
        vertices: usize,
        place: &str,
    ) -> Result<Vec<DVec3>, GltfError> {
        let Some(local) =
            self.attribute::<3>(primitive, &Semantic::Normals, Some(vertices), place)?
        else {
            return Ok(Vec::new());
        };
        // The cofactor matrix: the inverse transpose but for a positive or negative factor.
        let DMat3 {
            x_axis: x,
            y_axis: y,
            z_axis: z,
        } = world_from_node.matrix3;
        let sign = world_from_node.matrix3.determinant().signum();
        let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        let world: Option<Vec<DVec3>> = local
            .iter()
            .map(|normal| (cofactor * DVec3::from_array(*normal)).try_normalize())
            .collect();
        if world.is_none() {
            self.materials.warn(&format!(
                "{place}: a vertex normal has no direction; flat shading is used"
            ));
        }
        Ok(world.unwrap_or_default())
    }

    fn uvs(
        &self,
        primitive: &gltf::Primitive<'_>,
        set: u32,
        vertices: usize,
        place: &str,
    ) -> Result<Vec<[f32; 2]>, GltfError> {
        let uvs =
            self.attribute::<2>(primitive, &Semantic::TexCoords(set), Some(vertices), place)?;
        let missing = || {
            self.source.resource(
                place,
                format!("must have TEXCOORD_{set}, which its material's texture needs"),
            )
        };
        Ok(uvs
            .ok_or_else(missing)?
            .into_iter()
            .map(|uv| uv.map(|value| value as f32))
            .collect())
    }

    fn indices(
        &self,
        primitive: &gltf::Primitive<'_>,
        vertices: usize,
        place: &str,
    ) -> Result<Vec<u32>, GltfError> {
        let Some(accessor) = primitive.indices() else {
            return (0..vertices)
                .map(|i| u32::try_from(i).map_err(|_| self.too_many(place, vertices)))
                .collect();
        };
        let place = format!("{place} index");
        let elements: Vec<[f64; 1]> = accessor::read(self.source, &accessor, &place)?;
        match elements.iter().position(|[index]| {
            !(*index >= 0.0 && *index < vertices as f64 && index.fract() == 0.0)
        }) {
            Some(i) => {
                let expected = format!("a whole number below {vertices} (the number of vertices)");
                Err(self
                    .source
                    .value(format!("{place} {i}"), &expected, elements[i][0]))
            }
            None => Ok(elements.into_iter().map(|[index]| index as u32).collect()),
        }
    }

    fn too_many(&self, place: &str, vertices: usize) -> GltfError {
        self.source.value(
            format!("{place} number of vertices"),
            "at most 4294967295",
            vertices,
        )
    }

    /// The triangles that have an area, their front counter-clockwise in the world.
    fn triangles(
        &mut self,
        mode: Mode,
        indices: &[u32],
        positions: &[DVec3],
        mirrored: bool,
        place: &str,
    ) -> Result<Vec<[u32; 3]>, GltfError> {
        let all: Vec<[u32; 3]> = match mode {
            Mode::Triangles if indices.len() % 3 != 0 => {
                return Err(self.source.value(
                    format!("{place} number of indices"),
                    "a multiple of 3",
                    indices.len(),
                ));
            }
            Mode::Triangles => indices
                .chunks_exact(3)
                .map(|t| [t[0], t[1], t[2]])
                .collect(),
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
            _ => indices
                .get(1..)
                .unwrap_or_default()
                .windows(2)
                .map(|t| [t[0], t[1], indices[0]])
                .collect(),
        };
        let corner = |i: u32| positions[i as usize];
        let has_area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(c - a) != DVec3::ZERO
        };
        let kept: Vec<[u32; 3]> = all.iter().filter(|t| has_area(t)).copied().collect();
        self.dropped += all.len() - kept.len();
        Ok(if mirrored {
            kept.into_iter().map(|[a, b, c]| [a, c, b]).collect()
        } else {
            kept
        })
    }
}
