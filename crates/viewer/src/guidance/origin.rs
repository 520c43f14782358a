//! With which target and lamps a calibration was made, and whether the open scene has such.

use std::path::Path;

use toml::Value;
use uw_calib::vehicle::Vehicle;
use uw_scenery::textures::Pattern;

use crate::model::Settings;

/// How far lamps may differ that are taken for the same, as a share of the intensity and in degrees of the beam.
const ALIKE: (f64, f64) = (0.1, 1.0);
/// Lamps of the vehicle, one to each side of the camera.
const LAMPS: usize = 2;

/// With which target and lamps a calibration was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// The target.
    pub pattern: Pattern,
    /// Camera, sensor and lamps.
    pub vehicle: Vehicle,
}

impl Origin {
    /// Target and lamps in words.
    pub fn told(&self) -> String {
        let vehicle = &self.vehicle;
        format!(
            "with target {} and two lamps of {} W/sr over {}°, {} m to both sides of the camera",
            self.pattern.name(),
            vehicle.lamp_intensity,
            2.0 * vehicle.lamp_half_angle_deg,
            vehicle.lamp_offset_m
        )
    }

    /// What of the scene that is open, and of the target that is chosen, does not fit it.
    pub fn misfits(&self, chosen: Pattern, settings: &Settings, objects: &[Value]) -> Vec<String> {
        let mut found = Vec::new();
        let name = self.pattern.name();
        if chosen != self.pattern {
            found.push(format!("the chosen target is {}", chosen.name()));
        }
        if !objects.iter().any(|object| shows(object, name)) {
            found.push(format!("the open scene has no texture {name}"));
        }
        found.extend(self.lamp_misfit(settings));
        found
    }

    fn lamp_misfit(&self, settings: &Settings) -> Option<String> {
        let lamps = &settings.lamps;
        if lamps.len() != LAMPS {
            return Some(format!("lamps of the open scene: {}, not two", lamps.len()));
        }
        let vehicle = &self.vehicle;
        lamps.iter().find_map(|lamp| {
            let mean = lamp.intensity.iter().sum::<f64>() / 3.0;
            let (share, off_deg) = (
                mean / vehicle.lamp_intensity - 1.0,
                lamp.half_angle_deg - vehicle.lamp_half_angle_deg,
            );
            let is_alike = share.abs() <= ALIKE.0 && off_deg.abs() <= ALIKE.1;
            (!is_alike).then(|| {
                let beam_deg = 2.0 * lamp.half_angle_deg;
                format!(
                    "lamp {} of the open scene has {mean:.3} W/sr over {beam_deg:.0}°",
                    lamp.name
                )
            })
        })
    }
}

/// Whether an object of a scene file has the texture of that name.
fn shows(object: &Value, name: &str) -> bool {
    match object {
        Value::Table(table) => table.iter().any(|(field, value)| match value.as_str() {
            Some(file) => field == "texture" && Path::new(file).file_stem() == Some(name.as_ref()),
            None => shows(value, name),
        }),
        Value::Array(values) => values.iter().any(|value| shows(value, name)),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::OpenScene;

    #[test]
    fn what_does_not_fit_is_named() {
        let origin = Origin {
            pattern: Pattern::HullRed,
            vehicle: Vehicle::default(),
        };
        let told = origin.told();
        assert!(
            told.starts_with(
                "with target hull_red and two lamps of 0.4 W/sr over 100°, 0.3 m to both sides"
            ),
            "{told}"
        );
        let (open, mut settings) = OpenScene::fallback().expect("valid");
        let found = origin.misfits(Pattern::Seabed, &settings, &open.objects);
        let expected = [
            "the chosen target is seabed",
            "the open scene has no texture hull_red",
            "lamps of the open scene: 1, not two",
        ];
        assert_eq!(found, expected);
        let object = "reflectance = { texture = \"../textures/hull_red.png\" }";
        let hull: Value = toml::from_str::<toml::Table>(object).expect("valid").into();
        let mut lamp = settings.lamps[0].clone();
        lamp.intensity = [origin.vehicle.lamp_intensity; 3];
        lamp.half_angle_deg = origin.vehicle.lamp_half_angle_deg;
        settings.lamps = vec![lamp.clone(), lamp];
        let fits = |settings: &Settings| {
            origin.misfits(Pattern::HullRed, settings, std::slice::from_ref(&hull))
        };
        assert_eq!(fits(&settings), Vec::<String>::new());
        settings.lamps[1].intensity = [5.0; 3];
        let found = fits(&settings);
        assert!(
            found.len() == 1 && found[0].contains("has 5.000 W/sr over"),
            "{found:?}"
        );
    }
}
