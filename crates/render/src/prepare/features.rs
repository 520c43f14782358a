//! What a scene makes use of, so that the rest can be skipped.

use serde::Serialize;

use super::{Boundary, Geometry, Medium, PreparedLamp, SunBeam};
use crate::scene::{Material, Scene};

/// Features a scene can reach.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Features {
    /// There is absorption or scattering.
    pub medium: bool,
    /// There is scattering.
    pub scattering: bool,
    /// The water varies.
    pub layers: bool,
    /// The channels differ so much that each needs its own sampling.
    pub chromatic: bool,
    /// Samples have wavelengths.
    pub spectrum: bool,
    /// There is a water surface.
    pub boundary: bool,
    /// The surface refracts and reflects.
    pub refraction: bool,
    /// There are surfaces to meet.
    pub geometry: bool,
    /// Some of them rise above the water.
    pub geometry_in_air: bool,
    /// There are textures.
    pub textures: bool,
    /// Some surfaces shine.
    pub gloss: bool,
    /// Some have normal maps.
    pub normal_maps: bool,
    /// Surfaces differ in reflectance, from place to place or from one to the next.
    pub varied_reflectance: bool,
    /// There are lamps.
    pub lamps: bool,
    /// Some of them are in the air above the water.
    pub lamps_in_air: bool,
    /// Some of them are disks.
    pub disks: bool,
    /// Some of them are of different brightness inside their beam.
    pub falloffs: bool,
    /// Some have narrow beams, in scattering water that is the same everywhere.
    pub beams: bool,
    /// The sun shines.
    pub sun: bool,
    /// The sky shines.
    pub sky: bool,
    /// Surfaces emit light.
    pub emission: bool,
}

impl Features {
    /// Analyses the prepared parts of `scene`.
    pub fn analyse(
        medium: Option<&Medium>,
        boundary: Option<&Boundary>,
        geometry: &Geometry,
        lamps: &[PreparedLamp],
        sun: Option<&SunBeam>,
        scene: &Scene,
    ) -> Self {
        let above = |b: &Boundary| {
            geometry
                .bounds()
                .is_some_and(|(_, upper)| upper.z > b.height)
        };
        let scattering = medium.is_some_and(Medium::scatters);
        let layers = (scene.water.as_ref()).is_some_and(|water| !water.variation.is_none());
        Self {
            medium: medium.is_some(),
            scattering,
            layers,
            chromatic: medium
                .is_some_and(|m| m.by_scattering.count > 1 || m.by_attenuation.count > 1),
            spectrum: scene.spectral.is_some(),
            boundary: boundary.is_some(),
            refraction: boundary.is_some_and(|b| b.index != 1.0),
            geometry: !geometry.is_empty(),
            geometry_in_air: boundary.is_some_and(above),
            textures: !geometry.textures.is_empty(),
            gloss: geometry.materials.iter().any(|m| m.gloss.is_some()),
            normal_maps: geometry.materials.iter().any(|m| m.normal_map.is_some()),
            varied_reflectance: varied_reflectance(geometry),
            lamps: lamps.iter().any(|l| l.intensity.iter().any(|&i| i > 0.0)),
            lamps_in_air: lamps.iter().any(|l| l.in_air),
            disks: lamps.iter().any(|l| l.radius > 0.0),
            falloffs: lamps.iter().any(|l| l.falloff.is_some()),
            beams: scattering && !layers && lamps.iter().any(PreparedLamp::has_beam),
            sun: sun.is_some(),
            sky: scene.sky_radiance.iter().any(|&l| l > 0.0),
            emission: geometry.largest_emission() != [0.0; 3],
        }
    }

    /// Whether any light comes from elsewhere than lamps in the water.
    pub fn ambient(&self) -> bool {
        self.sun || self.sky || self.emission || self.lamps_in_air
    }

    /// Names of what is skipped, for the statistics.
    pub fn skipped(&self) -> Vec<&'static str> {
        [
            (self.medium, "medium"),
            (self.scattering, "scattering"),
            (self.layers, "layers"),
            (self.chromatic, "chromatic sampling"),
            (self.spectrum, "spectrum"),
            (self.boundary, "surface"),
            (self.refraction, "refraction"),
            (self.geometry, "geometry"),
            (self.geometry_in_air, "geometry in air"),
            (self.textures, "textures"),
            (self.gloss, "gloss"),
            (self.normal_maps, "normal maps"),
            (self.varied_reflectance, "varied reflectance"),
            (self.lamps, "lamps"),
            (self.lamps_in_air, "lamps in air"),
            (self.disks, "disks"),
            (self.falloffs, "falloffs"),
            (self.beams, "beams"),
            (self.sun, "sun"),
            (self.sky, "sky"),
            (self.emission, "emission"),
        ]
        .into_iter()
        .filter_map(|(needed, name)| (!needed).then_some(name))
        .collect()
    }
}

fn varied_reflectance(geometry: &Geometry) -> bool {
    let differ = |pair: &[Material]| {
        pair[0].reflectance != pair[1].reflectance
            || pair[0].spectrum != pair[1].spectrum
            || pair[0].gloss != pair[1].gloss
    };
    let materials = &geometry.materials;
    materials.iter().any(|m| m.texture.is_some()) || materials.windows(2).any(differ)
}
