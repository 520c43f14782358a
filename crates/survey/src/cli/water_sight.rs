//! `uw water` from how far one sees: the waters on Jerlov's scale in which it is as far.

use std::io::{self, Write};

use clap::Args;
use serde_json::json;
use uw_media::WaterType;
use uw_media::spectral::{JerlovWater, secchi_depth_m, visibility_m};

use super::error::CliError;
use super::numbers::significant;
use super::values::positive;

/// Wavelength at which attenuation is told where none is asked for, nm: that of green transmissometers.
const GREEN_NM: f64 = 532.0;
/// Wavelengths that the tables of Jerlov's types hold, nm.
const KNOWN_NM: (f64, f64) = (400.0, 700.0);
/// Logarithm of the ratio beyond which a water is none that was asked for.
const FAR: f64 = 0.15;
/// Significant digits: more than such measurements have.
const DIGITS: usize = 3;

/// Arguments of `uw water` that tell how far one sees.
#[derive(Debug, Args)]
pub(super) struct SightArguments {
    /// List how far one sees in each of the water types.
    #[arg(long, group = "task")]
    sight: bool,
    /// Depth at which a white disk (Secchi) is lost, m: the waters on Jerlov's scale with it, of ocean and of coast.
    #[arg(long, group = "task", value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    secchi_m: Option<f64>,
    /// Horizontal distance at which a diver loses a large dark object, m: the same.
    #[arg(long, group = "task", value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    visibility_m: Option<f64>,
    /// Attenuation c of a transmissometer with its wavelength, 1/m and nm, water itself included: the same.
    #[arg(long, group = "task", value_name = "C@NM", value_parser = attenuation)]
    attenuation_per_m: Option<(f64, f64)>,
}

/// What was measured of a water.
#[derive(Clone, Copy)]
enum Measured {
    SecchiM(f64),
    VisibilityM(f64),
    Attenuation { per_m: f64, nm: f64 },
}

/// A water on Jerlov's scale, and how far one sees in it.
struct Seen {
    water: JerlovWater,
    secchi_m: f64,
    visibility_m: f64,
    nm: f64,
    c_per_m: f64,
}

impl SightArguments {
    /// The waters with what was measured, or all types; `None` where neither is asked for.
    pub(super) fn waters(&self) -> Result<Option<Waters>, CliError> {
        if self.sight {
            let all = WaterType::ALL.map(|own| seen(own.into(), GREEN_NM));
            return Ok(Some(Waters(all.into())));
        }
        let measured = match (self.secchi_m, self.visibility_m, self.attenuation_per_m) {
            (Some(m), ..) => Measured::SecchiM(m),
            (_, Some(m), _) => Measured::VisibilityM(m),
            (.., Some((per_m, nm))) => Measured::Attenuation { per_m, nm },
            _ => return Ok(None),
        };
        measured.waters().map(|waters| Some(Waters(waters)))
    }
}

impl Measured {
    /// The nearest water of the ocean and of the coast, as far as they are near.
    fn waters(self) -> Result<Vec<Seen>, CliError> {
        let nm = match self {
            Self::Attenuation { nm, .. } => nm,
            _ => GREEN_NM,
        };
        let mut near = Vec::new();
        let mut ends = (f64::INFINITY, 0.0_f64);
        for series in JerlovWater::scale() {
            let mut best: Option<(f64, Seen)> = None;
            for water in series {
                let seen = seen(water, nm);
                let (own, asked) = self.compared(&seen);
                ends = (ends.0.min(own), ends.1.max(own));
                let off = (own / asked).ln().abs();
                if off < best.as_ref().map_or(FAR, |best| best.0) {
                    best = Some((off, seen));
                }
            }
            near.extend(best.map(|(_, seen)| seen));
        }
        if near.is_empty() {
            return Err(CliError::input(self.beyond(ends)));
        }
        Ok(near)
    }

    /// What was measured, in a water and as it was.
    fn compared(self, seen: &Seen) -> (f64, f64) {
        match self {
            Self::SecchiM(asked) => (seen.secchi_m, asked),
            Self::VisibilityM(asked) => (seen.visibility_m, asked),
            Self::Attenuation { per_m, .. } => (seen.c_per_m, per_m),
        }
    }

    fn beyond(self, (least, most): (f64, f64)) -> String {
        let (option, unit, asked) = match self {
            Self::SecchiM(asked) => ("--secchi-m", "m", asked),
            Self::VisibilityM(asked) => ("--visibility-m", "m", asked),
            Self::Attenuation { per_m, .. } => ("--attenuation-per-m", "1/m", per_m),
        };
        let [least, most] = [least, most].map(|value| significant(value, DIGITS));
        format!(
            "{option} must be within what is found on Jerlov's scale, {least} to {most} {unit}, got {asked}"
        )
    }
}

fn seen(water: JerlovWater, nm: f64) -> Seen {
    let spectrum = water.spectrum();
    Seen {
        water,
        secchi_m: secchi_depth_m(&spectrum),
        visibility_m: visibility_m(&spectrum),
        nm,
        c_per_m: spectrum.a.at(nm) + spectrum.b.at(nm),
    }
}

/// The waters that were found.
pub(super) struct Waters(Vec<Seen>);

impl Waters {
    /// Writes them, the ocean's first, as JSON where `json`.
    pub(super) fn write(&self, out: &mut dyn Write, json: bool) -> io::Result<()> {
        if json {
            let rows = self.0.iter().map(|seen| {
                json!({
                    "jerlov": seen.water.to_string(),
                    "secchi_m": seen.secchi_m,
                    "visibility_m": seen.visibility_m,
                    "wavelength_nm": seen.nm,
                    "c_per_m": seen.c_per_m,
                })
            });
            return writeln!(out, "{}", json!(rows.collect::<Vec<_>>()));
        }
        writeln!(out, "jerlov,secchi_m,visibility_m,wavelength_nm,c_per_m")?;
        for seen in &self.0 {
            let numbers = [seen.secchi_m, seen.visibility_m, seen.nm, seen.c_per_m];
            let numbers = numbers.map(|value| significant(value, DIGITS));
            writeln!(out, "{},{}", seen.water, numbers.join(","))?;
        }
        Ok(())
    }
}

/// An attenuation with its wavelength, as in 0.8@650.
fn attenuation(text: &str) -> Result<(f64, f64), String> {
    let wrong = || {
        format!(
            "must be an attenuation > 0 (1/m) and its wavelength from {} to {} nm, such as 0.8@650",
            KNOWN_NM.0, KNOWN_NM.1
        )
    };
    let (per_m, nm) = text.split_once('@').ok_or_else(wrong)?;
    let nm: f64 = nm.trim().parse().map_err(|_| wrong())?;
    let per_m = positive(per_m.trim()).map_err(|_| wrong())?;
    if !(KNOWN_NM.0..=KNOWN_NM.1).contains(&nm) {
        return Err(wrong());
    }
    Ok((per_m, nm))
}
