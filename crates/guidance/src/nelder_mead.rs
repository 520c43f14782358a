//! The simplex method of Nelder and Mead (1965), inside bounds.
//!
//! Trial points outside the bounds are moved onto them. A cost of NaN counts as infinite, so such points are
//! left behind and never chosen.

/// Reflection, expansion, contraction and shrinking by Nelder and Mead's own coefficients.
const REFLECT: f64 = 1.0;
const EXPAND: f64 = 2.0;
const CONTRACT: f64 = 0.5;
const SHRINK: f64 = 0.5;

/// Where the search may go and when it ends.
#[derive(Clone, Copy, Debug)]
pub struct Search<const N: usize> {
    /// Smallest value per coordinate.
    pub lower: [f64; N],
    /// Largest value per coordinate, not below `lower`.
    pub upper: [f64; N],
    /// Edge of the first simplex per coordinate.
    pub step: [f64; N],
    /// Converged when the costs of the simplex differ by at most this ...
    pub cost_tolerance: f64,
    /// ... and its corners lie at most this far from the best, in every coordinate.
    pub size_tolerance: f64,
    /// Ends after this many evaluations at the latest (a step under way is completed).
    pub max_evaluations: usize,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Both tolerances were met.
    Converged,
    /// The number of evaluations was used up.
    Evaluations,
    /// No corner of the simplex has a finite cost.
    NoFiniteCost,
}

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum<const N: usize> {
    /// Best point evaluated.
    pub point: [f64; N],
    /// Cost there; infinite when no finite cost was met.
    pub cost: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Costs evaluated.
    pub evaluations: usize,
    /// Why the search ended.
    pub stopped: Stopped,
}

#[derive(Clone, Copy)]
struct Corner<const N: usize> {
    point: [f64; N],
    cost: f64,
}

struct Simplex<'a, const N: usize, F> {
    search: &'a Search<N>,
    cost: F,
    evaluations: usize,
    /// N + 1 corners, the best first.
    corners: Vec<Corner<N>>,
}

/// Looks for a point of least cost from `start`.
pub fn minimise<const N: usize>(
    cost: impl FnMut(&[f64; N]) -> f64,
    start: [f64; N],
    search: &Search<N>,
) -> Minimum<N> {
    let mut simplex = Simplex {
        search,
        cost,
        evaluations: 0,
        corners: Vec::with_capacity(N + 1),
    };
    simplex.build(start);
    let mut iterations = 0;
    let stopped = loop {
        simplex.corners.sort_by(|x, y| x.cost.total_cmp(&y.cost));
        if let Some(reason) = simplex.stopped() {
            break reason;
        }
        simplex.step();
        iterations += 1;
    };
    let Corner { point, cost } = simplex.corners[0];
    Minimum {
        point,
        cost,
        iterations,
        evaluations: simplex.evaluations,
        stopped,
    }
}

