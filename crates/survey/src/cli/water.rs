//! `uw water`: Jerlov's water types in three colour channels, or by wavelength.

use std::io::{self, Write};

use clap::{ArgGroup, Args};
use serde_json::json;
use uw_media::spectral::{Response, WaterBands, WaterSpectrum};
use uw_media::{Bands, Iops, WaterType};

use super::error::CliError;
use super::numbers::significant;
use super::output;
use super::water_spectrum::{SpectrumArguments, read};

/// Significant digits of the coefficients: more than any measurement has.
const DIGITS: usize = 9;

/// Arguments of `uw water`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("task").required(true)))]
pub(super) struct WaterArguments {
    /// Water type: I, IA, IB, II, III, 1C, 3C, 5C, 7C or 9C.
    #[arg(long, group = "task", value_name = "TYPE")]
    jerlov: Option<String>,
    /// List the water types.
    #[arg(long, group = "task")]
    list: bool,
    /// A table with the columns wavelength_nm, a_per_m and b_per_m in the place of a water type.
    #[arg(long, group = "task", value_name = "FILE")]
    spectrum: Option<String>,
    /// How wavelengths become channels: mean, paper-printed, measured, camera:NAME, or three intervals in nm
    /// such as 600-700,500-600,400-500; or spectral, spectral-measured for the spectrum itself. Default: mean.
    #[arg(long, conflicts_with_all = ["list", "spectrum"])]
    bands: Option<String>,
    #[command(flatten)]
    of_spectrum: SpectrumArguments,
}

impl WaterArguments {
    /// Prints the table or the list, as JSON where `json`.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        if let Some(path) = &self.spectrum {
            let spectrum = WaterSpectrum::parse(&read(path)?)
                .map_err(|error| CliError::input(format!("{path}: {error}")))?;
            return self.of_spectrum.run(&spectrum, path, json);
        }
        let Some(name) = &self.jerlov else {
            return list(json);
        };
        let water_type: WaterType = name.parse().map_err(CliError::input)?;
        let bands = match &self.bands {
            Some(bands) => bands.parse().map_err(CliError::input)?,
            None => WaterBands::Three(Bands::default()),
        };
        let spectrum = bands.spectrum(water_type.into());
        if let Some(spectrum) = spectrum.map_err(CliError::input)? {
            return self.of_spectrum.run(&spectrum, name, json);
        }
        self.of_spectrum.refuse()?;
        let iops = bands.iops(water_type.into(), &Response::boxes());
        let iops = iops.map_err(CliError::input)?;
        output::to_stdout(|out| {
            if json {
                write_json(out, water_type, &bands, &iops)
            } else {
                write_table(out, &iops)
            }
        })
    }
}

fn list(json: bool) -> Result<(), CliError> {
    let names = WaterType::ALL.map(WaterType::name);
    output::to_stdout(|out| match json {
        true => writeln!(out, "{}", json!(names)),
        false => writeln!(out, "{}", names.join("\n")),
    })
}

fn write_table(out: &mut dyn Write, iops: &Iops) -> io::Result<()> {
    writeln!(out, "channel,a_per_m,b_per_m,c_per_m")?;
    let c = iops.c();
    for (k, channel) in ["r", "g", "b"].iter().enumerate() {
        let row = [iops.a[k], iops.b[k], c[k]].map(|value| significant(value, DIGITS));
        writeln!(out, "{channel},{}", row.join(","))?;
    }
    Ok(())
}

fn write_json(
    out: &mut dyn Write,
    water_type: WaterType,
    bands: &WaterBands,
    iops: &Iops,
) -> io::Result<()> {
    let water = json!({
        "jerlov": water_type.name(),
        "bands": bands.to_string(),
        "a_per_m": iops.a,
        "b_per_m": iops.b,
        "c_per_m": iops.c(),
    });
    writeln!(out, "{water}")
}
