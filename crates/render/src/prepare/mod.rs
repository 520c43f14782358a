//! Stage 2: the scene as flat tables for the integrators.

mod air_way;
pub(crate) mod bvh;
mod daylight;
mod daylight_field;
mod expected_light;
mod features;
mod geometry;
mod gloss;
mod lamps;
mod layers;
mod medium;
mod spectrum;
mod sun_phase;

use std::sync::Arc;
use uw_media::{Spectrum, phase::DiskTable};

use glam::DVec3;

pub(crate) use air_way::AirWay;
pub use daylight::{Boundary, SunBeam};
pub use daylight_field::DaylightField;
pub use features::Features;
pub use geometry::{Geometry, Hit, Primitive, SurfacePoint};
pub(crate) use gloss::{AlbedoTable, AlbedoTables};
pub use lamps::PreparedLamp;
pub use layers::{Coefficients, Layers, Relative, Way};
pub use medium::{Medium, Strategies};
pub use spectrum::{AtWavelengths, WavelengthSets};

use crate::scene::{Camera, Scene, Snow};

/// Radiance all around over the intensity of lamps in the air, 1/m², where there is hardly any.
const DIM: f64 = 1e-6;

/// Everything an integrator reads.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The camera.
    pub camera: Camera,
    /// The water; `None` in air or in perfectly clear water.
    pub medium: Option<Medium>,
    /// How the water varies; `None` where it is the same everywhere.
    pub layers: Option<Layers>,
    /// Marine snow, where a camera in the water sees it.
    pub snow: Option<Snow>,
    /// The scene by wavelength; `None` where the three channels are all there is.
    pub spectrum: Option<WavelengthSets>,
    /// The water surface; `None` when the medium fills all space.
    pub boundary: Option<Boundary>,
    /// Surfaces, shared by all scenes that differ in other things only.
    pub geometry: Arc<Geometry>,
    /// Refractive index of what fills the space below the water surface, or all of it; 1 without water.
    pub(crate) index_of_water: f64,
    /// Albedos of glossy surfaces; `None` where there are none.
    pub(crate) albedos: Option<AlbedoTables>,
    /// Lamps in scene order.
    pub lamps: Vec<PreparedLamp>,
    /// Names of the lamps.
    pub lamp_names: Vec<String>,
    /// The sun, where its light can arrive.
    pub sun: Option<SunBeam>,
    /// The phase function's mean over its disk, where water scatters it.
    pub sun_phase: Option<Arc<DiskTable>>,
    /// Sky radiance, W/(m² sr).
    pub sky: Spectrum,
    /// Daylight in the water far from any object, to steer walks; `None` where nothing scatters it.
    pub daylight: Option<DaylightField>,
    /// By how much flights towards the light are stretched, per strategy of the medium's attenuation.
    pub stretch: Spectrum,
    /// Largest radiance that a surface emits, per channel.
    pub largest_emission: Spectrum,
    /// Order of magnitude of the radiance all around where there is no field of daylight, per channel.
    pub ambient_scale: Spectrum,
    /// What the scene makes use of.
    pub features: Features,
}

impl Prepared {
    /// Flattens `scene`.
    pub fn build(scene: &Scene) -> Self {
        Self::build_with(scene, Arc::new(Geometry::build(scene)))
    }

    /// Flattens everything in `scene` but its quads, meshes, materials and textures, which are not looked at:
    /// `geometry` takes their place.
    pub fn build_with(scene: &Scene, geometry: Arc<Geometry>) -> Self {
        let mut prepared = Self::build_unsteered(scene, geometry);
        let daylight = prepared.solve_daylight(scene);
        prepared.steer(daylight);
        prepared
    }

