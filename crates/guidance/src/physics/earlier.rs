//! What a vehicle saw on its way, for the pictures that it takes later.

use super::present::Present;
use super::target::Sight;

/// How long a picture counts, s: by then another target is before the camera.
const COUNTS_S: f64 = 600.0;
/// Of distances whose logarithms differ by less the newer picture is kept.
const SAME_DISTANCE_LOG: f64 = 0.2;

/// The latest pictures of a vehicle, one a distance.
#[derive(Debug, Default)]
pub struct Earlier {
    kept: Vec<Kept>,
}

#[derive(Debug)]
struct Kept {
    sight: Sight,
    taken_s: f64,
}

impl Earlier {
    /// Takes a picture of `taken_s` on any clock that does not go back. One that tells nothing of the target, or comes later than a newer one from the same
    /// distance, is passed over, so that the other counts on.
    pub fn keep(&mut self, present: &Present, taken_s: f64) {
        let sight = present.sight();
        if !sight.tells_any() {
            return;
        }
        let is_near = |kept: &Kept| {
            let apart = (kept.sight.distance_m / sight.distance_m).ln().abs();
            apart <= SAME_DISTANCE_LOG
        };
        if self
            .kept
            .iter()
            .any(|kept| is_near(kept) && kept.taken_s > taken_s)
        {
            return;
        }
        self.kept
            .retain(|kept| taken_s - kept.taken_s <= COUNTS_S && !is_near(kept));
        self.kept.push(Kept {
            sight: sight.clone(),
            taken_s,
        });
    }

    /// What counts of it at `now_s`.
    pub fn sights(&self, now_s: f64) -> Vec<Sight> {
        let counts = |kept: &&Kept| now_s - kept.taken_s <= COUNTS_S;
        let kept = self.kept.iter().filter(counts);
        kept.map(|kept| kept.sight.clone()).collect()
    }
}

#[cfg(test)]
mod tests;
