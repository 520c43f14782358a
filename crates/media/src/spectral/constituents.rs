//! Water from what it holds: chlorophyll, yellow substance, minerals.

use std::fmt;

use super::{WaterSpectrum, named};
use crate::error::{MediaError, check};
use crate::tables;

/// Chlorophyll below which particles of the open ocean are no longer told by it, mg/m³.
const LEAST_CHLOROPHYLL_MG_M3: f64 = 0.02;
/// Chlorophyll from which on its particles scatter all wavelengths alike, mg/m³.
const GRAY_CHLOROPHYLL_MG_M3: f64 = 2.0;
/// Wavelength of which the backscatter fraction is told, nm.
const MIDDLE_NM: f64 = 550.0;
/// Share of the light that molecules scatter backwards.
const MOLECULES: f64 = 0.5;
/// Absorption of minerals at 443 nm and scattering, m²/g.
const MINERALS_M2_PER_G: [f64; 2] = [0.041, 0.5];
/// Share of the light that minerals scatter backwards: 0.012 m²/g (Neukermans et al. 2012) of their scattering.
const MINERALS_BACKWARDS: f64 = 0.024;

/// What natural sea water holds besides water and salt. Statistics of many seas stand behind it: a single place may well differ by
/// a factor of two.
///
/// * Phytoplankton and what goes with it: a = 0.06 A(λ) chl^0.65 (Prieur and Sathyendranath 1981, Morel 1991),
///   b = 0.416 chl^0.766 (λ / 550 nm)^ν with ν = (lg chl - 0.3) / 2, 0 from 2 mg/m³ on (Loisel and Morel 1998, Morel and
///   Maritorena 2001), of which 0.002 + 0.01 (0.5 - 0.25 lg chl) goes backwards.
/// * Yellow substance (CDOM): a = a(440 nm) exp(-0.014 (λ - 440 nm)); where it is not told, a fifth of what phytoplankton absorbs
///   at 440 nm (Morel and Maritorena 2001).
/// * Minerals: a = 0.041 m²/g exp(-0.0123 (λ - 443 nm)) (Babin et al. 2003, J. Geophys. Res. 108, 3211), b = 0.5 m²/g at every
///   wavelength (Babin et al. 2003, Limnol. Oceanogr. 48, 843), of which 2.4 % goes backwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constituents {
    chlorophyll_mg_m3: f64,
    cdom_440_per_m: f64,
    minerals_g_m3: f64,
}

impl Constituents {
    /// Water with chlorophyll, in [0, 100] mg/m³, with yellow substance that absorbs `cdom_440_per_m` at 440 nm, in [0, 20] 1/m
    /// (as much as goes with the chlorophyll where it is `None`), and with minerals, in [0, 2000] g/m³.
    ///
    /// # Errors
    /// A value outside its range.
    pub fn new(
        chlorophyll_mg_m3: f64,
        cdom_440_per_m: Option<f64>,
        minerals_g_m3: f64,
    ) -> Result<Self, MediaError> {
        let in_range = |field, value: f64, expected, most: f64| {
            check(field, value, expected, (0.0..=most).contains(&value))
        };
        let chlorophyll_mg_m3 = in_range(
            "chlorophyll_mg_m3",
            chlorophyll_mg_m3,
            "in [0, 100] mg/m3",
            100.0,
        )?;
        let with_chlorophyll = 0.2 * phytoplankton_440(chlorophyll_mg_m3);
        let cdom_440_per_m = cdom_440_per_m.unwrap_or(with_chlorophyll);
        Ok(Self {
            chlorophyll_mg_m3,
            cdom_440_per_m: in_range("cdom_440_per_m", cdom_440_per_m, "in [0, 20] 1/m", 20.0)?,
            minerals_g_m3: in_range("minerals_g_m3", minerals_g_m3, "in [0, 2000] g/m3", 2000.0)?,
        })
    }

    /// Absorption and scattering, water itself included (Pope and Fry 1997; Zhang et al. 2009), 400 to 700 nm.
    pub fn spectrum(&self) -> WaterSpectrum {
        let pure = |column| named::embedded(tables::PURE_WATER, column);
        let seen = named::embedded(tables::CHLOROPHYLL, "relative");
        let water = (pure("a_pope_fry"), pure("b_sea_zhang2009"));
        let [mineral_a, mineral_b] = MINERALS_M2_PER_G.map(|per_g| per_g * self.minerals_g_m3);
        let a = seen.map(|nm, relative| {
            water.0.at(nm)
                + relative * phytoplankton_440(self.chlorophyll_mg_m3)
                + self.cdom_440_per_m * (-0.014 * (nm - 440.0)).exp()
                + mineral_a * (-0.0123 * (nm - 443.0)).exp()
        });
        let b = seen.map(|nm, _| water.1.at(nm) + self.phytoplankton_b(nm) + mineral_b);
        WaterSpectrum { a, b }
    }

    /// Share of the light that is scattered backwards, at 550 nm, molecules included.
    pub fn backscatter_fraction(&self) -> f64 {
        let molecules = named::embedded(tables::PURE_WATER, "b_sea_zhang2009");
        let lg = self.chlorophyll_mg_m3.max(LEAST_CHLOROPHYLL_MG_M3).log10();
        let parts = [
            (molecules.at(MIDDLE_NM), MOLECULES),
            (
                self.phytoplankton_b(MIDDLE_NM),
                0.002 + 0.01 * (0.5 - 0.25 * lg),
            ),
            (
                MINERALS_M2_PER_G[1] * self.minerals_g_m3,
                MINERALS_BACKWARDS,
            ),
        ];
        let all: f64 = parts.iter().map(|(b, _)| b).sum();
        let backwards: f64 = parts.iter().map(|(b, share)| b * share).sum();
        backwards / all
    }

    /// Scattering of phytoplankton and what goes with it, 1/m.
    fn phytoplankton_b(&self, nm: f64) -> f64 {
        let chl = self.chlorophyll_mg_m3;
        let slope = match chl < GRAY_CHLOROPHYLL_MG_M3 {
            true => 0.5 * (chl.max(LEAST_CHLOROPHYLL_MG_M3).log10() - 0.3),
            false => 0.0,
        };
        0.416 * chl.powf(0.766) * (nm / MIDDLE_NM).powf(slope)
    }
}

impl fmt::Display for Constituents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "chlorophyll {} mg/m3, CDOM {:.3} 1/m at 440 nm, minerals {} g/m3",
            self.chlorophyll_mg_m3, self.cdom_440_per_m, self.minerals_g_m3
        )
    }
}

/// Absorption of phytoplankton at 440 nm, 1/m.
fn phytoplankton_440(chlorophyll_mg_m3: f64) -> f64 {
    0.06 * chlorophyll_mg_m3.powf(0.65)
}
