//! Pictures that were kept, and which two of them are compared.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use egui::ColorImage;

use super::Settings;

/// Most pictures that are kept.
pub const MOST_KEPT: usize = 8;

/// A picture that was kept.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// What no other has.
    pub id: u64,
    /// What was set: scene, layer, samples and time.
    pub name: String,
    /// The picture as it was shown.
    pub image: Arc<ColorImage>,
    /// The settings that it shows.
    pub settings: Settings,
    /// Which of the scenes that were opened it shows.
    opening: u64,
    /// Whether its colours are counts, not false ones.
    pub has_counts: bool,
}

impl Snapshot {
    /// Whether it shows the scene that was opened as that one.
    pub fn is_of(&self, opening: u64) -> bool {
        self.opening == opening
    }
}

/// What a picture that is kept shows.
#[derive(Clone, Debug)]
pub struct Shows {
    /// What was set: scene, layer, samples and time.
    pub name: String,
    /// The picture as it was shown.
    pub image: Arc<ColorImage>,
    /// Whether its colours are counts, not false ones.
    pub has_counts: bool,
    /// The settings that it shows.
    pub settings: Settings,
}

/// The pictures that were kept, the oldest first.
#[derive(Clone, Debug, Default)]
pub struct Snapshots {
    kept: VecDeque<Snapshot>,
    made: u64,
}

/// What is on a side of the wiper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// The picture as it is.
    #[default]
    Live,
    /// A picture that was kept.
    Kept(u64),
}

/// Two pictures beside each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Whether two pictures are shown.
    pub on: bool,
    /// Left of the wiper and right of it.
    pub sides: [Side; 2],
    /// Place of the wiper in what is seen of the picture, in [0, 1] from its left edge.
    pub wiper: f64,
}

impl Default for Comparison {
    fn default() -> Self {
        Self {
            on: false,
            sides: [Side::Live; 2],
            wiper: 0.5,
        }
    }
}

impl Snapshots {
    /// The pictures, the oldest first.
    pub fn all(&self) -> impl ExactSizeIterator<Item = &Snapshot> {
        self.kept.iter()
    }

    /// The picture of a side; `None` for the live one.
    pub fn of(&self, side: Side) -> Option<&Snapshot> {
        self.kept.iter().find(|kept| side == Side::Kept(kept.id))
    }

    /// Keeps a picture of the scene that was opened as that one; returns its side and the name of the oldest, where that had to leave.
    pub fn keep(&mut self, shows: Shows, opening: u64) -> (Side, Option<String>) {
        let left = match self.kept.len() < MOST_KEPT {
            true => None,
            false => self.kept.pop_front().map(|oldest| oldest.name),
        };
        self.made += 1;
        self.kept.push_back(Snapshot {
            id: self.made,
            name: format!("{}  {}", self.made, shows.name),
            image: shows.image,
            settings: shows.settings,
            opening,
            has_counts: shows.has_counts,
        });
        (Side::Kept(self.made), left)
    }

    /// Lets a picture go.
    pub fn remove(&mut self, id: u64) {
        self.kept.retain(|kept| kept.id != id);
    }
}

impl Comparison {
    /// Turns to a picture that was just kept, and to the live one where a side has left.
    pub fn follow(&mut self, kept: &Snapshots, newest: Side) {
        for side in &mut self.sides {
            if kept.of(*side).is_none() {
                *side = Side::Live;
            }
        }
        if self.sides == [Side::Live; 2] {
            self.sides[0] = newest;
        }
    }
}

/// A time of day in UTC, to the second.
pub fn time_of_day(now: SystemTime) -> String {
    let seconds = now.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs() % 86_400;
    let (hours, minutes) = (seconds / 3600, seconds / 60 % 60);
    format!("{hours:02}:{minutes:02}:{:02} UTC", seconds % 60)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::OpenScene;
    use super::*;

    #[test]
    fn the_oldest_leaves_and_a_side_without_a_picture_is_live() {
        let (_, settings) = OpenScene::fallback().expect("valid");
        let mut snapshots = Snapshots::default();
        let mut comparison = Comparison::default();
        let image = Arc::new(ColorImage::default());
        for i in 1..=MOST_KEPT as u64 + 1 {
            let shows = Shows {
                name: format!("picture {i}"),
                image: Arc::clone(&image),
                has_counts: true,
                settings: settings.clone(),
            };
            let (side, left) = snapshots.keep(shows, 1);
            comparison.follow(&snapshots, side);
            assert_eq!(side, Side::Kept(i));
            assert_eq!(left.is_some(), i > MOST_KEPT as u64, "{left:?}");
        }
        assert_eq!(snapshots.all().len(), MOST_KEPT);
        assert!(snapshots.all().all(|kept| kept.is_of(1)));
        assert!(!snapshots.all().any(|kept| kept.is_of(2)));
        // The first was on the left and has gone; the newest is there now.
        let newest = Side::Kept(MOST_KEPT as u64 + 1);
        assert_eq!(comparison.sides, [newest, Side::Live]);
        snapshots.remove(MOST_KEPT as u64 + 1);
        comparison.follow(&snapshots, Side::Live);
        assert_eq!(comparison.sides, [Side::Live; 2]);
    }

    #[test]
    fn times_are_those_of_the_day() {
        let at = UNIX_EPOCH + Duration::from_secs(3 * 86_400 + 4 * 3600 + 5 * 60 + 6);
        assert_eq!(time_of_day(at), "04:05:06 UTC");
    }
}
