//! What one water does to the pictures of one vehicle, by distance.

use serde::{Deserialize, Serialize};

use super::grid::{self, PATCHES};

/// A smooth function over the image, per channel: values in the middles of the 10 × 6 patches, row by row.
pub type Field = [Vec<f64>; 3];

/// Light of one source (daylight, or all lamps at 100 %) in a view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceTables {
    /// Radiance of the light that never met the target, W/(m² sr).
    pub veil: Field,
    /// Irradiance over π of the target, W/(m² sr).
    pub light: Field,
    /// Transmittance of the straight ray from the target, in [0, 1].
    pub straight: Field,
    /// Share of camera rays that scatter and still reach the target, in [0, 1].
    pub scattered: Field,
    /// Per channel the contrast that scattered rays leave of waves of [`WaterTables::frequencies_per_m`], in [-1, 1].
    pub transfer: [Vec<f64>; 3],
}

/// A view of a target from a distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewTables {
    /// Distance along the optical axis, m.
    pub distance_m: f64,
    /// Lamps at 100 %.
    pub lamps: SourceTables,
    /// Daylight at each of [`WaterTables::depths_m`].
    pub daylight: Vec<SourceTables>,
}

/// The tables of a water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterTables {
    /// Half the field of view across, as a tangent, and half of it down.
    pub half_view: [f64; 2],
    /// Waves on the target, cycles per metre, rising.
    pub frequencies_per_m: Vec<f64>,
    /// Depths of daylight, m, rising.
    pub depths_m: Vec<f64>,
    /// Views by rising distance, at least two.
    pub views: Vec<ViewTables>,
}

/// Everything of a view that a picture at one depth, distance and lamp level needs, per channel: sums of daylight and lamps.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// V per patch.
    pub(super) veil: [[f64; PATCHES]; 3],
    /// E · (T + S) per patch: what an even target of reflectance 1 would add.
    pub(super) gain: [[f64; PATCHES]; 3],
    /// Contrast left of waves, relative to an even target.
    pub(super) transfer: [Vec<f64>; 3],
}

/// A place between two nodes: the one before and how far it is to the next, beyond the ends below 0 or above 1.
#[derive(Clone, Copy, Debug)]
struct Between {
    before: usize,
    share: f64,
}

/// Where `at` lies among rising `nodes`.
fn between(nodes: impl ExactSizeIterator<Item = f64> + Clone, at: f64) -> Between {
    let n = nodes.len();
    if n < 2 {
        return Between {
            before: 0,
            share: 0.0,
        };
    }
    let nodes: Vec<f64> = nodes.collect();
    let before = nodes.partition_point(|&node| node <= at).clamp(1, n - 1) - 1;
    Between {
        before,
        share: (at - nodes[before]) / (nodes[before + 1] - nodes[before]),
    }
}

/// Between two numbers >= 0, and never below 0 beyond them.
fn mixed(from: f64, to: f64, share: f64) -> f64 {
    grid::between(from, to, share).max(0.0)
}

impl WaterTables {
    /// Least and greatest distance of the tables, m.
    pub fn distance_range_m(&self) -> (f64, f64) {
        let of = |view: Option<&ViewTables>| view.map_or(0.0, |view| view.distance_m);
        (of(self.views.first()), of(self.views.last()))
    }

    /// Least and greatest depth of the tables, m.
    pub fn depth_range_m(&self) -> (f64, f64) {
        let of = |depth: Option<&f64>| depth.copied().unwrap_or_default();
        (of(self.depths_m.first()), of(self.depths_m.last()))
    }

