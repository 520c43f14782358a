//! What of the picture is looked at closely.

use glam::DVec2;

use super::snapshots::{Comparison, Snapshots};
use super::zoom::Zoom;

/// Most pixels whose values are pinned.
pub const MOST_PINS: usize = 8;

/// What of the picture is looked at closely.
#[derive(Clone, Debug, Default)]
pub struct Inspection {
    /// Which part of it is seen.
    pub zoom: Zoom,
    /// Whether clipped and black pixels are marked.
    pub marks: bool,
    /// Pinned places, in [0, 1] from the upper left corner.
    pub pins: Vec<DVec2>,
    /// Pictures that were kept.
    pub snapshots: Snapshots,
    /// Which of them are compared.
    pub comparison: Comparison,
    /// Whether the next whole picture is to be kept.
    pub keeps_next: bool,
}

impl Inspection {
    /// Pins a place of the picture; `false` where there are as many as there may be.
    pub fn pin(&mut self, at: DVec2) -> bool {
        let is_free = self.pins.len() < MOST_PINS;
        if is_free {
            self.pins.push(at);
        }
        is_free
    }

    /// Leaves what is of one scene, for another.
    pub fn forget_places(&mut self) {
        self.pins.clear();
        self.zoom = Zoom::default();
    }
}
