//! The true score of any distance and lamp level at one place, from the rendered views there.

use std::sync::Arc;

use uw_guidance::features::Candidate;
use uw_guidance::objective::Criterion;
use uw_guidance::optimise::{Bounds, Ridges, maximise};

use super::view::View;

/// The views at one place, by increasing distance.
pub struct Truth {
    distances_m: Vec<f64>,
    views: Vec<Arc<View>>,
}

impl Truth {
    /// Views at their distances, m, increasing and as many as views; at least one.
    pub fn new(distances_m: Vec<f64>, views: Vec<Arc<View>>) -> Self {
        Self { distances_m, views }
    }

    /// True contrast per channel, 8-bit counts: geometric between rendered distances, because contrast falls about
    /// exponentially with distance; linear between lamp levels.
    pub fn contrast(&self, candidate: &Candidate) -> [f64; 3] {
        let last = self.distances_m.len() - 1;
        let after = self
            .distances_m
            .partition_point(|&d| d <= candidate.distance_m);
        let near = after.clamp(1, last.max(1)) - 1;
        let far = (near + 1).min(last);
        let (d0, d1) = (self.distances_m[near], self.distances_m[far]);
        let share = if d1 > d0 {
            ((candidate.distance_m - d0) / (d1 - d0)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let low = self.views[near].contrast(candidate.light_pct);
        let high = self.views[far].contrast(candidate.light_pct);
        std::array::from_fn(|k| {
            if low[k] > 0.0 && high[k] > 0.0 {
                low[k] * (high[k] / low[k]).powf(share)
            } else {
                (1.0 - share) * low[k] + share * high[k]
            }
        })
    }

    /// The true score.
    pub fn score(&self, criterion: &Criterion, candidate: &Candidate) -> f64 {
        criterion.score(self.contrast(candidate), candidate.distance_m)
    }

    /// The candidate of the highest true score and that score; `None` when no score is a number.
    pub fn best(
        &self,
        criterion: &Criterion,
        light_pct: [f64; 2],
        current: Candidate,
    ) -> Option<(Candidate, f64)> {
        let distance_m = [
            self.distances_m[0],
            self.distances_m[self.distances_m.len() - 1],
        ];
        let peaks = criterion.peaks_m(distance_m[0], distance_m[1]);
        let bounds = Bounds {
            distance_m,
            light_pct,
        };
        let ridges = Ridges {
            distances_m: &peaks,
            width_m: criterion.width_m(),
            current,
        };
        let found = maximise(|c| self.score(criterion, c), &bounds, &ridges)?;
        Some((found.candidate, found.score))
    }
}

/// What the score `got` lacks to the `best`, over the best.
pub fn relative_regret(best: f64, got: f64) -> f64 {
    (best - got) / best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operation::view::ViewRecord;
    use uw_calib::{ContrastSample, DepthSample, Profile, Source};
    use uw_guidance::objective::Objective;
    use uw_render::image::Picture;

    /// Views at 1, 2 and 3 m whose contrast halves per metre and grows with the lamps up to 50 %.
    fn truth() -> Truth {
        let view = |distance_m: f64| {
            let at = |i: u32| {
                let light_pct = 10.0 * f64::from(i);
                [(16.0 + light_pct.min(100.0 - light_pct)) * 0.5f64.powf(distance_m); 3]
            };
            Arc::new(View::of_record(
                Picture::black(1, 1),
                ViewRecord {
                    contrast: (0..11).map(at).collect(),
                    samples: [1, 1],
                    cpu_s: 0.0,
                },
            ))
        };
        let distances_m = vec![1.0, 2.0, 3.0];
        let views = distances_m.iter().map(|&d| view(d)).collect();
        Truth::new(distances_m, views)
    }

    fn at(distance_m: f64, light_pct: f64) -> Candidate {
        Candidate {
            distance_m,
            light_pct,
        }
    }

    #[test]
    fn regret_is_relative_to_the_best() {
        assert!((relative_regret(0.5, 0.4) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn contrast_between_views_is_geometric_in_distance_and_linear_in_light() {
        let contrast = |d, l| truth().contrast(&at(d, l))[0];
        assert!((contrast(1.5, 0.0) - 16.0 * 0.5f64.powf(1.5)).abs() < 1e-12);
        assert!((contrast(3.0, 25.0) - 41.0 / 8.0).abs() < 1e-12);
        // Beyond the views the nearest one counts.
        assert_eq!(contrast(0.5, 0.0), contrast(1.0, 0.0));
        assert_eq!(contrast(9.0, 0.0), contrast(3.0, 0.0));
    }

    #[test]
    fn the_best_candidate_is_found() {
        let off = |distance_m| ContrastSample {
            distance_m,
            k_c: [10.0; 3],
        };
        let depth = |depth_m| DepthSample {
            depth_m,
            k_z: [0.8; 3],
        };
        let source = Source {
            made_by: "test".into(),
            images: 0,
            note: None,
        };
        let contrasts = vec![off(1.0), off(3.0)];
        let profile = Profile::new(
            vec![depth(0.5), depth(6.0)],
            contrasts.clone(),
            contrasts,
            source,
        )
        .expect("valid");
        // Contrast alone: the nearest view at half light.
        let objective = Objective {
            lambda_d: 0.0,
            ..Objective::release()
        };
        let criterion = Criterion::new(&objective, &profile, 2.0, [0.8; 3]);
        let (best, score) = truth()
            .best(&criterion, [0.0, 100.0], at(2.0, 10.0))
            .expect("found");
        assert!((best.distance_m - 1.0).abs() < 1e-3 && (best.light_pct - 50.0).abs() < 0.1);
        assert!((score - 0.65 * 33.0 / 15.0).abs() < 1e-3);
        assert!(truth().score(&criterion, &at(2.0, 50.0)) < score);
    }
}
