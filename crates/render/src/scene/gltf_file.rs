//! glTF files: the walk over their nodes.

use std::path::Path;

use super::gltf_extension;
use super::gltf_json::Node;
use super::gltf_light::{self, GltfCamera};
use super::gltf_material::MaterialReader;
use super::gltf_mesh::PrimitiveReader;
use super::gltf_resource::{GltfError, GltfSource, item};
use super::{Lamp, Material, Mesh, Texture};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

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

/// Reads the file's default scene (else its first, else all root nodes) and adds what it holds to `contents`,
/// `materials` and `textures`.
/// `placement` acts on the file's contents once they are in metres with +z up.
pub(super) fn read_into(
    path: &Path,
    placement: DAffine3,
    contents: &mut Contents,
    materials: &mut Vec<Material>,
    textures: &mut Vec<Texture>,
) -> Result<(), GltfError> {
    let source = GltfSource::read(path)?;
    gltf_extension::refuse_required(&source)?;
    let Contents {
        meshes,
        lamps,
        camera,
        warnings,
    } = contents;
    let materials = MaterialReader::new(&source, materials, textures, warnings);
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
        for warning in gltf_extension::warnings(document) {
            self.materials.warn(&warning);
        }
        if !document.animations.is_empty() {
            self.materials
                .warn("animations are not used; nodes stand in their rest position");
        }
        if !document.skins.is_empty() {
            self.materials
                .warn("skins are not used; meshes stand in their rest position");
        }
    }

    fn warn_about_light(&mut self, index: usize) {
        match self.source.document.extensions.punctual.lights[index]
            .shape
            .as_str()
        {
            "directional" => self
                .materials
                .warn("directional lights are not used; describe the sun in the scene file"),
            other => self.materials.warn(&format!(
                "light {index} is of the unknown type {other:?} and is not used"
            )),
        }
    }

    fn root_nodes(&self) -> Vec<usize> {
        let document = &self.source.document;
        let scene = document.scene.map(|scene| &document.scenes[scene]);
        if let Some(scene) = scene.or(document.scenes.first()) {
            return scene.nodes.clone();
        }
        let mut is_child = vec![false; document.nodes.len()];
        let children = document.nodes.iter().flat_map(|node| &node.children);
        children.for_each(|&child| is_child[child] = true);
        (0..is_child.len())
            .filter(|&node| !is_child[node])
            .collect()
    }

    fn visit_all(&mut self, world_from_gltf: DAffine3) -> Result<(), GltfError> {
        let nodes = &self.source.document.nodes;
        let mut visited = vec![false; nodes.len()];
        let roots = self.root_nodes();
        let mut waiting: Vec<_> = roots
            .into_iter()
            .rev()
            .map(|node| (node, world_from_gltf))
            .collect();
        while let Some((index, world_from_parent)) = waiting.pop() {
            let node = &nodes[index];
            let place = item("node", index, node.name.as_deref());
            if std::mem::replace(&mut visited[index], true) {
                return Err(self.source.resource(
                    &place,
                    "must be reached once, but the scene lists it twice or below another of its nodes",
                ));
            }
            if !gltf_extension::is_visible(node) {
                continue;
            }
            let world_from_node = world_from_parent * self.local_transform(node, &place)?;
            self.visit(node, &world_from_node)?;
            let children = node.children.iter().rev();
            waiting.extend(children.map(|&child| (child, world_from_node)));
        }
        Ok(())
    }

    fn local_transform(&self, node: &Node, place: &str) -> Result<DAffine3, GltfError> {
        let transform = match node.matrix {
            Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix)),
            None => {
                let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
                if !(rotation.length() > 0.0 && rotation.is_finite()) {
                    return Err(self.source.value(
                        format!("{place} rotation"),
                        "a unit quaternion",
                        rotation.to_array(),
                    ));
                }
                DAffine3::from_scale_rotation_translation(
                    DVec3::from_array(node.scale.unwrap_or([1.0; 3])),
                    rotation.normalize(),
                    DVec3::from_array(node.translation.unwrap_or_default()),
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

    fn visit(&mut self, node: &Node, world_from_node: &DAffine3) -> Result<(), GltfError> {
        if let Some(index) = node.mesh {
            let mesh = &self.source.document.meshes[index];
            let name = item("mesh", index, mesh.name.as_deref());
            for (i, primitive) in mesh.primitives.iter().enumerate() {
                let mut reader = PrimitiveReader {
                    source: self.source,
                    materials: &mut self.materials,
                    world_from_node,
                    place: format!("{name} primitive {i}"),
                    dropped: 0,
                };
                self.meshes.extend(reader.read(primitive)?);
                self.dropped += reader.dropped;
            }
        }
        if let Some(light) = &node.extensions.light {
            match gltf_light::read_light(self.source, light.light, world_from_node)? {
                Some(lamp) => self.lamps.push(lamp),
                None => self.warn_about_light(light.light),
            }
        }
        if let (Some(camera), None) = (node.camera, &self.camera) {
            *self.camera = gltf_light::read_camera(self.source, camera, world_from_node)?;
            if self.camera.is_none() {
                self.materials.warn(&format!(
                    "camera {camera} is not used; only perspective ones of less than half a turn are"
                ));
            }
        }
        Ok(())
    }
}
