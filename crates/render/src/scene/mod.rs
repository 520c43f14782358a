//! Stage 1: what a scene file says, checked and in SI units.
//!
//! World frame: right-handed, +z up, metres. Colour triples are R, G, B. Radiance is linear.

mod calibration;
mod camera;
mod camera_table;
mod document;
mod error;
mod file;
mod fitted;
mod gltf_accessor;
mod gltf_check;
mod gltf_extension;
mod gltf_file;
mod gltf_json;
mod gltf_light;
mod gltf_material;
mod gltf_mesh;
mod gltf_resource;
mod gltf_rules;
mod gltf_schema;
mod kind;
mod lamp_power;
mod lens;
mod light;
mod material;
mod object;
mod phase;
pub mod photometry;
mod port;
mod range;
mod reader;
mod sections;
mod setting;
mod snow;
mod spectral;
mod texels;
mod texture;
mod value;
mod variation;

pub use camera::{CameraRay, SizeError};
pub use error::SceneError;
pub use gltf_resource::GltfError;
pub use lens::{Lens, Opening};
pub(crate) use lens::{OPENING_NUMBERS, on_opening};
pub use material::{
    Gloss, LEAST_ROUGHNESS, Material, NormalMap, Texture, TextureEncoding, TextureFilter,
};
pub use port::{Port, PortShape};
pub use setting::Setting;
pub use texels::Texels;
pub use uw_media::Encoding;

use glam::{DVec2, DVec3};
use uw_media::{
    Iops, Spectrum, Vignetting,
    phase::Phase,
    spectral::{Curve, Response, WaterSpectrum},
};

/// A scene, complete and valid: every number is finite and inside its range, every file has been read.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The water; `None` is air or vacuum.
    pub water: Option<Water>,
    /// Marine snow in the water.
    pub snow: Option<Snow>,
    /// The flat water surface; `None` when the medium fills all space.
    pub surface: Option<WaterSurface>,
    /// The sun. Without a surface it shines from infinity through the medium and is therefore only
    /// seen where there is no water.
    pub sun: Option<Sun>,
    /// Sky radiance, W/(m² sr), uniform over the upper hemisphere; the background when there is no surface.
    pub sky_radiance: Spectrum,
    /// The camera.
    pub camera: Camera,
    /// What is known of the wavelengths; `None` where the three channels are all there is.
    pub spectral: Option<Spectral>,
    /// The lamps in file order, those of glTF files last.
    pub lamps: Vec<Lamp>,
    /// Opaque parallelograms.
    pub quads: Vec<Quad>,
    /// Opaque triangle meshes, in world space.
    pub meshes: Vec<Mesh>,
    /// Materials that quads and meshes refer to by index.
    pub materials: Vec<Material>,
    /// Textures that materials refer to by index.
    pub textures: Vec<Texture>,
    /// The sensor; `None` when the file has none (float output only, PNG with defaults).
    pub sensor: Option<Sensor>,
    /// Defaults for the render, overridden on the command line.
    pub render: RenderSettings,
    /// What was read but cannot be honoured (metallic materials, directional lights and the like),
    /// one sentence each, for the user to see.
    pub warnings: Vec<String>,
}

/// The water.
#[derive(Clone, Debug)]
pub struct Water {
    /// Absorption and scattering per channel, 1/m; of a spectral scene those near zero range. Where the water varies they
    /// stand for all of it and nothing but noise depends on them.
    pub iops: Iops,
    /// How it differs from place to place.
    pub variation: Variation,
    /// Phase function, the same for all channels.
    pub phase: Phase,
    /// Refractive index against air, in [1, 2]; 1.34 by default.
    pub refractive_index: f64,
}

/// How the water differs from place to place; empty where it is the same everywhere.
#[derive(Clone, Debug, Default)]
pub struct Variation {
    /// The water at some depths, which grow; straight lines between them, the same beyond the first and the last, a jump
    /// where two are at one depth. With clouds at least one.
    pub layers: Vec<Layer>,
    /// Clouds, which add to the layers.
    pub plumes: Vec<Plume>,
}

/// The water at a depth.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Depth below the surface, m, >= 0.
    pub depth_m: f64,
    /// Absorption and scattering per channel, 1/m; by wavelength those near zero range.
    pub iops: Iops,
    /// The same by wavelength; all layers of a scene have it or none.
    pub spectrum: Option<WaterSpectrum>,
}

/// A cloud: its coefficients times exp(-r²/2σ²) at a distance r from its middle, at every wavelength of a channel.
#[derive(Clone, Copy, Debug)]
pub struct Plume {
    /// Middle, m.
    pub centre_m: DVec3,
    /// Standard deviation σ, m.
    pub sigma_m: f64,
    /// Absorption and scattering in its middle per channel, 1/m.
    pub iops: Iops,
}

/// Marine snow: flakes that hold a share of what the water scatters of the lamps' light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snow {
    /// Share of the once-scattered lamp light that sits in flakes, in [0, 1].
    pub share: f64,
    /// Flakes of a diameter d are as many as d to the power of minus this.
    pub slope: f64,
    /// Smallest and largest diameter, m.
    pub diameter_m: [f64; 2],
    /// Mean number of flakes in a cubic metre.
    pub per_m3: f64,
    /// Velocity of the flakes, m/s.
    pub drift_m_s: DVec3,
    /// Time at which the exposure begins, s: by then flakes have drifted so long.
    pub time_s: f64,
    /// Seed of the cloud.
    pub seed: u32,
    /// How the shutter blurs flakes.
    pub blur: Blur,
}

