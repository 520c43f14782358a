//! Pictures of a routine whose numbers are doubtful: told together, as a far target is often dark in every picture.

use std::path::Path;

use crate::detail::{Detail, MAX_SATURATED, channel_names};
use crate::manifest::Row;

/// Pictures whose numbers are doubtful, by name, line and channels.
#[derive(Debug, Default)]
pub(crate) struct Doubts {
    at_floor: Vec<String>,
    saturated: Vec<String>,
    overstated: Vec<String>,
}

impl Doubts {
    /// A picture that looks up: its mean counts.
    pub(crate) fn look_up(&mut self, row: &Row, detail: Option<&Detail>) {
        let saturated = detail.map(|detail| detail.saturated_beyond(MAX_SATURATED));
        self.saturated.extend(named(row, saturated));
    }

    /// A picture of the target.
    pub(crate) fn target(&mut self, row: &Row, detail: Option<&Detail>) {
        self.look_up(row, detail);
        let overstated = detail.map(Detail::noise_overstated);
        let at_floor = detail.map(Detail::without_detail);
        self.at_floor.extend(named(row, at_floor));
        self.overstated.extend(named(row, overstated));
    }

    /// A sentence for each kind of doubt there is.
    pub(crate) fn told(&self, manifest: &Path) -> Vec<String> {
        let of = [
            (
                &self.at_floor,
                "K_c is at the noise floor, no detail is told from noise; take these pictures nearer, with more light or a longer \
                 exposure, or leave them out",
            ),
            (
                &self.saturated,
                "more than 1 % of the pixels are at full scale, K_c and K_z are too small there; expose all pictures of a kind less",
            ),
            (
                &self.overstated,
                "the pictures have less noise than is stated; check noise and encoding",
            ),
        ];
        let told = of.into_iter().filter(|(pictures, _)| !pictures.is_empty());
        told.map(|(pictures, what)| {
            format!("{}: {what}: {}", manifest.display(), pictures.join("; "))
        })
        .collect()
    }
}

/// "far.png (line 4; R, G)".
fn named(row: &Row, channels: Option<[bool; 3]>) -> Option<String> {
    let channels = channel_names(channels?)?;
    let name = row.image.file_name().map_or_else(
        || row.image.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    );
    Some(format!("{name} (line {}; {channels})", row.line))
}
