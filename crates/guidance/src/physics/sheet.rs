//! Contrast over all distances and lamp levels, laid down once for a picture: what a search looks at.

use super::predict::Predictor;
use crate::features::Candidate;

/// Distances of the sheet, evenly spaced by their logarithm.
const DISTANCES: usize = 49;
/// Lamp levels, evenly spaced by their root: what a lamp adds to the stored count bends most where there is little of it.
const LEVELS: usize = 25;

/// Contrast by distance and lamp level, between its nodes by cubics (Catmull and Rom 1974).
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    log_near: f64,
    log_step: f64,
    /// 8-bit counts per channel, level by level of each distance.
    counts: Vec<[f64; 3]>,
}

impl Sheet {
    /// What a predictor says from `near_m` to `far_m`, which is farther.
    pub(super) fn new(predictor: &Predictor, (near_m, far_m): (f64, f64)) -> Self {
        let log_near = near_m.ln();
        let log_step = (far_m.ln() - log_near) / (DISTANCES - 1) as f64;
        let mut counts = Vec::with_capacity(DISTANCES * LEVELS);
        for i in 0..DISTANCES {
            let there = predictor.at_distance((log_near + log_step * i as f64).exp());
            counts.extend((0..LEVELS).map(|j| {
                let root = j as f64 / (LEVELS - 1) as f64;
                there.counts(100.0 * root * root)
            }));
        }
        Self {
            log_near,
            log_step,
            counts,
        }
    }

    /// Contrast at a candidate, 8-bit counts; that of the nearest end outside the sheet.
    pub(super) fn at(&self, candidate: &Candidate) -> [f64; 3] {
        let distance = (candidate.distance_m.ln() - self.log_near) / self.log_step;
        let level = (0.01 * candidate.light_pct).sqrt() * (LEVELS - 1) as f64;
        let (row, across) = cubic(distance, DISTANCES);
        let (column, along) = cubic(level, LEVELS);
        let mut found = [0.0; 3];
        for (i, &a) in across.iter().enumerate() {
            let line = &self.counts[row[i] * LEVELS..][..LEVELS];
            for (j, &b) in along.iter().enumerate() {
                let node = line[column[j]];
                for k in 0..3 {
                    found[k] += a * b * node[k];
                }
            }
        }
        found
    }
}

/// The four nodes around a position among `n` and their weights. Beyond an end its line goes on.
fn cubic(position: f64, n: usize) -> ([usize; 4], [f64; 4]) {
    let at = position.clamp(0.0, (n - 1) as f64);
    let before = (at as usize).min(n - 2);
    let t = at - before as f64;
    let (t2, t3) = (t * t, t * t * t);
    let mut weights = [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ];
    // The node that is not there is taken to lie on the line through the two at the end.
    if before == 0 {
        let missing = weights[0];
        (weights[0], weights[1], weights[2]) =
            (0.0, weights[1] + 2.0 * missing, weights[2] - missing);
    }
    if before + 2 == n {
        let missing = weights[3];
        (weights[1], weights[2], weights[3]) =
            (weights[1] - missing, weights[2] + 2.0 * missing, 0.0);
    }
    let nodes = [
        before.saturating_sub(1),
        before,
        before + 1,
        (before + 2).min(n - 1),
    ];
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_met_everywhere_and_parabolas_inside() {
        let n = 9;
        let value = |of: &dyn Fn(f64) -> f64, at: f64| {
            let (nodes, weights) = cubic(at, n);
            (0..4)
                .map(|i| weights[i] * of(nodes[i] as f64))
                .sum::<f64>()
        };
        for step in 0..=80 {
            let at = 0.1 * f64::from(step);
            assert!(
                (value(&|x| 3.0 - 0.5 * x, at) - (3.0 - 0.5 * at)).abs() < 1e-12,
                "{at}"
            );
            if (1.0..=7.0).contains(&at) {
                assert!((value(&|x| x * x, at) - at * at).abs() < 1e-12, "{at}");
            }
        }
        assert_eq!(value(&|x| x, -3.0), 0.0);
        assert_eq!(value(&|x| x, 30.0), 8.0);
    }
}
