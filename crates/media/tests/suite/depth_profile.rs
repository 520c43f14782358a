//! The daylight that typical water lets down, against Jerlov's own tables of its attenuation.
//!
//! The depth profiles give types, told apart by K_d. What is rendered has a and b of those types, which Solonenko and Mobley
//! found from the K_d of Jerlov's first edition. Kirk's K_d = √(a² + 0.256 a b) (1984; sun at the zenith, Petzold's harbour
//! water) leads back.

use std::collections::BTreeMap;

use uw_media::{WaterType, depth_profile, kirk_attenuation, spectrum};

use crate::reference::{number, rows};

/// Largest root mean square of ln(K_d / tabulated K_d), 400 to 700 nm, of all types but 1C: what the two editions differ
/// by and Kirk's formula for one height of the sun (found: 0.09 to 0.19 by the edition of 1976, 0.07 to 0.19 by that of 1968).
const RMS: f64 = 0.20;
/// The same of 1C by the edition of 1976, whose violet and blue K_d is up to half above that of 1968 (found: 0.29).
const RMS_OF_1C: f64 = 0.30;

/// ln(K_d of the coefficients / tabulated K_d) by wavelength.
fn ratios(water_type: WaterType, column: &str) -> Vec<f64> {
    let table = rows("jerlov_kd.csv").into_iter();
    let own = table.filter(|row| row["water_type"] == water_type.name());
    own.map(|row| (kd(water_type, number(&row, "wavelength_nm")) / number(&row, column)).ln())
        .collect()
}

fn kd(water_type: WaterType, wavelength_nm: f64) -> f64 {
    let at = |sample: &&uw_media::SpectralIop| sample.wavelength_nm == wavelength_nm;
    let sample = spectrum(water_type).iter().find(at);
    let sample = sample.expect("Jerlov's wavelengths are those of the coefficients");
    kirk_attenuation(sample.a, sample.b)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn every_type_attenuates_daylight_as_jerlov_measured() {
    for water_type in WaterType::ALL {
        for column in ["kd1976_per_m", "kd1968_per_m"] {
            let ratios = ratios(water_type, column);
            assert_eq!(ratios.len(), 13, "{water_type}");
            let limit = match (water_type, column) {
                (WaterType::C1, "kd1976_per_m") => RMS_OF_1C,
                _ => RMS,
            };
            let found = rms(&ratios);
            assert!(found < limit, "{water_type} {column}: {found:.3}");
        }
    }
}

/// Mean K_d from the surface down to the end of each profile, layer by layer.
#[test]
fn every_profile_lets_down_as_much_daylight_as_its_layers_tables() {
    let mut tabulated = BTreeMap::new();
    for row in rows("jerlov_kd.csv") {
        let key = (row["water_type"].clone(), row["wavelength_nm"].clone());
        tabulated.insert(key, number(&row, "kd1976_per_m"));
    }
    for at_surface in WaterType::ALL {
        let layers = depth_profile(at_surface);
        let ratios = ["450", "500", "550", "600", "650"].map(|wavelength_nm| {
            let through = |of: &dyn Fn(WaterType) -> f64| -> f64 {
                let each = layers.iter();
                each.map(|layer| of(layer.water_type) * (layer.bottom_m - layer.top_m))
                    .sum()
            };
            let nm: f64 = wavelength_nm.parse().expect("a number");
            let source = |own: WaterType| tabulated[&(own.to_string(), wavelength_nm.to_string())];
            (through(&|own| kd(own, nm)) / through(&source)).ln()
        });
        let found = rms(&ratios);
        assert!(found < RMS, "{at_surface}: {found:.3} {ratios:.2?}");
    }
}
