//! How much light a lamp gives at the level it is set to.

use serde::{Deserialize, Serialize};

/// Light by setting: pairs of a level that is set and the light it gives, both in percent of full, with straight lines in between.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<[f64; 2]>", into = "Vec<[f64; 2]>")]
pub struct LevelCurve(Vec<[f64; 2]>);

impl LevelCurve {
    /// Of pairs of level and light.
    ///
    /// # Errors
    /// Anything but levels that rise from 0 to 100 with light that rises, or stays, from 0 to 100.
    pub fn new(points: Vec<[f64; 2]>) -> Result<Self, String> {
        let wrong = |what: String| {
            Err(format!(
                "level_curve must be pairs of a level that is set and the light it gives, percent of full, from [0, 0] to [100, 100], \
                 levels rising and light never falling; got {what}"
            ))
        };
        let ends = (points.first(), points.last());
        if ends != (Some(&[0.0, 0.0]), Some(&[100.0, 100.0])) {
            return wrong(format!("{points:?}"));
        }
        let rises = |pair: &[[f64; 2]]| pair[1][0] > pair[0][0] && pair[1][1] >= pair[0][1];
        match points.windows(2).find(|pair| !rises(pair)) {
            None => Ok(Self(points)),
            Some(pair) => wrong(format!("{:?} after {:?}", pair[1], pair[0])),
        }
    }

    /// The pairs.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// Light, percent of full, at the level `level_pct` in [0, 100].
    pub fn light_pct(&self, level_pct: f64) -> f64 {
        interpolated(&self.0, [0, 1], level_pct)
    }

    /// The lowest level at which the lamp gives `light_pct` in [0, 100], percent of full.
    pub fn level_pct(&self, light_pct: f64) -> f64 {
        interpolated(&self.0, [1, 0], light_pct)
    }
}

/// The coordinate `to` where the coordinate `from` first is `x`.
fn interpolated(points: &[[f64; 2]], [from, to]: [usize; 2], x: f64) -> f64 {
    let next = points.partition_point(|point| point[from] < x);
    if next == 0 {
        return points[0][to];
    }
    let before = points[next - 1];
    let Some(after) = points.get(next) else {
        return before[to];
    };
    let share = (x - before[from]) / (after[from] - before[from]);
    before[to] + share * (after[to] - before[to])
}

impl TryFrom<Vec<[f64; 2]>> for LevelCurve {
    type Error = String;

    fn try_from(points: Vec<[f64; 2]>) -> Result<Self, String> {
        Self::new(points)
    }
}

impl From<LevelCurve> for Vec<[f64; 2]> {
    fn from(curve: LevelCurve) -> Self {
        curve.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_and_level_are_inverse_and_a_dead_band_is_left_out() {
        let curve = LevelCurve::new(vec![
            [0.0, 0.0],
            [10.0, 0.0],
            [50.0, 20.0],
            [80.0, 100.0],
            [100.0, 100.0],
        ])
        .expect("a curve");
        for (level, light) in [(0.0, 0.0), (5.0, 0.0), (30.0, 10.0), (65.0, 60.0)] {
            assert!((curve.light_pct(level) - light).abs() < 1e-12, "{level}");
        }
        assert_eq!(curve.light_pct(90.0), 100.0);
        assert_eq!((curve.level_pct(0.0), curve.level_pct(100.0)), (0.0, 80.0));
        for i in 1..=100 {
            let light = f64::from(i);
            let back = curve.light_pct(curve.level_pct(light));
            assert!((back - light).abs() < 1e-12, "{light}: {back}");
        }
    }

    #[test]
    fn curves_that_are_none_are_refused() {
        for (points, words) in [
            (vec![], "got []"),
            (vec![[0.0, 0.0], [90.0, 100.0]], "[100, 100]"),
            (vec![[0.0, 1.0], [100.0, 100.0]], "[0, 0]"),
            (
                vec![[0.0, 0.0], [50.0, 60.0], [60.0, 50.0], [100.0, 100.0]],
                "[60.0, 50.0] after [50.0, 60.0]",
            ),
            (
                vec![[0.0, 0.0], [f64::NAN, 60.0], [100.0, 100.0]],
                "[NaN, 60.0]",
            ),
        ] {
            let told = LevelCurve::new(points).expect_err("refused");
            assert!(told.contains(words), "{told}");
        }
    }
}
