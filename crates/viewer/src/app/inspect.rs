//! What is looked at closely: pictures that are kept, pixels that are pinned.

use std::sync::Arc;
use std::time::SystemTime;

use super::{Tab, Viewer};
use crate::model::FalseColour;
use crate::model::inspection::MOST_PINS;
use crate::model::snapshots::{Shows, time_of_day};
use crate::worker::Frame;

impl Viewer {
    /// Keeps the picture, once it is whole and shows what is set.
    pub fn keep_picture(&mut self) {
        self.inspection.keeps_next = true;
    }

    /// Whether the picture is looked at in a way that needs it on the host.
    pub(super) fn needs_pixels(&self) -> bool {
        let inspection = &self.inspection;
        inspection.keeps_next || inspection.marks || self.tab == Tab::Inspect
    }

    /// Keeps the picture where that is wanted and it is whole.
    pub(super) fn poll_keeping(&mut self) {
        let shows_all = |frame: &&Arc<Frame>| {
            frame.coarseness == 1 && frame.view_revision == self.view_revision
        };
        let whole = self.frame.as_ref().filter(shows_all);
        let wanted = self.inspection.keeps_next && self.is_current();
        let Some(frame) = whole.filter(|_| wanted) else {
            return;
        };
        let Some(image) = frame.shown.image() else {
            return;
        };
        let shows = Shows {
            name: self.snapshot_name(frame),
            image: Arc::new(image.clone()),
            has_counts: frame.shown.legend.is_none(),
            settings: self.settings.clone(),
        };
        let inspection = &mut self.inspection;
        inspection.keeps_next = false;
        let (side, left) = inspection.snapshots.keep(shows, self.opening);
        let snapshots = &inspection.snapshots;
        inspection.comparison.follow(snapshots, side);
        if let Some(kept) = snapshots.of(side) {
            self.toasts.info(format!("Kept {}", kept.name));
        }
        if let Some(left) = left {
            self.toasts.warn(format!("{left} is not kept any more"));
        }
    }

    /// What was set for a picture: scene, layer, samples and time.
    fn snapshot_name(&self, frame: &Frame) -> String {
        let layer = self.layer_name();
        let colours = FalseColour::ALL.iter();
        let mut colours = colours.filter(|(known, _)| *known != FalseColour::Off);
        let colours = colours.find(|(known, _)| *known == self.display.false_colour);
        let denoised = frame.denoised.map(|_| "denoised");
        let layer = Some(layer.as_str()).filter(|name| !name.is_empty());
        let words = [layer, colours.map(|(_, name)| *name), denoised];
        let words: String = words
            .iter()
            .flatten()
            .map(|word| format!(" {word}"))
            .collect();
        let samples = match frame.samples {
            1 => "1 sample".to_owned(),
            more => format!("{more} samples"),
        };
        let time = time_of_day(SystemTime::now());
        format!("{}{words}, {samples}, {time}", self.open.title)
    }

    /// Pins the pixel under the pointer.
    pub(crate) fn pin(&mut self) {
        if let Some(at) = self.picture.probe()
            && !self.inspection.pin(at)
        {
            let message = format!("There are at most {MOST_PINS} pins: remove one");
            self.toasts.warn(message);
        }
    }
}