impl<const N: usize, F: FnMut(&[f64; N]) -> f64> Simplex<'_, N, F> {
    fn build(&mut self, start: [f64; N]) {
        let first = self.evaluate(start);
        self.corners.push(first);
        for k in 0..N {
            let mut point = first.point;
            let ahead = point[k] + self.search.step[k];
            let fits = ahead <= self.search.upper[k];
            point[k] = if fits {
                ahead
            } else {
                point[k] - self.search.step[k]
            };
            let corner = self.evaluate(point);
            self.corners.push(corner);
        }
    }

    fn evaluate(&mut self, point: [f64; N]) -> Corner<N> {
        let (lower, upper) = (&self.search.lower, &self.search.upper);
        let point = std::array::from_fn(|k| point[k].max(lower[k]).min(upper[k]));
        self.evaluations += 1;
        let cost = (self.cost)(&point);
        Corner {
            point,
            cost: if cost.is_nan() { f64::INFINITY } else { cost },
        }
    }

    fn stopped(&self) -> Option<Stopped> {
        let best = &self.corners[0];
        if best.cost == f64::INFINITY {
            return Some(Stopped::NoFiniteCost);
        }
        let spread = self.corners[N].cost - best.cost;
        let size = self
            .corners
            .iter()
            .flat_map(|corner| (0..N).map(|k| (corner.point[k] - best.point[k]).abs()))
            .fold(0.0, f64::max);
        if spread <= self.search.cost_tolerance && size <= self.search.size_tolerance {
            Some(Stopped::Converged)
        } else if self.evaluations >= self.search.max_evaluations {
            Some(Stopped::Evaluations)
        } else {
            None
        }
    }

    /// One step; the corners are sorted before it.
    fn step(&mut self) {
        let (best, second_worst, worst) = (
            self.corners[0].cost,
            self.corners[N - 1].cost,
            self.corners[N],
        );
        let centre = self.centre_of_better();
        let reflected = self.along(&centre, &worst.point, REFLECT);
        if reflected.cost < best {
            let expanded = self.along(&centre, &worst.point, EXPAND);
            self.corners[N] = if expanded.cost < reflected.cost {
                expanded
            } else {
                reflected
            };
        } else if reflected.cost < second_worst {
            self.corners[N] = reflected;
        } else {
            let outside = reflected.cost < worst.cost;
            let amount = if outside { CONTRACT } else { -CONTRACT };
            let contracted = self.along(&centre, &worst.point, amount);
            if contracted.cost < worst.cost.min(reflected.cost) {
                self.corners[N] = contracted;
            } else {
                self.shrink();
            }
        }
    }

    /// Mean of all corners but the worst.
    fn centre_of_better(&self) -> [f64; N] {
        std::array::from_fn(|k| {
            self.corners[..N]
                .iter()
                .map(|corner| corner.point[k])
                .sum::<f64>()
                / N as f64
        })
    }

    /// The point `amount` times as far beyond the centre as the worst lies before it.
    fn along(&mut self, centre: &[f64; N], worst: &[f64; N], amount: f64) -> Corner<N> {
        self.evaluate(std::array::from_fn(|k| {
            centre[k] + amount * (centre[k] - worst[k])
        }))
    }

    fn shrink(&mut self) {
        let best = self.corners[0].point;
        for i in 1..=N {
            let from = self.corners[i].point;
            self.corners[i] = self.evaluate(std::array::from_fn(|k| {
                best[k] + SHRINK * (from[k] - best[k])
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search<const N: usize>(lower: f64, upper: f64) -> Search<N> {
        Search {
            lower: [lower; N],
            upper: [upper; N],
            step: [0.4; N],
            cost_tolerance: 1e-14,
            size_tolerance: 1e-7,
            max_evaluations: 2000,
        }
    }

    fn assert_at<const N: usize>(found: Minimum<N>, point: [f64; N], cost: f64) {
        assert_eq!(found.stopped, Stopped::Converged, "{found:?}");
        assert!(
            found
                .point
                .iter()
                .zip(point)
                .all(|(x, y)| (x - y).abs() < 1e-5),
            "{found:?}"
        );
        assert!((found.cost - cost).abs() < 1e-9, "{found:?}");
    }

    fn rosenbrock(x: &[f64; 2]) -> f64 {
        100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
    }

    #[test]
    fn finds_the_minimum_of_rosenbrock_and_himmelblau() {
        assert_at(
            minimise(rosenbrock, [-1.2, 1.0], &search(-5.0, 5.0)),
            [1.0, 1.0],
            0.0,
        );
        let himmelblau =
            |x: &[f64; 2]| (x[0] * x[0] + x[1] - 11.0).powi(2) + (x[0] + x[1] * x[1] - 7.0).powi(2);
        assert_at(
            minimise(himmelblau, [2.5, 1.0], &search(-5.0, 5.0)),
            [3.0, 2.0],
            0.0,
        );
    }

    #[test]
    fn finds_the_minimum_of_beale_and_a_bowl_in_three_coordinates() {
        let beale = |x: &[f64; 2]| {
            (1.5 - x[0] + x[0] * x[1]).powi(2)
                + (2.25 - x[0] + x[0] * x[1].powi(2)).powi(2)
                + (2.625 - x[0] + x[0] * x[1].powi(3)).powi(2)
        };
        assert_at(
            minimise(beale, [1.0, 0.1], &search(-4.5, 4.5)),
            [3.0, 0.5],
            0.0,
        );
        let bowl = |x: &[f64; 3]| {
            (x[0] - 0.1).powi(2) + 3.0 * (x[1] + 0.2).powi(2) + (x[2] - 0.3).powi(2) + 7.0
        };
        assert_at(
            minimise(bowl, [1.0; 3], &search(-2.0, 2.0)),
            [0.1, -0.2, 0.3],
            7.0,
        );
    }

    /// Where the costs are asked for after a first simplex of (0, 0), (1, 0), (0, 1) with costs 0, 1, 2,
    /// when the trial points have the given costs.
    fn trials(costs: &[f64]) -> Vec<[f64; 2]> {
        let scripted: Vec<f64> = [0.0, 1.0, 2.0].iter().chain(costs).copied().collect();
        let mut asked = Vec::new();
        let one_step = Search {
            step: [1.0; 2],
            max_evaluations: 4,
            ..search(-9.0, 9.0)
        };
        minimise(
            |x: &[f64; 2]| {
                asked.push(*x);
                scripted.get(asked.len() - 1).copied().unwrap_or(9.0)
            },
            [0.0; 2],
            &one_step,
        );
        asked.split_off(3)
    }

    #[test]
    fn each_step_asks_for_the_points_of_the_method() {
        let reflected = [1.0, -1.0];
        assert_eq!(trials(&[0.5]), [reflected]);
        assert_eq!(trials(&[-1.0, -2.0]), [reflected, [1.5, -2.0]], "expansion");
        assert_eq!(
            trials(&[1.5, 0.5]),
            [reflected, [0.75, -0.5]],
            "contraction outside"
        );
        assert_eq!(
            trials(&[3.0, 0.5]),
            [reflected, [0.25, 0.5]],
            "contraction inside"
        );
        let shrunk = [reflected, [0.25, 0.5], [0.5, 0.0], [0.0, 0.5]];
        assert_eq!(trials(&[3.0, 5.0]), shrunk);
    }

    #[test]
    fn a_minimum_on_the_bounds_is_found_and_nothing_outside_is_asked() {
        let mut outside = 0;
        let tilted = |x: &[f64; 2]| {
            outside += usize::from(x.iter().any(|v| !(0.0..=1.0).contains(v)));
            x[0] + (x[1] - 0.25).powi(2)
        };
        let found = minimise(tilted, [0.9, 0.9], &search(0.0, 1.0));
        assert_at(found, [0.0, 0.25], 0.0);
        assert_eq!(outside, 0);
    }

    #[test]
    fn nan_is_never_chosen() {
        let cost = |x: &[f64; 2]| {
            if x[0] < 0.5 {
                f64::NAN
            } else {
                (x[0] - 0.6).powi(2) + (x[1] - 0.6).powi(2)
            }
        };
        assert_at(
            minimise(cost, [0.2, 0.2], &search(0.0, 1.0)),
            [0.6, 0.6],
            0.0,
        );
        let nowhere = minimise(|_: &[f64; 2]| f64::NAN, [0.2, 0.2], &search(0.0, 1.0));
        assert_eq!(
            (nowhere.stopped, nowhere.cost),
            (Stopped::NoFiniteCost, f64::INFINITY)
        );
    }

    #[test]
    fn the_number_of_evaluations_is_counted_and_kept() {
        let mut calls = 0;
        let limited = Search {
            max_evaluations: 40,
            ..search(-5.0, 5.0)
        };
        let found = minimise(
            |x: &[f64; 2]| {
                calls += 1;
                rosenbrock(x)
            },
            [-1.2, 1.0],
            &limited,
        );
        assert_eq!(
            (found.stopped, found.evaluations),
            (Stopped::Evaluations, calls)
        );
        assert!((40..44).contains(&calls), "{calls}");
        assert!(found.iterations > 5);
    }
}
