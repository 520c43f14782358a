//! glTF materials as Lambertian surfaces: base colour becomes reflectance, emission becomes radiance.

use std::collections::HashMap;
use uw_media::Spectrum;

use glam::{DAffine2, DVec2};

use super::gltf_json::{self, TextureInfo};
use super::gltf_resource::{GltfError, GltfSource, item};
use super::{Material, Texture, TextureEncoding, TextureFilter, texture};

/// The file's code for looking up the nearest texel.
const NEAREST: u64 = 9728;
/// The file's code for textures that repeat.
const REPEAT: u64 = 10497;

/// Reads the materials of one file as they are asked for, each once.
pub(super) struct MaterialReader<'a> {
    pub(super) source: &'a GltfSource,
    pub(super) materials: &'a mut Vec<Material>,
    pub(super) textures: &'a mut Vec<Texture>,
    pub(super) warnings: &'a mut Vec<String>,
    read_materials: HashMap<Option<usize>, Surface>,
    read_textures: HashMap<(usize, TextureFilter), usize>,
}

/// A material of the scene, and where its texture is looked up.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Index into the scene's materials.
    pub(super) material: usize,
    /// Set of texture coordinates and what is done to them, if it has a texture.
    pub(super) look_up: Option<(u32, DAffine2)>,
}

impl<'a> MaterialReader<'a> {
    pub(super) fn new(
        source: &'a GltfSource,
        materials: &'a mut Vec<Material>,
        textures: &'a mut Vec<Texture>,
        warnings: &'a mut Vec<String>,
    ) -> Self {
        let (read_materials, read_textures) = Default::default();
        Self {
            source,
            materials,
            textures,
            warnings,
            read_materials,
            read_textures,
        }
    }

