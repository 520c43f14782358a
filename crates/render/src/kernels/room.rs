//! What a lane needs memory for, and what a kernel need not do for a scene.

use super::layout::{QUEUED_ROWS, QUEUED_ROWS_WITH_ORIGIN, Scene};
use crate::prepare::Prepared;
use crate::scene::{Camera, Lens, PortShape};

/// Rows of four words of a place of the scratch buffer for vertices.
const SLOT_ROWS: u32 = 3;
/// Where the water varies one more: drawn lengths.
const SLOT_ROWS_IN_LAYERS: u32 = 4;
/// Places that the stack of walks that look for daylight needs: 76 walks.
const AMBIENT_SLOTS: u32 = 128;
/// Segments of the daylight walks of a sample: a thousand times what most take, and little enough for display drivers.
const MOST_SEGMENTS: u32 = 8192;
/// Places of a lane that is alone: all that paths take, those without end in water without absorption included.
const AMPLE_SLOTS: u32 = 1 << 14;

/// Nodes of a profile in depth that four steps of a search are enough for; `nodes_above` of the shaders.
const FEW_NODES: u32 = 15;

/// What a lane's scratch memory has room for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// The vertices of a bridge and of the walk before it, or a stack of walks.
    pub(crate) slots: u32,
    /// Rows of four words of a place.
    slot_rows: u32,
    /// Samples that wait for their daylight walks.
    pub(crate) queued: u32,
    /// Rows of four words of one of these.
    queued_rows: u32,
    /// Segments of the daylight walks of a sample.
    pub(crate) most_segments: u32,
}

impl Room {
    /// What `scene` needs, for `queued` samples.
    pub(crate) fn of(scene: &Prepared, record: &Scene, queued: u32) -> Self {
        let (least, queued) = if scene.features.ambient() {
            (AMBIENT_SLOTS, queued)
        } else {
            (3, 0)
        };
        Self {
            slots: (record.largest_order + 2).max(least),
            slot_rows: match scene.layers {
                Some(_) => SLOT_ROWS_IN_LAYERS,
                None => SLOT_ROWS,
            },
            queued,
            queued_rows: match (scene.camera.port, scene.camera.opening) {
                (None, None) => QUEUED_ROWS,
                _ => QUEUED_ROWS_WITH_ORIGIN,
            },
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
        self.slot_rows * self.slots + self.queued_rows * self.queued
    }
}

/// Override constants: what the scene can reach.
pub(crate) fn switches(scene: &Prepared, record: &Scene) -> Vec<(&'static str, f64)> {
    let features = &scene.features;
    let Camera {
        lens,
        port,
        opening,
        ..
    } = &scene.camera;
    [
        ("HAS_MEDIUM", features.medium),
        ("HAS_SCATTERING", features.scattering),
        ("HAS_LAYERS", features.layers),
        ("HAS_PLUMES", record.plume_count > 0),
        (
            "HAS_MANY_NODES",
            record.layer_count.max(record.bridge_node_count) > FEW_NODES,
        ),
        ("HAS_SURFACE", features.boundary),
        ("HAS_REFRACTION", features.refraction),
        ("HAS_QUADS", record.quad_count > 0),
        ("HAS_TRIANGLES", record.node_count > 0),
        ("HAS_TEXTURES", features.textures),
        ("HAS_GLOSS", features.gloss),
        ("HAS_NORMAL_MAPS", features.normal_maps),
        ("HAS_VARIED_REFLECTANCE", features.varied_reflectance),
        ("HAS_GEOMETRY_IN_AIR", features.geometry_in_air),
        ("HAS_AIR_LAMPS", record.air_lamp_count > 0),
        (
            "HAS_AIR",
            features.geometry_in_air || scene.in_air(scene.camera.position_m),
        ),
        ("HAS_SUN", features.sun),
        ("HAS_SKY", features.sky),
        ("HAS_SPECTRUM", features.spectrum),
        ("HAS_DAYLIGHT_FIELD", scene.daylight.is_some()),
        (
            "HAS_DISTORTION",
            matches!(lens, Lens::Perspective(_)) && !lens.is_ideal(),
        ),
        ("HAS_FISHEYE", matches!(lens, Lens::Fisheye(_))),
        ("HAS_PORT", port.is_some()),
        (
            "HAS_DOME",
            port.is_some_and(|port| matches!(port.shape, PortShape::Dome { .. })),
        ),
        ("HAS_OPENING", opening.is_some()),
        ("HAS_DISKS", features.disks),
        ("HAS_FALLOFFS", features.falloffs),
        ("HAS_BEAMS", features.beams),
        ("HAS_GROUPS", record.lamp_group_count > 0),
        (
            "ONE_LAMP",
            (record.lamp_count, record.air_lamp_count) == (1, 0),
        ),
        ("ONE_QUAD", record.quad_count == 1),
    ]
    .into_iter()
    .map(|(name, needed)| (name, f64::from(u8::from(needed))))
    .collect()
}
