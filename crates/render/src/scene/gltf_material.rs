//! glTF materials: base colour becomes reflectance, metallic and roughness gloss, emission radiance.

use std::collections::HashMap;
use uw_media::Spectrum;

use glam::{DAffine2, DVec2};

use super::gltf_json::{self, TextureInfo};
use super::gltf_resource::{GltfError, GltfSource, item};
use super::object::USUAL_INDEX;
use super::{Gloss, Material, NormalMap, Texture, TextureEncoding, TextureFilter, texture};

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
    read_textures: HashMap<(usize, TextureFilter, TextureEncoding), usize>,
}

/// A material of the scene, and where its texture is looked up.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// Index into the scene's materials.
    pub(super) material: usize,
    /// Set of texture coordinates and what is done to them, if it has a texture.
    pub(super) look_up: Option<LookUp>,
}

/// Set of texture coordinates and what is done to them: scaled, turned, moved.
type LookUp = (u32, DAffine2);

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
        let mut shared = None;
        let texture = match base.texture {
            Some(info) => self.texture(info, TextureEncoding::Srgb, &mut shared)?,
            None => None,
        };
        // The surface of meshes without a material is matt: few of their makers mean a metal, which is the format's default.
        let gloss = match index {
            Some(_) => self.gloss(material, &place, &mut shared)?,
            None => None,
        };
        let normal_map = self.normal_map(material, &place, &mut shared)?;
        let (emission, emission_texture) = self.emission(material, &place, &mut shared)?;
        self.materials.push(Material {
            spectrum: None,
            reflectance: [r, g, b],
            texture,
            emission,
            emission_texture,
            gloss,
            normal_map,
        });
        let surface = Surface {
            material: self.materials.len() - 1,
            look_up: shared,
        };
        self.read_materials.insert(index, surface);
        Ok(surface)
    }

    fn warn_about(&mut self, material: &gltf_json::Material, place: &str) {
        if material
            .alpha_mode
            .as_ref()
            .is_some_and(|mode| mode != "OPAQUE")
        {
            self.warn(&format!(
                "{place} is transparent in places; it is rendered opaque"
            ));
        }
    }

    /// How the material shines. `None`, a Lambertian surface, for one of another model, and for a dielectric that is as rough
    /// as can be, which is what exporters write for matt surfaces.
    fn gloss(
        &mut self,
        material: &gltf_json::Material,
        place: &str,
        shared: &mut Option<LookUp>,
    ) -> Result<Option<Gloss>, GltfError> {
        let (pbr, extensions) = (&material.pbr_metallic_roughness, &material.extensions);
        let is_matt = pbr.metallic_factor == 0.0
            && pbr.roughness_factor == 1.0
            && pbr.metallic_roughness_texture.is_none();
        if extensions.specular_glossiness.is_some() || extensions.unlit.is_some() || is_matt {
            return Ok(None);
        }
        let index = extensions.ior.as_ref().map_or(USUAL_INDEX, |own| own.ior);
        let index = if (1.0..=4.0).contains(&index) {
            index
        } else {
            self.warn(&format!(
                "{place} has an index of refraction of {index}; {USUAL_INDEX} is taken, as none is in [1, 4]"
            ));
            USUAL_INDEX
        };
        let mut gloss = Gloss {
            roughness: pbr.roughness_factor,
            metallic: pbr.metallic_factor,
            index,
            texture: None,
        };
        if let Some(info) = &pbr.metallic_roughness_texture {
            if fits(shared, info) {
                gloss.texture = self.texture(info, TextureEncoding::Linear, shared)?;
            } else if let Some(mean) = self.mean(info, TextureEncoding::Linear)? {
                self.warn_about_look_up(place, "metallic-roughness texture", "its mean counts");
                gloss.roughness *= mean[1];
                gloss.metallic *= mean[2];
            }
        }
        Ok(Some(gloss))
    }

    fn normal_map(
        &mut self,
        material: &gltf_json::Material,
        place: &str,
        shared: &mut Option<LookUp>,
    ) -> Result<Option<NormalMap>, GltfError> {
        let Some(map) = &material.normal_texture else {
            return Ok(None);
        };
        if !fits(shared, &map.info) {
            self.warn_about_look_up(place, "normal map", "it is not used");
            return Ok(None);
        }
        let texture = self.texture(&map.info, TextureEncoding::Linear, shared)?;
        Ok(texture.map(|texture| NormalMap {
            texture,
            scale: map.scale,
        }))
    }

    fn warn_about_look_up(&mut self, place: &str, what: &str, then: &str) {
        self.warn(&format!(
            "{place} has a {what} whose coordinates are not those of its other textures; {then}"
        ));
    }

    /// Emitted radiance, W/(m² sr), and the texture that it is multiplied by.
    fn emission(
        &mut self,
        material: &gltf_json::Material,
        place: &str,
        shared: &mut Option<LookUp>,
    ) -> Result<(Spectrum, Option<usize>), GltfError> {
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
            return Ok((factor, None));
        };
        if fits(shared, info) {
            return Ok((factor, self.texture(info, TextureEncoding::Srgb, shared)?));
        }
        let Some(mean) = self.mean(info, TextureEncoding::Srgb)? else {
            return Ok((factor, None));
        };
        self.warn_about_look_up(place, "emissive texture", "its mean is emitted all over");
        Ok((std::array::from_fn(|k| factor[k] * mean[k]), None))
    }

    /// Mean of the texels of a texture; `None` where it has no image.
    fn mean(
        &mut self,
        info: &TextureInfo,
        encoding: TextureEncoding,
    ) -> Result<Option<Spectrum>, GltfError> {
        let Some(image) = self.image_of(info.index) else {
            return Ok(None);
        };
        let decoded = self.decode(image, TextureFilter::Bilinear, encoding)?;
        Ok(Some(decoded.mean()))
    }

    /// The scene's texture for a texture of the file; `None` where that has no image, which counts as white. Coordinates become
    /// those that the textures of a material share.
    fn texture(
        &mut self,
        info: &TextureInfo,
        encoding: TextureEncoding,
        shared: &mut Option<LookUp>,
    ) -> Result<Option<usize>, GltfError> {
        let index = info.index;
        let Some(image) = self.image_of(index) else {
            return Ok(None);
        };
        *shared = Some(look_up(info));
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
        let key = (image, filter, encoding);
        if let Some(&index) = self.read_textures.get(&key) {
            return Ok(Some(index));
        }
        let decoded = self.decode(image, filter, encoding)?;
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

    fn decode(
        &self,
        image: usize,
        filter: TextureFilter,
        encoding: TextureEncoding,
    ) -> Result<Texture, GltfError> {
        let bytes = self.source.image_bytes(image)?;
        let uri = self.source.document.images[image].uri.as_deref();
        let room = texture::room_beside(self.textures);
        Texture::from_bytes(&bytes, encoding, filter, room)
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

/// Whether a texture is looked up where the others of its material are.
fn fits(shared: &Option<LookUp>, info: &TextureInfo) -> bool {
    shared.is_none_or(|shared| shared == look_up(info))
}

fn look_up(info: &TextureInfo) -> LookUp {
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
