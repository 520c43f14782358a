//! How daylight falls with depth, by formula.

/// Kirk's share of scattering for the phase function of San Diego harbour (Petzold) and the sun at the zenith.
const KIRK: f64 = 0.256;

/// Attenuation K_d of daylight, 1/m, of absorption and scattering (1/m) at one wavelength or in one channel, with the sun at the
/// zenith: sqrt(a² + 0.256 a b) (Kirk 1984, Limnol. Oceanogr. 29, 350). A lower sun divides it by the cosine of its zenith angle
/// in the water.
pub fn kirk_attenuation(a: f64, b: f64) -> f64 {
    (a * (a + KIRK * b)).sqrt()
}
