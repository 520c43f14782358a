//! Counts and light of an encoding by a table, for every pixel of a picture.

use crate::Encoding;

/// Steps of the table, a count.
const STEPS: usize = 8;
/// Largest count.
pub(crate) const FULL: f64 = 255.0;

/// How counts stand for light.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lights {
    pub(crate) encoding: Encoding,
    /// Light at multiples of 1/8 count, rising.
    lights: Vec<f64>,
}

impl Lights {
    pub(crate) fn new(encoding: Encoding) -> Self {
        let steps = FULL as usize * STEPS;
        let light = |i| encoding.light(i as f64 / STEPS as f64);
        Self {
            encoding,
            lights: (0..=steps).map(light).collect(),
        }
    }

    /// Light in [0, 1] of counts in [0, 255].
    pub(crate) fn light(&self, counts: f64) -> f64 {
        let at = STEPS as f64 * counts.max(0.0);
        let i = (at as usize).min(self.lights.len() - 2);
        let [from, to] = [self.lights[i], self.lights[i + 1]];
        from + (at - i as f64) * (to - from)
    }

    /// Counts of light, which is clipped above 1.
    pub(crate) fn counts(&self, light: f64) -> f64 {
        let after = self.lights.partition_point(|&of| of <= light);
        let Some(&to) = self.lights.get(after) else {
            return FULL;
        };
        let Some(i) = after.checked_sub(1) else {
            return 0.0;
        };
        let from = self.lights[i];
        (i as f64 + (light - from) / (to - from)) / STEPS as f64
    }
}
