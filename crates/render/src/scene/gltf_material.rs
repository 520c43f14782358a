//! glTF materials as Lambertian surfaces: base colour becomes reflectance, emission becomes radiance.

use std::collections::HashMap;

use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, WrappingMode};

use super::gltf_resource::{GltfError, GltfSource, item};
use super::{Encoding, Material, Texture, TextureFilter};

/// Reads the materials of one file as they are asked for, each once.
pub(super) struct MaterialReader<'a> {
    pub(super) source: &'a GltfSource,
    pub(super) materials: &'a mut Vec<Material>,
    pub(super) textures: &'a mut Vec<Texture>,
    pub(super) warnings: &'a mut Vec<String>,
    read_materials: HashMap<Option<usize>, Surface>,
    read_textures: HashMap<(usize, TextureFilter), usize>,
}

/// A material of the scene, and which texture coordinates it needs.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Index into the scene's materials.
    pub(super) material: usize,
    /// Set of texture coordinates, if it has a texture.
    pub(super) tex_coord: Option<u32>,
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

    /// The scene's material for a material of the file.
    pub(super) fn surface(&mut self, material: &gltf::Material<'_>) -> Result<Surface, GltfError> {
        if let Some(surface) = self.read_materials.get(&material.index()) {
            return Ok(*surface);
        }
        let place = material
            .index()
            .map_or("default material".to_string(), |i| {
                item("material", i, material.name())
            });
        self.warn_about(material, &place);
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor().map(f64::from);
        if ![r, g, b].iter().all(|factor| (0.0..=1.0).contains(factor)) {
            return Err(self.source.value(
                format!("{place} baseColorFactor"),
                "in [0, 1]",
                [r, g, b],
            ));
        }
        let base = pbr.base_color_texture();
        let texture = base
            .as_ref()
            .map(|info| self.texture(&info.texture()))
            .transpose()?;
        let emission = self.emission(material, &place)?;
        self.materials.push(Material {
            reflectance: [r, g, b],
            texture,
            emission,
        });
        let surface = Surface {
            material: self.materials.len() - 1,
            tex_coord: base.map(|info| info.tex_coord()),
        };
        self.read_materials.insert(material.index(), surface);
        Ok(surface)
    }

    fn warn_about(&mut self, material: &gltf::Material<'_>, place: &str) {
        let pbr = material.pbr_metallic_roughness();
        // A material of the file that says nothing is metallic by the format's default and means nothing by it.
        if material.index().is_some()
            && (pbr.metallic_factor() > 0.0 || pbr.metallic_roughness_texture().is_some())
        {
            self.warn(&format!(
                "{place} is metallic; it is rendered as a Lambertian surface of its base colour"
            ));
        }
        if material.alpha_mode() != AlphaMode::Opaque {
            self.warn(&format!(
                "{place} is transparent in places; it is rendered opaque"
            ));
        }
        if material.normal_texture().is_some() {
            self.warn(&format!("{place} has a normal map, which is not used"));
        }
    }

    /// Emitted radiance, W/(m² sr). A texture counts with its mean value over the whole surface.
    fn emission(
        &mut self,
        material: &gltf::Material<'_>,
        place: &str,
    ) -> Result<[f64; 3], GltfError> {
        let strength = f64::from(material.emissive_strength().unwrap_or(1.0));
        let factor = material
            .emissive_factor()
            .map(|factor| f64::from(factor) * strength);
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
        let Some(info) = material.emissive_texture().filter(|_| factor != [0.0; 3]) else {
            return Ok(factor);
        };
        self.warn(&format!(
            "{place} has an emissive texture; its mean is emitted all over the surface"
        ));
        let mean = self
            .decode(&info.texture(), TextureFilter::Bilinear)?
            .mean();
        Ok(std::array::from_fn(|k| factor[k] * mean[k]))
    }

    fn texture(&mut self, texture: &gltf::Texture<'_>) -> Result<usize, GltfError> {
        let sampler = texture.sampler();
        if sampler.wrap_s() != WrappingMode::Repeat || sampler.wrap_t() != WrappingMode::Repeat {
            self.warn(&format!(
                "texture {} does not repeat in the file; it does here",
                texture.index()
            ));
        }
        let nearest = sampler.mag_filter() == Some(MagFilter::Nearest);
        let filter = if nearest {
            TextureFilter::Nearest
        } else {
            TextureFilter::Bilinear
        };
        let key = (texture.source().index(), filter);
        if let Some(&index) = self.read_textures.get(&key) {
            return Ok(index);
        }
        let decoded = self.decode(texture, filter)?;
        self.textures.push(decoded);
        self.read_textures.insert(key, self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }

    fn decode(
        &self,
        texture: &gltf::Texture<'_>,
        filter: TextureFilter,
    ) -> Result<Texture, GltfError> {
        let index = texture.source().index();
        let bytes = self.source.image_bytes(index)?;
        let uri = self.source.document.as_json().images[index].uri.as_deref();
        Texture::from_bytes(&bytes, Encoding::Srgb, filter)
            .map_err(|reason| self.source.resource(&item("image", index, uri), reason))
    }
}