    /// Records something that is read but not honoured, once.
    pub(super) fn warn(&mut self, what: &str) {
        let warning = format!("{}: {what}", self.source.file);
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// The scene's material for a material of the file, by its index; `None` is the format's default material.
    pub(super) fn surface(&mut self, index: Option<usize>) -> Result<Surface, GltfError> {
        if let Some(surface) = self.read_materials.get(&index) {
            return Ok(*surface);
        }
        let (default, source) = (gltf_json::Material::default(), self.source);
        let (material, place) = match index {
            Some(i) => {
                let material = &source.document.materials[i];
                (material, item("material", i, material.name.as_deref()))
            }
            None => (&default, "default material".to_string()),
        };
        if index.is_some() {
            self.warn_about(material, &place);
        }
        let base = Base::of(material);
        let [r, g, b, _] = base.factor;
        if ![r, g, b].iter().all(|factor| (0.0..=1.0).contains(factor)) {
            let place = format!("{place} {}", base.name);
            return Err(source.value(place, "in [0, 1]", [r, g, b]));
        }
        let texture = match base.texture {
            Some(info) => self.texture(info.index)?,
            None => None,
        };
        let emission = self.emission(material, &place)?;
        self.materials.push(Material {
            spectrum: None,
            reflectance: [r, g, b],
            texture,
            emission,
        });
        let surface = Surface {
            material: self.materials.len() - 1,
            look_up: base.texture.filter(|_| texture.is_some()).map(look_up),
        };
        self.read_materials.insert(index, surface);
        Ok(surface)
    }

    fn warn_about(&mut self, material: &gltf_json::Material, place: &str) {
        let pbr = &material.pbr_metallic_roughness;
        let is_metallic = pbr.metallic_factor > 0.0 || pbr.metallic_roughness_texture.is_some();
        if is_metallic && material.extensions.specular_glossiness.is_none() {
            self.warn(&format!(
                "{place} is metallic; it is rendered as a Lambertian surface of its base colour"
            ));
        }
        if material
            .alpha_mode
            .as_ref()
            .is_some_and(|mode| mode != "OPAQUE")
        {
            self.warn(&format!(
                "{place} is transparent in places; it is rendered opaque"
            ));
        }
        if material.normal_texture.is_some() {
            self.warn(&format!("{place} has a normal map, which is not used"));
        }
    }

    /// Emitted radiance, W/(m² sr). A texture counts with its mean value over the whole surface.
    fn emission(
        &mut self,
        material: &gltf_json::Material,
        place: &str,
    ) -> Result<Spectrum, GltfError> {
        let strength = material.extensions.emissive_strength.as_ref();
        let strength = strength.map_or(1.0, |strength| strength.emissive_strength);
        let factor = material.emissive_factor.map(|factor| factor * strength);
        if !factor
            .iter()
            .all(|radiance| (0.0..=1e12).contains(radiance))
        {
            return Err(self.source.value(
                format!("{place} emissiveFactor times strength"),
                ">= 0 and finite",
                factor,
            ));
        }
        let info = material.emissive_texture.as_ref();
        let Some(info) = info.filter(|_| factor != [0.0; 3]) else {
            return Ok(factor);
        };
        let Some(image) = self.image_of(info.index) else {
            return Ok(factor);
        };
        self.warn(&format!(
            "{place} has an emissive texture; its mean is emitted all over the surface"
        ));
        let mean = self.decode(image, TextureFilter::Bilinear)?.mean();
        Ok(std::array::from_fn(|k| factor[k] * mean[k]))
    }

    /// The scene's texture for a texture of the file; `None` where that has no image, which counts as white.
    fn texture(&mut self, index: usize) -> Result<Option<usize>, GltfError> {
        let Some(image) = self.image_of(index) else {
            return Ok(None);
        };
        let document = &self.source.document;
        let sampler = document.textures[index].sampler;
        let sampler = sampler.map(|sampler| &document.samplers[sampler]);
        let code = |field: fn(&gltf_json::Sampler) -> Option<u64>| sampler.and_then(field);
        let wraps = [
            code(|sampler| sampler.wrap_s),
            code(|sampler| sampler.wrap_t),
        ];
        if wraps.into_iter().flatten().any(|wrap| wrap != REPEAT) {
            self.warn(&format!(
                "texture {index} does not repeat in the file; it does here"
            ));
        }
        let filter = if code(|sampler| sampler.mag_filter) == Some(NEAREST) {
            TextureFilter::Nearest
        } else {
            TextureFilter::Bilinear
        };
        let key = (image, filter);
        if let Some(&index) = self.read_textures.get(&key) {
            return Ok(Some(index));
        }
        let decoded = self.decode(image, filter)?;
        self.textures.push(decoded);
        self.read_textures.insert(key, self.textures.len() - 1);
        Ok(Some(self.textures.len() - 1))
    }

    /// The image of a texture. The format lets an extension bring one instead, which is not read.
    fn image_of(&mut self, texture: usize) -> Option<usize> {
        let image = self.source.document.textures[texture].source;
        if image.is_none() {
            self.warn(&format!(
                "texture {texture} has no source that is read here; it counts as white"
            ));
        }
        image
    }

    fn decode(&self, image: usize, filter: TextureFilter) -> Result<Texture, GltfError> {
        let bytes = self.source.image_bytes(image)?;
        let uri = self.source.document.images[image].uri.as_deref();
        let room = texture::room_beside(self.textures);
        Texture::from_bytes(&bytes, TextureEncoding::Srgb, filter, room)
            .map_err(|reason| self.source.resource(&item("image", image, uri), reason))
    }
}

/// What a material's reflectance is made of.
struct Base<'a> {
    /// The file's name for the factor.
    name: &'static str,
    factor: [f64; 4],
    texture: Option<&'a TextureInfo>,
}

impl<'a> Base<'a> {
    /// The diffuse part of the specular-glossiness model where the material has that, else the base colour.
    fn of(material: &'a gltf_json::Material) -> Self {
        match &material.extensions.specular_glossiness {
            Some(model) => Self {
                name: "diffuseFactor",
                factor: model.diffuse_factor,
                texture: model.diffuse_texture.as_ref(),
            },
            None => Self {
                name: "baseColorFactor",
                factor: material.pbr_metallic_roughness.base_color_factor,
                texture: material.pbr_metallic_roughness.base_color_texture.as_ref(),
            },
        }
    }
}

/// Set of texture coordinates and what is done to them: scaled, turned, moved.
fn look_up(info: &TextureInfo) -> (u32, DAffine2) {
    let Some(transform) = &info.extensions.transform else {
        return (info.tex_coord, DAffine2::IDENTITY);
    };
    // Counter-clockwise as the picture is seen, whose v points downwards.
    let placed = DAffine2::from_scale_angle_translation(
        DVec2::from_array(transform.scale),
        -transform.rotation,
        DVec2::from_array(transform.offset),
    );
    (transform.tex_coord.unwrap_or(info.tex_coord), placed)
}
