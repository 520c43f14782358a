//! What a flight is worth: features, inliers, coverage, regret, steadiness, time.

use super::config::OperationConfig;
use super::flight::Step;
use super::track::footprint_m;

/// Edge of the squares that coverage is counted in, m.
const CELL_M: f64 = 0.025;

/// Averages over one flight.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightMeasure {
    /// Features per view.
    pub features: f64,
    /// Matches per pair of views.
    pub matches: f64,
    /// Inliers per pair of views.
    pub inliers: f64,
    /// Inliers over features of the first view, mean over pairs.
    pub inlier_ratio: f64,
    /// The same with the inliers that agree with the true motion.
    pub true_inlier_ratio: f64,
    /// Area covered, m².
    pub coverage_m2: f64,
    /// Relative regret in the objective of every preset, mean over views.
    pub regret: Vec<f64>,
    /// Change of distance between views of a leg, m.
    pub distance_change_m: f64,
    /// Change of lamp level between views of a leg, percent.
    pub light_change_pct: f64,
    /// Length of the path, m.
    pub path_m: f64,
    /// Time of the survey at the set speed, s.
    pub time_s: f64,
    /// Mean distance, m.
    pub distance_m: f64,
    /// Mean lamp level, percent.
    pub light_pct: f64,
}

impl FlightMeasure {
    /// Measures a flight.
    pub fn of(config: &OperationConfig, steps: &[Step]) -> Self {
        let pairs: Vec<_> = steps.iter().filter_map(|s| s.pair.as_ref()).collect();
        let of_pairs = |value: &dyn Fn(&crate::vision::PairMeasure) -> f64| {
            mean(pairs.iter().map(|p| value(p)))
        };
        let of_steps = |value: &dyn Fn(&Step) -> f64| mean(steps.iter().map(value));
        let within_leg = |value: &dyn Fn(&Step, &Step) -> f64| {
            let pairs = steps
                .windows(2)
                .filter(|w| w[0].place.leg == w[1].place.leg);
            mean(pairs.map(|w| value(&w[0], &w[1])))
        };
        let path_m = path_m(steps);
        let presets = steps.first().map_or(0, |s| s.regret.len());
        Self {
            features: of_steps(&|s| s.features as f64),
            matches: of_pairs(&|p| p.matches as f64),
            inliers: of_pairs(&|p| p.inliers as f64),
            inlier_ratio: of_pairs(&|p| p.inlier_ratio()),
            true_inlier_ratio: of_pairs(&|p| p.true_inliers as f64 / (p.features.max(1)) as f64),
            coverage_m2: coverage_m2(config, steps),
            regret: (0..presets).map(|k| of_steps(&|s| s.regret[k])).collect(),
            distance_change_m: within_leg(&|a, b| {
                (b.chosen.distance_m - a.chosen.distance_m).abs()
            }),
            light_change_pct: within_leg(&|a, b| (b.chosen.light_pct - a.chosen.light_pct).abs()),
            path_m,
            time_s: path_m / config.speed_m_per_s,
            distance_m: of_steps(&|s| s.chosen.distance_m),
            light_pct: of_steps(&|s| s.chosen.light_pct),
        }
    }
}

/// Mean; 0 of nothing.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Mean and standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0).max(1.0) / n.max(1.0)).sqrt())
}

/// Way from view to view: along the leg, down and across to the next one, and to and from the target.
pub fn path_m(steps: &[Step]) -> f64 {
    let way = |w: &[Step]| {
        let along = w[1].along_m - w[0].along_m;
        let down = w[1].depth_m - w[0].depth_m;
        let away = w[1].chosen.distance_m - w[0].chosen.distance_m;
        // On an upright target across is down.
        let across = if w[0].across_m == w[0].depth_m {
            0.0
        } else {
            w[1].across_m - w[0].across_m
        };
        (along * along + down * down + across * across + away * away).sqrt()
    };
    steps.windows(2).map(way).sum()
}

/// Whether enough true inliers tie each view to one of its neighbours.
pub fn usable(config: &OperationConfig, steps: &[Step]) -> Vec<bool> {
    let tied = |i: usize| {
        let pair = steps.get(i).and_then(|s| s.pair.as_ref());
        pair.is_some_and(|p| p.true_inliers >= config.covered_inliers)
    };
    (0..steps.len()).map(|i| tied(i) || tied(i + 1)).collect()
}

