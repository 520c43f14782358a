//! The candidate with the best score.
//!
//! The score has several local optima: the distance term is a ridge across all lamp levels, as narrow as
//! some 0.01 m in dark water, and the network has slopes of its own. The search therefore looks at a coarse
//! grid and along the ridges first, runs Nelder-Mead from the best few places found, and polishes the best
//! result. It is deterministic.

use crate::features::Candidate;
use crate::nelder_mead::{Search, minimise};

/// Distances of the coarse grid.
const GRID_DISTANCES: usize = 17;
/// Lamp levels of the coarse grid and along ridges.
const GRID_LIGHTS: usize = 9;
/// Places from which Nelder-Mead starts.
const STARTS: usize = 5;

/// Smallest and largest values of candidates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Distance, m, smallest first.
    pub distance_m: [f64; 2],
    /// Lamp level, percent, smallest first.
    pub light_pct: [f64; 2],
}

impl Bounds {
    /// Whether the candidate lies inside, the bounds included.
    pub fn hold(&self, candidate: &Candidate) -> bool {
        let inside = |[low, high]: [f64; 2], x: f64| (low..=high).contains(&x);
        inside(self.distance_m, candidate.distance_m) && inside(self.light_pct, candidate.light_pct)
    }

    /// The candidate at coordinates in [0, 1].
    fn at(&self, [u, v]: [f64; 2]) -> Candidate {
        let between = |[low, high]: [f64; 2], t: f64| (low + t * (high - low)).clamp(low, high);
        Candidate {
            distance_m: between(self.distance_m, u),
            light_pct: between(self.light_pct, v),
        }
    }

    /// The coordinates in [0, 1] of a candidate; 0 where the bounds coincide.
    fn coordinates(&self, candidate: &Candidate) -> [f64; 2] {
        let part = |[low, high]: [f64; 2], x: f64| {
            if high > low {
                ((x - low) / (high - low)).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        [
            part(self.distance_m, candidate.distance_m),
            part(self.light_pct, candidate.light_pct),
        ]
    }
}

/// Hints where narrow optima may lie.
#[derive(Clone, Copy, Debug)]
pub struct Ridges<'a> {
    /// Distances of the ridges, m.
    pub distances_m: &'a [f64],
    /// Their width (standard deviation), m.
    pub width_m: f64,
    /// A candidate to look at in any case when it is inside the bounds, such as the current one.
    pub current: Candidate,
}

/// The best candidate found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum {
    /// The candidate.
    pub candidate: Candidate,
    /// Its score.
    pub score: f64,
    /// Scores evaluated.
    pub evaluations: usize,
}

#[derive(Clone, Copy)]
struct Start {
    at: [f64; 2],
    cost: f64,
}

/// Looks for the candidate of the highest score inside the bounds; `None` when no score is a number.
pub fn maximise(
    mut score: impl FnMut(&Candidate) -> f64,
    bounds: &Bounds,
    ridges: &Ridges,
) -> Option<Optimum> {
    let mut evaluations = 0;
    let mut cost = |at: &[f64; 2]| {
        evaluations += 1;
        -score(&bounds.at(*at))
    };
    let mut starts: Vec<Start> = seeds(bounds, ridges)
        .into_iter()
        .map(|at| Start {
            at,
            cost: cost(&at),
        })
        .filter(|start| start.cost.is_finite())
        .collect();
    starts.sort_by(|x, y| x.cost.total_cmp(&y.cost));
    let steps = first_steps(bounds, ridges.width_m);
    let mut best = *starts.first()?;
    for start in distinct(&starts) {
        best = descend(&mut cost, best, start.at, &coarse(steps));
    }
    best = descend(&mut cost, best, best.at, &fine(steps));
    Some(Optimum {
        candidate: bounds.at(best.at),
        score: -best.cost,
        evaluations,
    })
}

/// The grid, the ridges and the current candidate, in coordinates.
fn seeds(bounds: &Bounds, ridges: &Ridges) -> Vec<[f64; 2]> {
    let part = |k: usize, of: usize| k as f64 / (of - 1) as f64;
    let mut seeds = Vec::new();
    let mut across = |u: f64| {
        seeds.extend((0..GRID_LIGHTS).map(|k| [u, part(k, GRID_LIGHTS)]));
    };
    for k in 0..GRID_DISTANCES {
        across(part(k, GRID_DISTANCES));
    }
    for &distance_m in ridges.distances_m {
        let [u, _] = bounds.coordinates(&Candidate {
            distance_m,
            light_pct: 0.0,
        });
        across(u);
    }
    if bounds.hold(&ridges.current) {
        seeds.push(bounds.coordinates(&ridges.current));
    }
    seeds
}

