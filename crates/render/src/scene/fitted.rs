//! `[water] fitted`: coefficients and phase function from a water file (`uw-water/1`), as `uw fit` and `uw water-tables` write it.

use serde_json::Value as Json;
use uw_media::Iops;
use uw_media::phase::{FournierForand, Phase};

use super::SceneError;
use super::phase::DEFAULT_PARTICLES;
use super::reader::Table;
use super::value::Value;

/// The format that is read.
const FORMAT: &str = "uw-water/1";
/// Fields of `[water]` that the file says itself.
const SAID_BY_FILE: [&str; 8] = [
    "jerlov",
    "bands",
    "spectrum",
    "profile",
    "jerlov_profile",
    "a",
    "b",
    "phase",
];

/// A water as its file has it, in three bands.
pub(super) struct Fitted {
    pub(super) iops: Iops,
    pub(super) phase: Phase,
}

/// Reads the file that `[water]` names; `None` where it names none.
pub(super) fn read(water: &Table<'_>) -> Result<Option<Fitted>, SceneError> {
    let Some(value) = water.optional("fitted") else {
        return Ok(None);
    };
    for field in SAID_BY_FILE {
        water.refuse(field, "where water.fitted is given, whose file says it")?;
    }
    read_file(&value).map(Some)
}

fn read_file(value: &Value<'_>) -> Result<Fitted, SceneError> {
    let path = value.as_path()?;
    let unusable = |reason: String| value.unusable_file(&path, reason);
    let text = uw_assets::ALL
        .read_to_string(&path)
        .map_err(|error| unusable(error.to_string()))?;
    let file: Json = serde_json::from_str(&text).map_err(|error| unusable(error.to_string()))?;
    if file["format"].as_str() != Some(FORMAT) {
        let got = &file["format"];
        return Err(unusable(format!("format must be \"{FORMAT}\", got {got}")));
    }
    let water = &file["water"];
    let channels = |field: &str| {
        let values: Option<Vec<f64>> =
            (water[field].as_array()).and_then(|values| values.iter().map(Json::as_f64).collect());
        let values = values.and_then(|values| <[f64; 3]>::try_from(values).ok());
        let known = values.filter(|values| values.iter().all(|v| *v >= 0.0 && v.is_finite()));
        known.ok_or_else(|| {
            let got = &water[field];
            unusable(format!(
                "water.{field} must be three numbers >= 0 (1/m), got {got}"
            ))
        })
    };
    let fraction = water["backscatter_fraction"].as_f64();
    let fraction = fraction.ok_or_else(|| {
        let got = &water["backscatter_fraction"];
        unusable(format!(
            "water.backscatter_fraction must be a number, got {got}"
        ))
    })?;
    let phase = FournierForand::new(DEFAULT_PARTICLES.0, fraction);
    Ok(Fitted {
        iops: Iops {
            a: channels("a_per_m")?,
            b: channels("b_per_m")?,
        },
        phase: Phase::FournierForand(phase.map_err(|error| unusable(error.to_string()))?),
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::scene::Scene;

    const CAMERA: &str = "format = \"uw-scene/1\"\n[camera]\nposition_m = [0, 0, -1]\nforward = [1, 0, 0]\nup = [0, 0, 1]\nhfov_deg = 60\nwidth = 8\nheight = 8\n";
    const WATER: &str = "{\"format\": \"uw-water/1\", \"water\": {\"a_per_m\": [0.4, 0.1, 0.05], \"b_per_m\": [0.2, 0.3, 0.4], \"backscatter_fraction\": 0.012}}";

    fn read(water: &str, file: &str) -> Result<Scene, String> {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("water.json"), file).expect("written");
        let path = folder.path().join("scene.toml");
        fs::write(&path, format!("{CAMERA}[water]\n{water}\n")).expect("written");
        Scene::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn the_file_says_coefficients_and_phase_function() {
        let fitted = read("fitted = \"water.json\"", WATER).expect("a scene");
        let given = "a = [0.4, 0.1, 0.05]\nb = [0.2, 0.3, 0.4]\n\
             phase = { model = \"fournier-forand\", n = 1.10, backscatter_fraction = 0.012 }";
        let given = read(given, WATER).expect("a scene");
        let text = |scene: &Scene| format!("{:?} {:?}", scene.water, scene.spectral.is_some());
        assert_eq!(text(&fitted), text(&given));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let fitted = "fitted = \"water.json\"";
        let cases = [
            (
                fitted,
                WATER.replace("water/1", "scene/1"),
                "format must be \"uw-water/1\"",
            ),
            (
                fitted,
                WATER.replace("[0.4, ", "["),
                "water.a_per_m must be three numbers",
            ),
            (
                fitted,
                WATER.replace("0.2, ", "-0.2, "),
                "water.b_per_m must be three numbers >= 0",
            ),
            (
                fitted,
                WATER.replace("0.012", "0.9"),
                "backscatter_fraction",
            ),
            ("fitted = \"none.json\"", WATER.to_owned(), "none.json"),
            (
                "fitted = \"water.json\"\njerlov = \"3C\"",
                WATER.to_owned(),
                "water.jerlov",
            ),
        ];
        for (water, file, words) in cases {
            let told = read(water, &file).expect_err(words);
            assert!(told.contains(words), "{words}: {told}");
        }
    }
}
