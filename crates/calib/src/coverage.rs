//! What the pictures of a manifest cover, said before any of them is opened.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::daylight::LEAST_RANGE_M;
use crate::manifest::{Row, RowKind};

/// Depths closer than this are one depth, m: a vehicle does not hold its depth better.
pub(crate) const SAME_DEPTH_M: f64 = 0.25;

/// Counts and ranges of a manifest's pictures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Coverage {
    /// Depths of pictures that look up, m.
    up_depths_m: Vec<f64>,
    /// Lamp level in percent, and distances in m of the pictures of the target at it; several at one distance count once.
    levels: Vec<(f64, Vec<f64>)>,
    /// Depths of pictures of the target with the lamps off by their distance, both in m.
    off: BTreeMap<u64, Vec<f64>>,
}

impl Coverage {
    pub(crate) fn of(rows: &[Row]) -> Self {
        let mut coverage = Self::default();
        let mut levels: Vec<(f64, f64)> = Vec::new();
        for row in rows {
            match row.kind {
                RowKind::Depth { depth_m } => coverage.up_depths_m.push(depth_m),
                RowKind::Contrast {
                    distance_m,
                    light_pct,
                    depth_m,
                } => {
                    levels.push((light_pct, distance_m));
                    if let (true, Some(depth_m)) = (light_pct == 0.0, depth_m) {
                        // Distances are positive: their bits are in their order.
                        let depths = coverage.off.entry(distance_m.to_bits()).or_default();
                        depths.push(depth_m);
                    }
                }
            }
        }
        levels.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.total_cmp(&y.1)));
        levels.dedup();
        coverage.levels = levels
            .chunk_by(|x, y| x.0 == y.0)
            .map(|of| (of[0].0, of.iter().map(|l| l.1).collect()))
            .collect();
        coverage.up_depths_m.sort_by(f64::total_cmp);
        coverage.up_depths_m.dedup();
        coverage
    }

    /// Whether any picture looks up.
    pub(crate) fn looks_up(&self) -> bool {
        !self.up_depths_m.is_empty()
    }

    /// Lamp levels above 0 with their distances.
    pub(crate) fn lit(&self) -> impl Iterator<Item = &(f64, Vec<f64>)> {
        self.levels.iter().filter(|l| l.0 > 0.0)
    }

    fn off(&self) -> Option<&(f64, Vec<f64>)> {
        self.levels.iter().find(|l| l.0 == 0.0)
    }

    /// Whether pictures with the lamps off show how daylight falls with depth.
    pub(crate) fn shows_daylight(&self) -> bool {
        self.off.values().any(|depths| {
            let (least, most) = range(depths);
            most - least >= LEAST_RANGE_M
        })
    }

    /// What is there, a line per kind.
    pub(crate) fn has(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = match self.up_depths_m.as_slice() {
            [] => writeln!(text, "  has no picture that looks up (kind depth)"),
            depths => writeln!(
                text,
                "  has pictures that look up (kind depth) from {}",
                count_and_range(depths, "depth")
            ),
        };
        if self.levels.is_empty() {
            let _ = writeln!(text, "  has no picture of the target (kind contrast)");
        }
        for (level, distances) in &self.levels {
            let lamps = match *level {
                0.0 => "the lamps off".to_owned(),
                level => format!("lamps at {level} %"),
            };
            let from = count_and_range(distances, "distance");
            let _ = writeln!(
                text,
                "  has pictures of the target (kind contrast) with {lamps} from {from}"
            );
        }
        text
    }

    /// What is missing and what for, a text each; `daylight_given` where K_z comes from elsewhere.
    pub(crate) fn lacks(&self, daylight_given: bool) -> Vec<&'static str> {
        let mut lacks = Vec::new();
        if self.off().is_none() {
            lacks.push(
                "pictures of the target with the lamps off (kind contrast, light_pct 0) from several distances: K_c off, what \
                 daylight alone shows. In the dark there is none, and no profile: `uw fit --dark` and `uwguide --water .. --no-profile` do \
                 without",
            );
        }
        if self.lit().next().is_none() {
            lacks.push(
                "pictures of the target with the lamps on (kind contrast, light_pct above 0) from the same distances: K_c on, \
                 what the lamps add or veil",
            );
        }
        if !self.looks_up() && !daylight_given && !self.shows_daylight() {
            lacks.push(
                "how daylight falls with depth, K_z. Any of these will do: pictures that look up (kind depth) from several \
                 depths; pictures of the target with the lamps off and depth_m given, from one distance at depths at least \
                 1 m apart; --jerlov TYPE; --kd-per-m R,G,B",
            );
        }
        lacks
    }

    /// What makes a poor profile, though a profile.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let lit: Vec<f64> = self.lit().flat_map(|l| l.1.clone()).collect();
        let off = self.off().map_or(&[][..], |l| &l.1);
        for (of, distances) in [("on", lit.as_slice()), ("off", off)] {
            let (least, most) = range(distances);
            if !distances.is_empty() && least == most {
                warnings.push(format!(
                    "the pictures with the lamps {of} are from one distance ({least} m): how contrast falls with distance is \
                     unknown, and every other distance is outside this calibration"
                ));
            } else if distances.iter().all(|d| *d == least || *d == most) && !distances.is_empty() {
                warnings.push(format!(
                    "the pictures with the lamps {of} are from two distances ({least} and {most} m): in between contrast is taken to fall in a straight line; \
                     five or six tell how it does"
                ));
            }
        }
        let apart = |one: &[f64], other: &[f64]| -> Vec<String> {
            let mut lone: Vec<f64> = one.iter().copied().filter(|d| !other.contains(d)).collect();
            lone.sort_by(f64::total_cmp);
            lone.dedup();
            lone.iter().map(f64::to_string).collect()
        };
        for (of, other, lone) in [
            ("on", "off", apart(&lit, off)),
            ("off", "on", apart(off, &lit)),
        ] {
            if !lone.is_empty() && !lit.is_empty() && !off.is_empty() {
                warnings.push(format!(
                    "there are pictures with the lamps {of} from {} m and none with the lamps {other}: what lamps do there is not known",
                    lone.join(", ")
                ));
            }
        }
        if let [depth_m] = self.up_depths_m[..] {
            warnings.push(format!(
                "the pictures that look up are from one depth ({depth_m} m): every other depth is outside this calibration"
            ));
        }
        warnings
    }
}

/// Least and most of values.
pub(crate) fn range(values: &[f64]) -> (f64, f64) {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (least, most)
}

fn count_and_range(values: &[f64], of: &str) -> String {
    let (least, most) = range(values);
    match values.len() {
        1 => format!("1 {of} ({least} m)"),
        n => format!("{n} {of}s ({least} to {most} m)"),
    }
}