    /// The view at a depth, distance and lamp level (a fraction); `daylight` and `lamps` multiply their light.
    pub(super) fn seen(
        &self,
        depth_m: f64,
        distance_m: f64,
        level: f64,
        daylight: [f64; 3],
        lamps: [f64; 3],
    ) -> Seen {
        let place = between(
            self.views.iter().map(|view| view.distance_m.ln()),
            distance_m.ln(),
        );
        let depth = between(self.depths_m.iter().copied(), depth_m);
        let views = [
            &self.views[place.before],
            &self.views[(place.before + 1).min(self.views.len() - 1)],
        ];
        let deeper = (depth.before + 1).min(self.depths_m.len() - 1);
        let day = views.map(|view| [&view.daylight[depth.before], &view.daylight[deeper]]);
        let lamp = views.map(|view| &view.lamps);
        let mut seen = Seen {
            veil: [[0.0; PATCHES]; 3],
            gain: [[0.0; PATCHES]; 3],
            transfer: std::array::from_fn(|_| Vec::new()),
        };
        let distances = views.map(|view| view.distance_m);
        for k in 0..3 {
            let of_lamps =
                |of: &dyn Fn(&SourceTables) -> f64| mixed(of(lamp[0]), of(lamp[1]), place.share);
            let of_day = |of: &dyn Fn(&SourceTables) -> f64| {
                let [near, far] =
                    day.map(|[upper, lower]| mixed(of(upper), of(lower), depth.share));
                mixed(near, far, place.share)
            };
            let (by_day, by_lamps) = (daylight[k], level * lamps[k]);
            let mut sums = [0.0; 4];
            for i in 0..PATCHES {
                let straight = [
                    of_day(&|s| s.straight[k][i]),
                    of_lamps(&|s| s.straight[k][i]),
                ];
                // E times a distance squared is smoother than E.
                let square = |view: usize| distances[view] * distances[view];
                let lamp_light = mixed(
                    lamp[0].light[k][i] * square(0),
                    lamp[1].light[k][i] * square(1),
                    place.share,
                ) / (distance_m * distance_m);
                let light = [by_day * of_day(&|s| s.light[k][i]), by_lamps * lamp_light];
                let scattered = [
                    of_day(&|s| s.scattered[k][i]),
                    of_lamps(&|s| s.scattered[k][i]),
                ];
                seen.veil[k][i] =
                    by_day * of_day(&|s| s.veil[k][i]) + by_lamps * of_lamps(&|s| s.veil[k][i]);
                seen.gain[k][i] = light[0] * (straight[0] + scattered[0])
                    + light[1] * (straight[1] + scattered[1]);
                sums[0] += seen.gain[k][i];
                sums[1] += light[0] * straight[0] + light[1] * straight[1];
                sums[2] += light[0] * scattered[0];
                sums[3] += light[1] * scattered[1];
            }
            let total = sums[0].max(f64::MIN_POSITIVE);
            let waves = 0..self.frequencies_per_m.len();
            seen.transfer[k] = waves
                .map(|f| {
                    let line = |a: f64, b: f64, share: f64| a + share * (b - a);
                    let [near, far] = day.map(|[upper, lower]| {
                        line(upper.transfer[k][f], lower.transfer[k][f], depth.share)
                    });
                    let of_day = line(near, far, place.share);
                    let of_lamps =
                        line(lamp[0].transfer[k][f], lamp[1].transfer[k][f], place.share);
                    (sums[1] + sums[2] * of_day + sums[3] * of_lamps) / total
                })
                .collect();
        }
        seen
    }

    /// Contrast left of waves of a frequency, from those of the tables; 1 below the lowest, by the last above the highest.
    pub(super) fn left_of(&self, transfer: &[f64], frequency_per_m: f64) -> f64 {
        let nodes = &self.frequencies_per_m;
        if nodes.is_empty() {
            return 1.0;
        }
        if frequency_per_m <= nodes[0] {
            let share = (frequency_per_m / nodes[0]).max(0.0);
            return 1.0 + share * (transfer[0] - 1.0);
        }
        let place = between(nodes.iter().map(|f| f.ln()), frequency_per_m.ln());
        let share = place.share.min(1.0);
        let after = (place.before + 1).min(nodes.len() - 1);
        transfer[place.before] + share * (transfer[after] - transfer[place.before])
    }
}