/// Area of the target that usable views show, m²; what several views show counts once.
fn coverage_m2(config: &OperationConfig, steps: &[Step]) -> f64 {
    let usable = usable(config, steps);
    let rectangles: Vec<[f64; 4]> = steps
        .iter()
        .zip(&usable)
        .filter(|(_, usable)| **usable)
        .map(|(s, _)| {
            let [width, height] = footprint_m(config, s.view_distance_m);
            [
                s.along_m - 0.5 * width,
                s.along_m + 0.5 * width,
                s.across_m - 0.5 * height,
                s.across_m + 0.5 * height,
            ]
        })
        .collect();
    let bound = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
        rectangles.iter().map(|r| r[k]).fold(start, pick)
    };
    let (left, right) = (
        bound(0, f64::min, f64::INFINITY),
        bound(1, f64::max, f64::NEG_INFINITY),
    );
    let (top, bottom) = (
        bound(2, f64::min, f64::INFINITY),
        bound(3, f64::max, f64::NEG_INFINITY),
    );
    if !(right > left && bottom > top) {
        return 0.0;
    }
    let cells = |from: f64, to: f64| ((to - from) / CELL_M).ceil() as usize;
    let mut covered = 0_usize;
    for row in 0..cells(top, bottom) {
        let y = top + CELL_M * (row as f64 + 0.5);
        let on_row: Vec<_> = rectangles
            .iter()
            .filter(|r| r[2] <= y && y < r[3])
            .collect();
        covered += (0..cells(left, right))
            .filter(|column| {
                let x = left + CELL_M * (*column as f64 + 0.5);
                on_row.iter().any(|r| r[0] <= x && x < r[1])
            })
            .count();
    }
    covered as f64 * CELL_M * CELL_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operation::track::Place;
    use crate::vision::PairMeasure;
    use uw_guidance::features::Candidate;

    fn step(leg: usize, along_m: f64, distance_m: f64, true_inliers: Option<usize>) -> Step {
        Step {
            place: Place { leg, station: 0 },
            depth_m: 1.0 + 2.0 * leg as f64,
            along_m,
            across_m: 1.0 + 2.0 * leg as f64,
            chosen: Candidate {
                distance_m,
                light_pct: 10.0 * distance_m,
            },
            view_distance_m: distance_m,
            features: 100,
            pair: true_inliers.map(|n| PairMeasure {
                features: 100,
                matches: n + 10,
                inliers: n + 1,
                true_inliers: n,
                homography: None,
            }),
            regret: vec![0.1, 0.3],
            contrast: 5.0,
        }
    }

    #[test]
    fn measures_follow_from_the_steps() {
        let config = OperationConfig::default();
        let steps = [
            step(0, 0.0, 1.0, None),
            step(0, 0.5, 1.5, Some(40)),
            step(1, 0.5, 1.5, None),
            step(1, 0.0, 1.5, Some(20)),
        ];
        let measure = FlightMeasure::of(&config, &steps);
        assert!((measure.inlier_ratio - 0.31).abs() < 1e-12);
        assert!((measure.true_inlier_ratio - 0.30).abs() < 1e-12);
        assert!((measure.distance_change_m - 0.25).abs() < 1e-12);
        assert!((measure.light_change_pct - 2.5).abs() < 1e-12);
        assert_eq!(measure.regret, [0.1, 0.3]);
        let path = 0.5f64.hypot(0.5) + 2.0 + 0.5;
        assert!((measure.path_m - path).abs() < 1e-12);
        assert!((measure.time_s - path / 0.25).abs() < 1e-12);
    }

    #[test]
    fn overlap_counts_once_and_views_without_features_not_at_all() {
        let config = OperationConfig::default();
        let [width, height] = footprint_m(&config, 1.0);
        let two = [step(0, 0.0, 1.0, None), step(0, 0.5, 1.0, Some(40))];
        let area = coverage_m2(&config, &two);
        assert!(
            (area / ((width + 0.5) * height) - 1.0).abs() < 0.04,
            "{area}"
        );
        let lost = [step(0, 0.0, 1.0, None), step(0, 0.5, 1.0, Some(3))];
        assert_eq!(coverage_m2(&config, &lost), 0.0);
        let legs = [
            two.as_slice(),
            &[step(1, 0.0, 1.0, None), step(1, 0.5, 1.0, Some(40))],
        ]
        .concat();
        assert!((coverage_m2(&config, &legs) / (2.0 * area) - 1.0).abs() < 0.04);
    }

    #[test]
    fn the_standard_error_is_that_of_the_mean() {
        let (mean, error) = mean_and_error(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(mean, 2.5);
        assert!((error - (5.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
    }
}