/// A shutter, which acts on flakes alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blur {
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
    /// Velocity of the camera, m/s; the picture is that of its place when the shutter opens.
    pub velocity_m_s: DVec3,
}

/// A scene by wavelength: a channel is the mean of what its wavelengths bring, weighted by the camera's response.
#[derive(Clone, Debug)]
pub struct Spectral {
    /// The water; `None` without water.
    pub water: Option<WaterSpectrum>,
    /// The camera's response.
    pub response: Response,
    /// Relative spectrum of the sun; `None`: the same at every wavelength of a channel.
    pub sun: Option<Curve>,
    /// The same of the sky.
    pub sky: Option<Curve>,
    /// Where the file gives a light's spectrum, and which, such as `sun spectrum "clear-sky"`.
    pub lights: Vec<String>,
}

/// The horizontal plane between water (below) and air.
#[derive(Clone, Copy, Debug)]
pub struct WaterSurface {
    /// Height of the surface, m. Depth is `height_m - z`.
    pub height_m: f64,
    /// False: index-matched, light enters unbent and without loss.
    pub refractive: bool,
}

/// A parallel beam from the sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// Unit direction in which sunlight travels in air (downwards: z < 0).
    pub travel_direction: DVec3,
    /// Irradiance on a plane perpendicular to the beam just above the surface, W/m² per channel.
    pub irradiance: Spectrum,
}

/// A camera: a centre of projection, a lens, and the port of a housing.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Centre of projection, m.
    pub position_m: DVec3,
    /// Unit direction of view.
    pub forward: DVec3,
    /// Unit image-right direction (forward × up).
    pub right: DVec3,
    /// Unit image-down direction.
    pub down: DVec3,
    /// Image width, pixels, >= 1.
    pub width: u32,
    /// Image height, pixels, >= 1.
    pub height: u32,
    /// Focal lengths (fx, fy), pixels.
    pub focal_px: DVec2,
    /// Principal point (cx, cy), pixels from the top left corner of the image.
    pub centre_px: DVec2,
    /// What the lens makes of directions.
    pub lens: Lens,
    /// The opening of its lens; `None` for a pinhole.
    pub opening: Option<Opening>,
    /// The port it looks through; `None` for an eye in the water itself.
    pub port: Option<Port>,
}

/// A lamp: a point with a hard cone, or a one-sided Lambertian disk.
#[derive(Clone, Debug)]
pub struct Lamp {
    /// Unique name, used for layers.
    pub name: String,
    /// Centre, m.
    pub position_m: DVec3,
    /// Unit direction of the axis.
    pub forward: DVec3,
    /// Radiant intensity on the axis at 100 %, W/sr per channel.
    pub intensity: Spectrum,
    /// Level, percent, in [0, 100].
    pub level_pct: f64,
    /// Half angle of the hard cone, degrees, in (0, 180].
    pub half_angle_deg: f64,
    /// Relative intensity against the angle from the axis.
    pub falloff: Falloff,
    /// Relative spectrum; `intensity` is the mean of a channel over it. `None`: the same at every wavelength of a channel.
    pub spectrum: Option<Curve>,
    /// 0 for a point; otherwise the radius of the disk, m. The disk's own cosine multiplies the falloff.
    pub radius_m: f64,
}

/// Relative intensity of a lamp against the angle from its axis, inside the cone.
#[derive(Clone, Debug, PartialEq)]
pub enum Falloff {
    /// 1 inside the cone.
    Uniform,
    /// Cosine of the angle, 0 beyond 90°.
    Cosine,
    /// Linear interpolation of (angle in degrees, relative intensity), angles increasing.
    Profile(Vec<(f64, f64)>),
}

/// An opaque parallelogram, `centre_m ± half_u ± half_v`, seen from both sides.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    /// Centre, m.
    pub centre_m: DVec3,
    /// Half the edge to the right as seen from the front, m.
    pub half_u: DVec3,
    /// Half the edge upwards, m.
    pub half_v: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Size of one texture tile (width, height), m; the tile starts at the upper left corner.
    pub tile_m: DVec2,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// An indexed triangle mesh in world space.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, or empty for flat shading.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, (0, 0) at the upper left corner of the texture, or empty.
    pub uvs: Vec<[f32; 2]>,
    /// Triangles as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// From linear radiance to digital numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// How radiance becomes the linear signal y (1.0 is full scale).
    pub exposure: Exposure,
    /// Encoding of the stored numbers.
    pub encoding: Encoding,
    /// Bits per channel, 8 or 16.
    pub bits: u32,
    /// Noise of the linear signal; `None` for none.
    pub noise: Option<Noise>,
    /// What the channels are multiplied by after the noise.
    pub white_balance: WhiteBalance,
    /// What the camera's channels are turned into after that, row by row those of the stored picture.
    pub color_matrix: [Spectrum; 3],
    /// What the lens leaves of the light away from the middle; `None`: all of it.
    pub vignetting: Option<Vignetting>,
}

/// White balance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum WhiteBalance {
    /// Channels as they are.
    #[default]
    None,
    /// Factors that make the means of a picture's channels equal.
    Gray,
    /// Factors of R, G and B.
    Gains(Spectrum),
}

/// Exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// y = exposure · radiance.
    Fixed(f64),
    /// The factor that brings the mean of y over all pixels and channels to this value.
    AutoMean(f64),
}

/// Signal-dependent noise of a linear signal y: variance a·y + b, then clipped to [0, 1] (Foi 2009).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Poissonian part, >= 0.
    pub a: f64,
    /// Gaussian part, >= 0.
    pub b: f64,
}

/// Render defaults of a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderSettings {
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// Largest number of scattering and reflection events; 0: unlimited.
    pub max_bounces: u32,
}
