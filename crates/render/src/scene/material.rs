//! What surfaces are made of.

use uw_media::{Spectrum, spectral::Curve};

use super::Texels;

/// A surface: Lambertian, or glossy over a matt base.
#[derive(Clone, Debug, Default)]
pub struct Material {
    /// Reflectance per channel in [0, 1], multiplied by the texture where there is one. Of a glossy surface the base colour.
    pub reflectance: Spectrum,
    /// Reflectance by wavelength, in the place of the other two.
    pub spectrum: Option<Curve>,
    /// Index into [`Scene::textures`](super::Scene::textures).
    pub texture: Option<usize>,
    /// Emitted radiance, W/(m² sr) per channel, both sides.
    pub emission: Spectrum,
    /// Index into [`Scene::textures`](super::Scene::textures) of what emission is multiplied by.
    pub emission_texture: Option<usize>,
    /// How it shines; `None`: Lambertian.
    pub gloss: Option<Gloss>,
    /// How its normals are bent from place to place.
    pub normal_map: Option<NormalMap>,
}

/// Roughness of a mirror-like surface below which it is rendered with this one, in [0, 1].
pub const LEAST_ROUGHNESS: f64 = 0.05;

/// GGX microfacets (Walter et al. 2007) with glTF's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Roughness in [0, 1], whose square is the α of GGX; below [`LEAST_ROUGHNESS`] it is that.
    pub roughness: f64,
    /// 0: a dielectric over a matt base; 1: a metal, whose reflectance at normal incidence is the base colour; in [0, 1].
    pub metallic: f64,
    /// Refractive index of the dielectric, >= 1.
    pub index: f64,
    /// Index into [`Scene::textures`](super::Scene::textures) of what roughness (green) and metallic (blue) are multiplied by.
    pub texture: Option<usize>,
}

/// A picture of normals: red to the right in the texture, green upwards, blue out of the surface, 0.5 is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Index into [`Scene::textures`](super::Scene::textures).
    pub texture: usize,
    /// What red and green are multiplied by.
    pub scale: f64,
}

/// A picture of linear reflectances.
#[derive(Clone)]
pub struct Texture {
    /// Width, texels, >= 1.
    pub width: u32,
    /// Height, texels, >= 1.
    pub height: u32,
    /// Linear R, G, B in [0, 1], row 0 at the top.
    pub texels: Texels,
    /// How values between texel centres are found; coordinates repeat.
    pub filter: TextureFilter,
}

/// Texture lookup.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureFilter {
    /// Linear between the four nearest texel centres.
    Bilinear,
    /// The texel that holds the point.
    Nearest,
}

/// Encoding of a texture's stored values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureEncoding {
    /// Proportional to the reflectance.
    Linear,
    /// The sRGB transfer function (IEC 61966-2-1).
    Srgb,
}
