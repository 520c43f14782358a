//! What the network was trained on, compared with what it is asked.

use super::Model;
use crate::features::{Candidate, FeatureValue, Situation};
use crate::reason::Reason;

impl Model {
    /// Smallest and largest value of an input in training, in the input's unit, where the file states them.
    pub fn trained_range(&self, input: &str) -> Option<[f64; 2]> {
        let at = self.inputs.iter().position(|known| known.name == input)?;
        Some(self.card.ranges.as_ref()?[at])
    }

    /// The trained range of an input by its place, widened by a share of itself at both ends.
    pub(crate) fn widened(&self, input: usize, margin: f64) -> Option<[f64; 2]> {
        let [min, max] = self.card.ranges.as_ref()?[input];
        let beyond = margin * (max - min);
        Some([min - beyond, max + beyond])
    }

    /// The first input of a situation that is further outside the trained range than a share of it.
    pub(crate) fn outside(&self, situation: &Situation, margin: f64) -> Option<Reason> {
        for (k, input) in self.inputs.iter().enumerate() {
            let FeatureValue::Fixed(of) = input.value else {
                continue;
            };
            let (trained, [low, high]) =
                (self.trained_range(input.name)?, self.widened(k, margin)?);
            let value = of(situation);
            if !(low..=high).contains(&value) {
                return Some(Reason::OutsideTraining {
                    input: input.name.to_owned(),
                    unit: input.unit,
                    value,
                    trained,
                    margin,
                });
            }
        }
        None
    }

    /// Distances in m and lamp levels in percent that the network has seen as candidates, from a place; `None` where
    /// the file does not say. Where it has learnt changes, it has seen as candidates the places it has started from.
    pub(crate) fn trained_candidates(
        &self,
        current: &Candidate,
    ) -> (Option<[f64; 2]>, Option<[f64; 2]>) {
        let range = |target: &str, start: &str, change: &str, here: f64| {
            self.trained_range(target).or_else(|| {
                let ([low, high], [down, up]) =
                    (self.trained_range(start)?, self.trained_range(change)?);
                Some([low.max(here + down), high.min(here + up)])
            })
        };
        (
            range(
                "target_distance",
                "distance",
                "delta_distance",
                current.distance_m,
            ),
            range("target_light", "light", "delta_light", current.light_pct),
        )
    }

    /// The first of the candidates that lies further outside the trained ones than a share of their range.
    pub(crate) fn outside_candidates(
        &self,
        current: &Candidate,
        candidates: &[Candidate],
        margin: f64,
    ) -> Option<Reason> {
        let (distances, lights) = self.trained_candidates(current);
        let outside = |k: usize, of: usize, value: f64, unit, trained: Option<[f64; 2]>| {
            let trained = trained?;
            let beyond = margin * (trained[1] - trained[0]);
            let known = (trained[0] - beyond..=trained[1] + beyond).contains(&value);
            (!known).then(|| Reason::OutsideTraining {
                input: format!("candidates[{k}][{of}]"),
                unit,
                value,
                trained,
                margin,
            })
        };
        candidates.iter().enumerate().find_map(|(k, candidate)| {
            outside(k, 0, candidate.distance_m, "m", distances)
                .or_else(|| outside(k, 1, candidate.light_pct, "percent", lights))
        })
    }
}