    /// As [`Prepared::build_with`], without the field of daylight, which takes longest: renders are right all the
    /// same, and noisier in daylight until [`Prepared::steer`] has brought it.
    pub fn build_unsteered(scene: &Scene, geometry: Arc<Geometry>) -> Self {
        let boundary = Boundary::build(scene);
        let spectrum = WavelengthSets::build(scene, &geometry);
        let layers = Layers::build(scene, boundary.as_ref());
        let depth_m = boundary.map_or(0.0, |b| (b.height - scene.camera.position_m.z).max(0.0));
        let medium = scene.water.as_ref().and_then(|water| match &spectrum {
            Some(spectrum) => Medium::by_wavelength(water, spectrum, depth_m),
            None => Medium::build(water),
        });
        let medium = medium.map(|medium| match &layers {
            Some(layers) => medium.with_extremes_of(layers, spectrum.as_ref()),
            None => medium,
        });
        let beside_surface = |lamp: PreparedLamp| {
            lamp.beside(boundary.as_ref(), medium.as_ref(), scene.camera.position_m)
        };
        let lamps = scene.lamps.iter().map(PreparedLamp::build);
        let lamps: Vec<_> = lamps.map(beside_surface).collect();
        let above = boundary.is_some_and(|b| scene.camera.position_m.z > b.height);
        // Without a surface the sun would be infinitely far away through the water.
        let lit = boundary.is_some() || medium.is_none();
        let sun = SunBeam::build(scene, boundary.as_ref()).filter(|_| lit);
        let features = Features::analyse(
            medium.as_ref(),
            boundary.as_ref(),
            &geometry,
            &lamps,
            sun.as_ref(),
            scene,
        );
        let largest_emission = geometry.largest_emission();
        let ambient_scale = std::array::from_fn(|k| {
            let sun = sun.as_ref().map_or(0.0, |s| s.irradiance_in_air[k]);
            // Of lamps as little as keeps walks alive where nothing else shines: kernels know better what they bring.
            let in_air = lamps.iter().filter(|lamp| lamp.in_air);
            let lamps: f64 = in_air.map(|lamp| DIM * lamp.intensity[k]).sum();
            (sun + lamps) / std::f64::consts::PI + scene.sky_radiance[k] + largest_emission[k]
        });
        let scattered = scene
            .water
            .as_ref()
            .zip(sun.as_ref())
            .filter(|_| boundary.is_some());
        let sun_phase =
            scattered.map(|(water, sun)| sun_phase::sun_phase(&water.phase, sun.radius_rad));
        let index_of_water = scene
            .water
            .as_ref()
            .map_or(1.0, |water| water.refractive_index);
        Self {
            index_of_water,
            albedos: AlbedoTables::build(&geometry.materials, index_of_water),
            sun_phase,
            snow: scene.snow.filter(|_| medium.is_some() && !above),
            camera: scene.placed_camera(),
            medium,
            layers,
            spectrum,
            boundary,
            geometry,
            lamps,
            lamp_names: scene.lamps.iter().map(|l| l.name.clone()).collect(),
            sun,
            sky: scene.sky_radiance,
            daylight: None,
            stretch: [0.0; 3],
            largest_emission,
            ambient_scale,
            features,
        }
    }

    /// The field of daylight in the water of `scene`, which this was made of; `None` where nothing scatters it.
    pub fn solve_daylight(&self, scene: &Scene) -> Option<DaylightField> {
        let (medium, boundary) = (self.medium.as_ref()?, self.boundary.as_ref()?);
        let deepest = deepest_m(scene, medium, boundary, &self.geometry);
        DaylightField::build(
            medium,
            boundary,
            self.sun.as_ref(),
            self.sky,
            deepest,
            self.layers.as_ref(),
        )
    }

    /// Steers walks by a field of daylight; that of another water makes them noisier, not wrong.
    pub fn steer(&mut self, daylight: Option<DaylightField>) {
        self.stretch = match (&daylight, &self.medium) {
            (Some(daylight), Some(medium)) => daylight.stretch(medium),
            _ => [0.0; 3],
        };
        self.daylight = daylight;
    }

    /// Whether `point` lies in the air above a water surface.
    #[inline]
    pub fn in_air(&self, point: DVec3) -> bool {
        self.boundary.is_some_and(|b| point.z > b.height)
    }

    /// Depth of `point` below the water surface, m; 0 above it or without one.
    #[inline]
    pub fn depth(&self, point: DVec3) -> f64 {
        self.boundary.map_or(0.0, |b| (b.height - point.z).max(0.0))
    }

    /// The way of `length_m` in the water from `origin` along a unit vector.
    pub fn way(&self, origin: DVec3, direction: DVec3, length_m: f64) -> Way {
        match &self.layers {
            Some(layers) => layers.way(origin, direction, length_m),
            None => Way::Length(length_m),
        }
    }

    /// Transmittance of a way per channel, where channels are all there is.
    pub fn transmittance(&self, way: &Way) -> Spectrum {
        let coefficients = self.layers.as_ref().map(|layers| &layers.coefficients[..]);
        let c = self.medium.as_ref().map_or([0.0; 3], |medium| medium.c);
        way.transmittance(c, coefficients.unwrap_or_default())
    }

    /// `point` mirrored at the water surface.
    #[inline]
    pub fn mirror(&self, point: DVec3) -> DVec3 {
        let height = self.boundary.map_or(0.0, |b| b.height);
        DVec3::new(point.x, point.y, 2.0 * height - point.z)
    }
}

/// The greatest depth from which light matters: the camera's, or that of objects not too far below it.
fn deepest_m(scene: &Scene, medium: &Medium, boundary: &Boundary, geometry: &Geometry) -> f64 {
    /// Optical depth below the camera within which objects count.
    const BELOW_CAMERA: f64 = 5.0;
    let camera = (boundary.height - scene.camera.position_m.z).max(0.0);
    let reach = camera + BELOW_CAMERA / medium.c_min;
    let bottom = geometry
        .bounds()
        .map_or(0.0, |(lower, _)| boundary.height - lower.z);
    camera.max(bottom.min(reach))
}