/// Half a grid step, and no more than half the width of a ridge in distance.
fn first_steps(bounds: &Bounds, width_m: f64) -> [f64; 2] {
    let [near, far] = bounds.distance_m;
    let of_grid = 0.5 / (GRID_DISTANCES - 1) as f64;
    let of_ridge = 0.5 * width_m / (far - near);
    let distance = if of_ridge > 0.0 {
        of_grid.min(of_ridge)
    } else {
        of_grid
    };
    [distance, 0.5 / (GRID_LIGHTS - 1) as f64]
}

/// The best places that are not neighbours of a better one.
fn distinct(starts: &[Start]) -> Vec<Start> {
    let mut kept: Vec<Start> = Vec::with_capacity(STARTS);
    for start in starts {
        let neighbours = |other: &Start| {
            (start.at[0] - other.at[0]).abs() < 1.01 / (GRID_DISTANCES - 1) as f64
                && (start.at[1] - other.at[1]).abs() < 1.01 / (GRID_LIGHTS - 1) as f64
        };
        if !kept.iter().any(neighbours) {
            kept.push(*start);
        }
        if kept.len() == STARTS {
            break;
        }
    }
    kept
}

/// Enough to tell which start leads to the best optimum.
fn coarse(step: [f64; 2]) -> Search<2> {
    Search {
        lower: [0.0; 2],
        upper: [1.0; 2],
        step,
        cost_tolerance: 1e-4,
        size_tolerance: 1e-2,
        max_evaluations: 60,
    }
}

/// A score has a size of about 1, so 1e-7 is far below what matters.
fn fine(step: [f64; 2]) -> Search<2> {
    Search {
        step: step.map(|s| 0.25 * s),
        cost_tolerance: 1e-7,
        size_tolerance: 1e-4,
        max_evaluations: 120,
        ..coarse(step)
    }
}

fn descend(
    cost: &mut impl FnMut(&[f64; 2]) -> f64,
    best: Start,
    start: [f64; 2],
    search: &Search<2>,
) -> Start {
    let found = minimise(cost, start, search);
    if found.cost < best.cost {
        Start {
            at: found.point,
            cost: found.cost,
        }
    } else {
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds {
        distance_m: [0.5, 3.0],
        light_pct: [0.0, 100.0],
    };
    const NO_RIDGE: Ridges<'static> = Ridges {
        distances_m: &[],
        width_m: 0.0,
        current: Candidate {
            distance_m: 1.0,
            light_pct: 50.0,
        },
    };

    #[test]
    fn finds_the_higher_of_two_hills() {
        let hills = |c: &Candidate| {
            let hill = |d: f64, l: f64| {
                (-((c.distance_m - d) / 0.2).powi(2) - ((c.light_pct - l) / 15.0).powi(2)).exp()
            };
            0.9 * hill(0.8, 20.0) + hill(2.6, 85.0)
        };
        let found = maximise(hills, &BOUNDS, &NO_RIDGE).unwrap();
        assert!((found.candidate.distance_m - 2.6).abs() < 1e-3, "{found:?}");
        assert!((found.candidate.light_pct - 85.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn finds_a_ridge_narrower_than_the_grid_when_told_where_it_is() {
        let width_m = 0.014;
        let ridge = |c: &Candidate| {
            (-0.5 * ((c.distance_m - 1.234) / width_m).powi(2)).exp() + c.light_pct / 1e3
        };
        let ridges = Ridges {
            distances_m: &[1.234],
            width_m,
            ..NO_RIDGE
        };
        let found = maximise(ridge, &BOUNDS, &ridges).unwrap();
        assert!((found.score - 1.1).abs() < 1e-6, "{found:?}");
        assert!(
            (found.candidate.light_pct - 100.0).abs() < 1e-3,
            "{found:?}"
        );
    }

    #[test]
    fn coinciding_bounds_are_kept() {
        let bounds = Bounds {
            distance_m: [1.5, 1.5],
            light_pct: [0.0, 100.0],
        };
        let found = maximise(|c| -(c.light_pct - 30.0).abs(), &bounds, &NO_RIDGE).unwrap();
        assert_eq!(found.candidate.distance_m, 1.5);
        assert!((found.candidate.light_pct - 30.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn no_number_no_optimum() {
        assert_eq!(maximise(|_| f64::NAN, &BOUNDS, &NO_RIDGE), None);
    }

    #[test]
    fn the_current_candidate_is_never_beaten_by_the_answer() {
        // A spike that only its own coordinates reveal.
        let current = Candidate {
            distance_m: 1.777,
            light_pct: 43.21,
        };
        let spike = |c: &Candidate| f64::from(u8::from((c.distance_m - 1.777).abs() < 1e-9));
        let found = maximise(
            spike,
            &BOUNDS,
            &Ridges {
                current,
                ..NO_RIDGE
            },
        )
        .unwrap();
        assert_eq!(found.score, 1.0);
    }
}
