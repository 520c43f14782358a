//! Jerlov's ten water types and their spectra.

use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

use crate::error::MediaError;
use crate::tables::{self, TableRow};

/// A water type of Jerlov's classification: oceanic I to III, coastal 1C to 9C.
/// Turbidity rises within each of the two series, not from III to 1C.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WaterType {
    /// Clearest ocean.
    I,
    /// Oceanic.
    IA,
    /// Oceanic.
    IB,
    /// Oceanic.
    II,
    /// Most turbid ocean.
    III,
    /// Clearest coast.
    C1,
    /// Coastal.
    C3,
    /// Coastal.
    C5,
    /// Coastal.
    C7,
    /// Most turbid coast.
    C9,
}

impl WaterType {
    /// All types in the order of the classification.
    pub const ALL: [WaterType; 10] = [
        WaterType::I,
        WaterType::IA,
        WaterType::IB,
        WaterType::II,
        WaterType::III,
        WaterType::C1,
        WaterType::C3,
        WaterType::C5,
        WaterType::C7,
        WaterType::C9,
    ];

    /// The name, such as "IB" or "3C".
    pub fn name(self) -> &'static str {
        match self {
            WaterType::I => "I",
            WaterType::IA => "IA",
            WaterType::IB => "IB",
            WaterType::II => "II",
            WaterType::III => "III",
            WaterType::C1 => "1C",
            WaterType::C3 => "3C",
            WaterType::C5 => "5C",
            WaterType::C7 => "7C",
            WaterType::C9 => "9C",
        }
    }
}

impl fmt::Display for WaterType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for WaterType {
    type Err = MediaError;

    fn from_str(text: &str) -> Result<Self, MediaError> {
        Self::ALL
            .into_iter()
            .find(|water_type| water_type.name() == text)
            .ok_or_else(|| MediaError::UnknownName {
                kind: "Jerlov water type",
                got: text.to_owned(),
                known: Self::ALL.map(Self::name).join(" "),
            })
    }
}

/// Absorption and scattering at one wavelength, water itself included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpectralIop {
    /// Wavelength in air, nm.
    pub wavelength_nm: f64,
    /// Absorption, 1/m.
    pub a: f64,
    /// Scattering, 1/m.
    pub b: f64,
    /// Whether the source prints this row wrongly (only in the table as published).
    pub(crate) misprint: bool,
}

/// The spectrum of a type, 17 wavelengths from 300 to 700 nm, by increasing wavelength
/// (Solonenko & Mobley 2015, misprints repaired).
pub fn spectrum(water_type: WaterType) -> &'static [SpectralIop] {
    static TABLE: LazyLock<IopTable> = LazyLock::new(|| IopTable::parse(tables::JERLOV));
    TABLE.of(water_type)
}

/// The same spectrum as printed, with its misprints.
pub(crate) fn published_spectrum(water_type: WaterType) -> &'static [SpectralIop] {
    static TABLE: LazyLock<IopTable> = LazyLock::new(|| IopTable::parse(tables::JERLOV_PUBLISHED));
    TABLE.of(water_type)
}

/// The repaired spectrum resampled to 10 nm, 400 to 700 nm.
pub(crate) fn fine_spectrum(water_type: WaterType) -> &'static [SpectralIop] {
    static TABLE: LazyLock<IopTable> = LazyLock::new(|| IopTable::parse(tables::JERLOV_10NM));
    TABLE.of(water_type)
}

/// The measured spectrum, 10 nm (Williamson & Hollins 2022).
///
/// # Errors
/// Types that were not measured.
pub(crate) fn measured_spectrum(
    water_type: WaterType,
) -> Result<&'static [SpectralIop], MediaError> {
    static TABLE: LazyLock<IopTable> = LazyLock::new(|| IopTable::parse(tables::MEASURED));
    match TABLE.of(water_type) {
        [] => Err(MediaError::NotCovered {
            bands: "measured",
            water_type: water_type.to_string(),
            covered: WaterType::ALL
                .into_iter()
                .filter(|other| !TABLE.of(*other).is_empty())
                .map(WaterType::name)
                .collect::<Vec<_>>()
                .join(" "),
        }),
        samples => Ok(samples),
    }
}

/// Spectra per type, in the order of [`WaterType::ALL`].
struct IopTable {
    spectra: [Vec<SpectralIop>; 10],
}

impl IopTable {
    fn parse(table: &'static str) -> Self {
        let rows: Vec<TableRow> = tables::rows(table).collect();
        Self {
            spectra: WaterType::ALL.map(|water_type| {
                rows.iter()
                    .filter(|row| row.text("water_type") == water_type.name())
                    .map(|row| SpectralIop {
                        wavelength_nm: row.number("wavelength_nm"),
                        a: row.number("a_per_m"),
                        b: row.number("b_per_m"),
                        misprint: row.text_if_there("status") == Some("misprint"),
                    })
                    .collect()
            }),
        }
    }

    fn of(&self, water_type: WaterType) -> &[SpectralIop] {
        &self.spectra[water_type as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for water_type in WaterType::ALL {
            assert_eq!(water_type.to_string().parse(), Ok(water_type));
        }
        let error = "4C".parse::<WaterType>().map_err(|e| e.to_string());
        assert_eq!(
            error,
            Err(
                "unknown Jerlov water type \"4C\"; known: I IA IB II III 1C 3C 5C 7C 9C".to_owned()
            )
        );
    }

    #[test]
    fn a_name_in_the_wrong_case_is_answered_with_the_right_one() {
        for (got, meant) in [("3c", "3C"), ("ib", "IB"), (" Iii", "III")] {
            let error = got.parse::<WaterType>().map_err(|e| e.to_string());
            let error = error.err().unwrap_or_default();
            assert!(
                error.contains(&format!("did you mean {meant:?}?")),
                "{error}"
            );
        }
    }

    #[test]
    fn every_spectrum_is_complete_ordered_and_sound() {
        for water_type in WaterType::ALL {
            for (spectrum, samples) in [
                (spectrum(water_type), 17),
                (published_spectrum(water_type), 17),
                (fine_spectrum(water_type), 31),
            ] {
                assert_eq!(spectrum.len(), samples, "{water_type}");
                assert!(
                    spectrum
                        .windows(2)
                        .all(|w| w[0].wavelength_nm < w[1].wavelength_nm)
                );
                assert!(spectrum.iter().all(|s| s.a > 0.0 && s.b > 0.0));
            }
            let repaired = spectrum(water_type);
            assert!(repaired.iter().all(|sample| !sample.misprint));
            for (fixed, printed) in repaired.iter().zip(published_spectrum(water_type)) {
                if !printed.misprint {
                    assert_eq!((fixed.a, fixed.b), (printed.a, printed.b));
                }
            }
        }
    }

    #[test]
    fn the_fine_spectrum_passes_through_the_tabulated_values() {
        for water_type in WaterType::ALL {
            for sample in spectrum(water_type) {
                let fine = fine_spectrum(water_type)
                    .iter()
                    .find(|fine| fine.wavelength_nm == sample.wavelength_nm);
                if let Some(fine) = fine {
                    assert!((fine.a / sample.a - 1.0).abs() < 1e-4);
                    assert!((fine.b / sample.b - 1.0).abs() < 1e-4);
                }
            }
        }
    }
}
