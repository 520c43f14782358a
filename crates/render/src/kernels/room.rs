//! What a lane needs memory for, and what a kernel need not do for a scene.

use super::layout::{HELD_ROWS, Scene};
use crate::prepare::Prepared;

/// Rows of four words of a place of the scratch buffer for vertices.
const SLOT_ROWS: u32 = 3;
/// Places that the stack of walks that look for daylight needs: 76 walks.
const AMBIENT_SLOTS: u32 = 128;
/// Segments of the daylight walks of a sample: a thousand times what most take, and little enough for display drivers.
const MOST_SEGMENTS: u32 = 8192;
/// Places of a lane that is alone: all that paths take, those without end in water without absorption included.
const AMPLE_SLOTS: u32 = 1 << 14;

/// What a lane's scratch memory has room for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// The vertices of a bridge and of the walk before it, or a stack of walks.
    pub(crate) slots: u32,
    /// Samples that wait for their daylight walks.
    pub(crate) held: u32,
    /// Segments of the daylight walks of a sample.
    pub(crate) most_segments: u32,
}

impl Room {
    /// What `scene` needs, for `held` samples.
    pub(crate) fn of(scene: &Prepared, record: &Scene, held: u32) -> Self {
        let (least, held) = if scene.needs.ambient() {
            (AMBIENT_SLOTS, held)
        } else {
            (3, 0)
        };
        Self {
            slots: (record.largest_order + 2).max(least),
            held,
            most_segments: MOST_SEGMENTS,
        }
    }

    /// With more room, so that no path is cut.
    pub(crate) fn ample(self) -> Self {
        Self {
            slots: self.slots.max(AMPLE_SLOTS),
            most_segments: u32::MAX,
            ..self
        }
    }

    /// Rows of four words.
    pub(crate) fn rows(self) -> u32 {
        SLOT_ROWS * self.slots + HELD_ROWS * self.held
    }
}

/// Override constants: what the scene can reach.
pub(crate) fn switches(scene: &Prepared, record: &Scene) -> Vec<(&'static str, f64)> {
    let needs = &scene.needs;
    [
        ("HAS_MEDIUM", needs.medium),
        ("HAS_SCATTERING", needs.scattering),
        ("HAS_SURFACE", needs.boundary),
        ("HAS_REFRACTION", needs.refraction),
        ("HAS_QUADS", record.quad_count > 0),
        ("HAS_TRIANGLES", record.node_count > 0),
        ("HAS_TEXTURES", needs.textures),
        ("HAS_VARIED_REFLECTANCE", needs.varied_reflectance),
        ("HAS_GEOMETRY_IN_AIR", needs.geometry_in_air),
        (
            "HAS_AIR",
            needs.geometry_in_air || scene.in_air(scene.camera.position_m),
        ),
        ("HAS_SUN", needs.sun),
        ("HAS_SKY", needs.sky),
        ("HAS_DAYLIGHT_FIELD", scene.daylight.is_some()),
        (
            "HAS_DISTORTION",
            scene.camera.distortion.iter().any(|&k| k != 0.0),
        ),
        ("HAS_DISKS", needs.disks),
        ("HAS_FALLOFFS", needs.falloffs),
        ("ONE_LAMP", record.lamp_count == 1),
        ("ONE_QUAD", record.quad_count == 1),
    ]
    .into_iter()
    .map(|(name, needed)| (name, f64::from(u8::from(needed))))
    .collect()
}
