//! What one water does to the pictures of one vehicle, by distance.

use serde::{Deserialize, Serialize};

use crate::card::Sun;

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
    /// Daylight at each of [`WaterTables::depths_m`]; none in the dark.
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
    /// Depths of daylight, m, rising; empty where there is none (night, or deep): the tables then hold at any depth.
    pub depths_m: Vec<f64>,
    /// The sun of their daylight, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// Views by rising distance, at least two.
    pub views: Vec<ViewTables>,
}

impl WaterTables {
    /// Distances of the tables, rising, m.
    pub fn distances_m(&self) -> Vec<f64> {
        self.views.iter().map(|view| view.distance_m).collect()
    }

    /// Least and greatest distance of the tables, m.
    pub fn distance_range_m(&self) -> (f64, f64) {
        let of = |view: Option<&ViewTables>| view.map_or(0.0, |view| view.distance_m);
        (of(self.views.first()), of(self.views.last()))
    }

    /// Least and greatest depth of the tables, m; `None` in the dark, where they hold at any depth.
    pub fn depth_range_m(&self) -> Option<(f64, f64)> {
        self.depths_m
            .first()
            .copied()
            .zip(self.depths_m.last().copied())
    }
}
