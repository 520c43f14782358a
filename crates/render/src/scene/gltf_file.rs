//! glTF files: the walk over their nodes.

use std::path::Path;

use super::gltf_light::{self, GltfCamera};
use super::gltf_material::MaterialReader;
use super::gltf_mesh::PrimitiveReader;
use super::gltf_resource::{GltfError, GltfSource, item};
use super::object::Objects;
use super::{Lamp, Mesh};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

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
                let name = item("mesh", mesh.index(), mesh.name());
                let mut reader = PrimitiveReader {
                    source: self.source,
                    materials: &mut self.materials,
                    world_from_node,
                    place: format!("{name} primitive {}", primitive.index()),
                    dropped: 0,
                };
                self.meshes.extend(reader.read(&primitive)?);
                self.dropped += reader.dropped;
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
}
