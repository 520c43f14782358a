//! `uw water`: Jerlov's water types and other waters in three colour channels or by wavelength.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use serde_json::json;
use uw_media::spectral::{JerlovWater, Response, WaterBands, WaterSpectrum};
use uw_media::{Bands, Iops, WaterType};

use super::error::CliError;
use super::numbers::significant;
use super::output;
use super::water_constituents::ConstituentArguments;
use super::water_sight::SightArguments;
use super::water_spectrum::{Sheet, SpectrumArguments, read_water};

/// Significant digits of the coefficients: more than any measurement has.
const DIGITS: usize = 9;

/// Arguments of `uw water`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("task").required(true)))]
pub(super) struct WaterArguments {
    /// Water type: I, IA, IB, II, III, 1C, 3C, 5C, 7C or 9C; or what lies between two, such as IB-II@0.4.
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
    #[arg(long, conflicts_with_all = ["list", "spectrum", "sight", "chlorophyll_mg_m3", "secchi_m", "visibility_m", "attenuation_per_m"])]
    bands: Option<String>,
    #[command(flatten)]
    holding: ConstituentArguments,
    #[command(flatten)]
    sight: SightArguments,
    #[command(flatten)]
    of_spectrum: SpectrumArguments,
    /// CSV file to write in the place of standard output, as `spectrum` of a scene reads it where the water is by wavelength.
    #[arg(short, long)]
    output: Option<PathBuf>,
}

impl WaterArguments {
    /// Prints the table or the list, as JSON where `json`.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        if let Some(path) = &self.output {
            output::check_writable(path)?;
        }
        if let Some(holding) = self.holding.constituents()? {
            let backscatter_fraction = Some(holding.backscatter_fraction());
            let (spectrum, name) = (holding.spectrum(), holding.to_string());
            return self.by_wavelength(&spectrum, &name, backscatter_fraction, json);
        }
        if let Some(path) = &self.spectrum {
            let spectrum = read_water(path)?;
            return self.by_wavelength(&spectrum, path, None, json);
        }
        let Some(name) = &self.jerlov else {
            self.of_spectrum.refuse()?;
            return match self.sight.waters()? {
                Some(waters) => self.written(|out| waters.write(out, json)),
                None => self.written(|out| list(out, json)),
            };
        };
        let water: JerlovWater = name.parse().map_err(CliError::input)?;
        let bands = match &self.bands {
            Some(bands) => bands.parse().map_err(CliError::input)?,
            None => WaterBands::Three(Bands::default()),
        };
        let spectrum = bands.spectrum(water);
        if let Some(spectrum) = spectrum.map_err(CliError::input)? {
            return self.by_wavelength(&spectrum, name, None, json);
        }
        self.of_spectrum.refuse()?;
        let iops = bands.iops(water, &Response::boxes());
        let iops = iops.map_err(CliError::input)?;
        self.written(|out| {
            if json {
                write_json(out, water, &bands, &iops)
            } else {
                write_table(out, &iops)
            }
        })
    }

    fn by_wavelength(
        &self,
        water: &WaterSpectrum,
        name: &str,
        backscatter_fraction: Option<f64>,
        json: bool,
    ) -> Result<(), CliError> {
        let sheet = Sheet {
            water,
            name,
            backscatter_fraction,
        };
        let output = self.output.as_deref();
        self.of_spectrum.run(&sheet, output, json)
    }

    /// Writes to the file or to standard output.
    fn written(
        &self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), CliError> {
        output::to_file_or_stdout(self.output.as_deref(), write)
    }
}

fn list(out: &mut dyn Write, json: bool) -> io::Result<()> {
    let names = WaterType::ALL.map(WaterType::name);
    match json {
        true => writeln!(out, "{}", json!(names)),
        false => writeln!(out, "{}", names.join("\n")),
    }
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
    water: JerlovWater,
    bands: &WaterBands,
    iops: &Iops,
) -> io::Result<()> {
    let document = json!({
        "jerlov": water.to_string(),
        "bands": bands.to_string(),
        "a_per_m": iops.a,
        "b_per_m": iops.b,
        "c_per_m": iops.c(),
    });
    writeln!(out, "{document}")
}
