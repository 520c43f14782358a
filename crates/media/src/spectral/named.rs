//! Spectra of light that have names.

use super::Curve;
use crate::error::MediaError;
use crate::tables;

/// Names of lamps, and where each comes from: a column of the table of CIE illuminants, or a bell (centre and width, nm).
enum Light {
    Tabulated(&'static str),
    Bell(f64, f64),
}

const LIGHTS: [(&str, Light); 14] = [
    ("halogen", Light::Tabulated("A")),
    ("led-2700k", Light::Tabulated("LED-B1")),
    ("led-3000k", Light::Tabulated("LED-B2")),
    ("led-4100k", Light::Tabulated("LED-B3")),
    ("led-5000k", Light::Tabulated("LED-B4")),
    ("led-6600k", Light::Tabulated("LED-B5")),
    ("led-bh1", Light::Tabulated("LED-BH1")),
    ("led-rgb1", Light::Tabulated("LED-RGB1")),
    ("led-v1", Light::Tabulated("LED-V1")),
    ("led-v2", Light::Tabulated("LED-V2")),
    ("led-blue", Light::Bell(450.0, 20.0)),
    ("led-green", Light::Bell(525.0, 35.0)),
    ("d50", Light::Tabulated("D50")),
    ("d65", Light::Tabulated("D65")),
];

/// Names that [`illuminant`] knows, for messages: halogen (CIE A), CIE LED-B1 to B5 by their colour temperature (K), other CIE
/// LEDs, a blue (450 nm, 20 nm wide) and a green (525 nm, 35 nm wide) LED, CIE daylight.
pub const ILLUMINANTS: &str = "halogen led-2700k led-3000k led-4100k led-5000k led-6600k led-bh1 led-rgb1 led-v1 led-v2 \
     led-blue led-green d50 d65";

/// Relative power per nm of a light that has a name.
///
/// # Errors
/// An unknown name.
pub fn illuminant(name: &str) -> Result<Curve, MediaError> {
    let light = LIGHTS.iter().find(|(known, _)| *known == name);
    match light {
        Some((_, Light::Tabulated(column))) => Ok(embedded(tables::ILLUMINANTS, column)),
        Some((_, Light::Bell(centre_nm, width_nm))) => Ok(Curve::bell(*centre_nm, *width_nm)),
        None => Err(MediaError::UnknownName {
            kind: "light",
            got: name.to_owned(),
            known: ILLUMINANTS.to_owned(),
        }),
    }
}

/// Relative irradiance per nm of the sun's beam under a clear sky, for a zenith angle in degrees, from tables for 0, 30 and
/// 60 degrees (Bird and Riordan 1986).
pub fn sunlight(zenith_deg: f64) -> Curve {
    by_zenith("direct", zenith_deg)
}

/// The same of the clear sky.
pub fn sky_light(zenith_deg: f64) -> Curve {
    by_zenith("diffuse", zenith_deg)
}

fn by_zenith(kind: &str, zenith_deg: f64) -> Curve {
    let of = |zenith: u32| embedded(tables::CLEAR_SKY, &format!("{kind}_sz{zenith}"));
    let steps = (zenith_deg / 30.0).clamp(0.0, 2.0);
    match steps < 1.0 {
        true => of(0).towards(&of(30), steps),
        false => of(30).towards(&of(60), steps - 1.0),
    }
}

/// A column of an embedded table against its wavelengths, without those of which it knows nothing.
pub(super) fn embedded(table: &'static str, column: &str) -> Curve {
    let rows = tables::rows(table).filter(|row| !row.text(column).is_empty());
    Curve::new(
        rows.map(|row| (row.number("wavelength_nm"), row.number(column)))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_spectrum() {
        let names: Vec<&str> = ILLUMINANTS.split_whitespace().collect();
        assert_eq!(names, LIGHTS.map(|(name, _)| name));
        for name in names {
            let curve = illuminant(name).expect(name);
            let largest = curve.nodes().iter().map(|node| node.1).fold(0.0, f64::max);
            assert!((largest - 1.0).abs() < 1e-9, "{name}: {largest}");
        }
        let error = illuminant("LED-5000K")
            .expect_err("another case")
            .to_string();
        assert!(error.contains("led-5000k"), "{error}");
    }

    #[test]
    fn the_sun_turns_red_towards_the_horizon() {
        let redness = |zenith_deg| {
            let sun = sunlight(zenith_deg);
            sun.at(650.0) / sun.at(450.0)
        };
        assert!(redness(60.0) > redness(45.0) && redness(45.0) > redness(0.0));
        assert!(sky_light(30.0).at(450.0) > sky_light(30.0).at(650.0));
    }
}
