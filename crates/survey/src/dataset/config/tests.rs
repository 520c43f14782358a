//! Configurations of data sets: what they may say.

use super::*;

#[test]
fn the_default_is_valid_and_is_the_grid_of_the_paper() {
    let config = DatasetConfig::default();
    config.check().unwrap();
    assert_eq!(Some(&config), DatasetConfig::preset("paper").as_ref());
    let pairs = (config.distances_m.len() * config.light_pct.len()).pow(2);
    let environments = config.patterns().len() * config.waters().len();
    assert_eq!(environments * config.depths_m.len() * pairs, 138_240);
}

#[test]
fn the_wide_grid_goes_where_the_paper_did_not() {
    let config = DatasetConfig::preset("wide").unwrap();
    config.check().unwrap();
    assert!(config.depths_m.contains(&30.0) && config.distances_m.contains(&6.0));
    assert!(config.patterns().len() >= 8 && config.tilts_deg.len() > 1);
    assert!(config.water_types.iter().any(|t| t.contains('@')));
    assert_eq!(DatasetConfig::preset("narrow"), None);
}

#[test]
fn wrong_values_are_named() {
    let mut config = DatasetConfig::default();
    config.textures.push("lawn".into());
    assert!(config.check().unwrap_err().contains("lawn"));
    let config = DatasetConfig {
        distances_m: vec![0.5, f64::NAN],
        ..DatasetConfig::default()
    };
    assert!(
        config
            .check()
            .unwrap_err()
            .contains("distances_m must be in [0.05, 10], got NaN")
    );
    let config = DatasetConfig {
        water_types: vec!["IB-II@1.4".into()],
        ..DatasetConfig::default()
    };
    assert!(config.check().unwrap_err().contains("[0, 1], got 1.4"));
    let in_bands = |bands: &str| DatasetConfig {
        bands: bands.into(),
        ..DatasetConfig::default()
    };
    assert_eq!(in_bands("spectral").check(), Ok(()));
    let told = in_bands("narrow").check().unwrap_err();
    assert!(
        told.starts_with("bands: ") && told.contains("spectral"),
        "{told}"
    );
    // Not all of the ten types were measured.
    let told = in_bands("spectral-measured").check().unwrap_err();
    assert!(
        told.starts_with("bands: ") && told.contains("measured"),
        "{told}"
    );
}

/// A vehicle has one text in a file and in a configuration, and a stored configuration holds it whole.
#[test]
fn a_vehicle_is_named_or_has_a_file_or_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let read = |text: &str| {
        let path = folder.path().join("grid.toml");
        std::fs::write(&path, text).unwrap();
        DatasetConfig::read(&path)
    };
    let own = VehicleFile {
        vehicle: Vehicle {
            noise_a: 7e-4,
            ..Vehicle::default()
        },
        ..VehicleFile::default()
    };
    std::fs::create_dir(folder.path().join("boats")).unwrap();
    let file = folder.path().join("boats/own.toml");
    std::fs::write(file, own.to_text().unwrap()).unwrap();
    assert_eq!(
        read("vehicle = \"default\"").unwrap(),
        DatasetConfig::default()
    );
    let config = read("seed = 3\nvehicle = \"boats/own.toml\"").unwrap();
    assert_eq!((config.seed, &config.vehicle), (3, &own.vehicle));
    let table = read("seed = 3\n[vehicle]\nnoise_a = 7e-4").unwrap();
    assert_eq!(config, table);
    // What a dataset stores needs no other file.
    let stored = config.to_text().unwrap();
    assert_eq!(toml::from_str::<DatasetConfig>(&stored).unwrap(), config);
    for (text, words) in [
        (
            "vehicle = \"yacht\"",
            "grid.toml: vehicle: vehicle \"yacht\": is neither",
        ),
        ("vehicle = \"boats/none.toml\"", "boats/none.toml: cannot"),
        ("vehicle = 3", "invalid type: integer `3`"),
        ("vehicle = \"default\"\nsead = 3", "unknown field `sead`"),
    ] {
        let told = read(text).unwrap_err().to_string();
        assert!(told.contains(words), "{text}: {told}");
    }
}

/// What counts by wavelength alone needs bands by wavelength, and names that are known.
#[test]
fn a_vehicle_s_spectra_go_with_light_by_wavelength() {
    type Change = (fn(&mut Vehicle), &'static str);
    let with = |bands: &str, change: fn(&mut Vehicle)| {
        let mut config = DatasetConfig {
            bands: bands.into(),
            ..DatasetConfig::default()
        };
        change(&mut config.vehicle);
        config.check()
    };
    let named: [Change; 3] = [
        (|v| v.response = Some("canon5d2".into()), "response"),
        (
            |v| v.lamp_spectrum = Some("halogen".into()),
            "lamp_spectrum",
        ),
        (
            |v| v.daylight_spectrum = Some("clear-sky".into()),
            "daylight_spectrum",
        ),
    ];
    for (change, field) in named {
        assert_eq!(with("spectral", change), Ok(()));
        let told = with("mean", change).unwrap_err();
        let start = format!("vehicle.{field} counts by wavelength alone");
        assert!(
            told.starts_with(&start) && told.ends_with("got \"mean\""),
            "{told}"
        );
    }
    let unknown: [Change; 3] = [
        (|v| v.response = Some("canon".into()), "canon5d2"),
        (|v| v.lamp_spectrum = Some("led".into()), "led-5000k"),
        (
            |v| v.daylight_spectrum = Some("led-5000k".into()),
            "clear-sky",
        ),
    ];
    for ((change, known), (_, field)) in unknown.into_iter().zip(named) {
        let told = with("spectral", change).unwrap_err();
        let start = format!("vehicle.{field}");
        assert!(told.starts_with(&start) && told.contains(known), "{told}");
    }
}
