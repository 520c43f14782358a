//! The grids that have a name.

use super::DatasetConfig;

/// The grid called `name`, if there is one.
pub(super) fn preset(name: &str) -> Option<DatasetConfig> {
    match name {
        "paper" => Some(DatasetConfig::default()),
        "wide" => Some(wide()),
        _ => None,
    }
}

/// What the paper's own limitations name: deep water, far targets, other surfaces, oblique views, and waters
/// between Jerlov's types.
fn wide() -> DatasetConfig {
    let words = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect();
    DatasetConfig {
        textures: words(&[
            "hull_red",
            "seabed",
            "concrete_pier",
            "coral_rock",
            "kelp_sediment",
            "rusted_pile",
            "hull_black_fouled",
            "gravel",
            "pipeline_coating",
            "fishing_net",
        ]),
        water_types: words(&[
            "I",
            "IB",
            "II",
            "II-III@0.5",
            "III",
            "1C",
            "1C-3C@0.5",
            "3C",
            "3C-5C@0.5",
            "5C",
            "5C-7C@0.5",
            "7C",
        ]),
        backscatter_fractions: vec![0.005, 0.0183, 0.04],
        depths_m: vec![3.0, 6.0, 12.0, 30.0],
        distances_m: vec![0.5, 1.0, 2.0, 3.0, 4.5, 6.0],
        light_pct: vec![0.0, 33.0, 67.0, 100.0],
        tilts_deg: vec![0.0, 15.0],
        calibration_depths_m: vec![1.0, 3.0, 6.0, 12.0, 20.0, 30.0],
        calibration_depth_m: 6.0,
        ..DatasetConfig::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::views;

    #[test]
    fn every_view_of_the_named_grids_sees_its_target_alone() {
        for name in ["paper", "wide"] {
            views::check(&preset(name).unwrap()).unwrap();
        }
        let config = DatasetConfig {
            distances_m: vec![6.0],
            ..DatasetConfig::default()
        };
        let told = views::check(&config).unwrap_err().to_string();
        assert!(told.contains("depths_m 1, distances_m 6"), "{told}");
    }
}
