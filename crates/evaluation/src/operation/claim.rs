//! The folder of a run belongs to one configuration of its renders.

use std::path::Path;

use crate::error::EvalError;
use crate::files::write_text;

use super::config::OperationConfig;

/// Name of the file that tells which renders the folder holds.
const CLAIM: &str = "views/renders.toml";

/// Makes the folder and writes down what its views depend on, or checks that its views are those of this
/// configuration. Fields that no render depends on may change from run to run.
pub fn claim(config: &OperationConfig, folder: &Path) -> Result<(), EvalError> {
    let path = folder.join(CLAIM);
    std::fs::create_dir_all(folder.join("views")).map_err(|e| EvalError::output(folder, e))?;
    let text = toml::to_string(&of_renders(config)).map_err(|e| EvalError::output(&path, e))?;
    match std::fs::read_to_string(&path) {
        Ok(old) if old == text => Ok(()),
        Ok(_) => Err(EvalError::Input(format!(
            "{}: the views there were rendered with other settings; take another folder or delete its views",
            folder.display()
        ))),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => write_text(&path, &text),
        Err(e) => Err(EvalError::output(&path, e)),
    }
}

/// The configuration with everything at its default that no render depends on.
fn of_renders(config: &OperationConfig) -> OperationConfig {
    let mut water = config.water.clone();
    for water in &mut water {
        (water.held_distance_m, water.water_file) = (1.0, None);
    }
    OperationConfig {
        seed: config.seed,
        target: config.target.clone(),
        step_m: config.step_m,
        // Lanes over a bottom follow from the list of depths.
        depths_m: config.depths_m.clone(),
        lane_m: config.lane_m,
        track_error_m: config.track_error_m,
        stations: config.stations,
        water,
        quality: config.quality,
        vehicle: config.vehicle.clone(),
        ..OperationConfig::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operation::config::TwinConfig;

    #[test]
    fn a_folder_keeps_to_the_settings_of_its_renders() {
        let folder = tempfile::tempdir().expect("folder");
        let mut config = OperationConfig::default();
        claim(&config, folder.path()).expect("new");
        config.repetitions = 7;
        config.water[0].held_distance_m = 2.5;
        config.water[0].water_file = Some("water.json".into());
        config.twin = Some(TwinConfig::default());
        claim(&config, folder.path()).expect("the same renders");
        config.vehicle.exposure = 4.0;
        let error = claim(&config, folder.path()).expect_err("other renders");
        assert!(error.to_string().contains("other settings"), "{error}");
    }
}
