//! `uw water` by wavelength: a spectrum as a table, a plot, and what three bands make wrong at a range.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use plotters::prelude::*;
use serde_json::json;
use uw_media::Iops;
use uw_media::spectral::{Curve, Response, WaterSpectrum, illuminant, read_columns};
use uw_render::image::{ImageError, write_frame};

use super::error::CliError;
use super::numbers::significant;
use super::output;
use super::water_constituents::phase_entry;
use uw_plot::{bitmap, use_font};

/// Significant digits of the coefficients: more than any measurement has.
const DIGITS: usize = 6;
/// Size of a plot, pixels.
const PLOT_PX: (u32, u32) = (900, 560);

/// Arguments of `uw water` that go with a spectrum.
#[derive(Debug, Args)]
pub(super) struct SpectrumArguments {
    /// The camera whose bands are compared with the spectrum: a name, or a CSV file with wavelength_nm,r,g,b.
    /// Three boxes (600-700, 500-600, 400-500 nm) without it.
    #[arg(long, value_name = "NAME|FILE")]
    response: Option<String>,
    /// The light: a name such as led-5000k, or a CSV file with wavelength_nm,relative; without it the same at every wavelength.
    #[arg(long, value_name = "NAME|FILE")]
    light: Option<String>,
    /// How far the light goes through the water, m (there and back): what three bands make of it is compared with the spectrum.
    #[arg(long, value_name = "M")]
    range_m: Option<f64>,
    /// Writes a plot of a, b and c (PNG).
    #[arg(long, value_name = "OUT.png")]
    plot: Option<PathBuf>,
}

/// A water by wavelength as it is told.
pub(super) struct Sheet<'a> {
    pub(super) water: &'a WaterSpectrum,
    pub(super) name: &'a str,
    /// Share of the light that is scattered backwards, where it is known.
    pub(super) backscatter_fraction: Option<f64>,
}

/// Light that is left after a range, per channel: by wavelength and as three bands have it.
struct AfterRange {
    range_m: f64,
    left: [f64; 3],
    wideband: [f64; 3],
}

impl SpectrumArguments {
    /// Writes `sheet` to the file `to` or to standard output, as JSON where `json`. What is left after a range is no part of
    /// a table that goes to a file, which scenes read.
    pub(super) fn run(
        &self,
        sheet: &Sheet<'_>,
        to: Option<&Path>,
        json: bool,
    ) -> Result<(), CliError> {
        let response = self.response()?;
        let light = self.light()?;
        let seen = Seen {
            water: sheet.water,
            response: &response,
            light: light.as_ref(),
        };
        let iops = seen.near_zero_range();
        let after = match self.range_m {
            Some(range_m) if !(0.0..=1e4).contains(&range_m) => {
                return Err(CliError::input(format!(
                    "--range-m must be a length in [0, 10000] m, got {range_m}"
                )));
            }
            Some(range_m) => Some(seen.after(range_m)),
            None => None,
        };
        if let Some(path) = &self.plot {
            plot(sheet.water, sheet.name, path)?;
        }
        if json {
            return output::to_file_or_stdout(to, |out| {
                write_json(out, sheet, &response.name, &iops, after.as_ref())
            });
        }
        output::to_file_or_stdout(to, |out| write_table(out, sheet))?;
        let Some(after) = after else {
            return Ok(());
        };
        output::to_stdout(|out| write_range(out, &iops, &after, to.is_none()))
    }

    /// An error where an argument was given that only a spectrum has use for.
    pub(super) fn refuse(&self) -> Result<(), CliError> {
        let given = [
            (self.response.is_some(), "--response"),
            (self.light.is_some(), "--light"),
            (self.range_m.is_some(), "--range-m"),
            (self.plot.is_some(), "--plot"),
        ];
        match given.iter().find(|(given, _)| *given) {
            Some((_, name)) => Err(CliError::input(format!(
                "{name} goes with --bands spectral, --bands spectral-measured, --spectrum FILE or --chlorophyll-mg-m3"
            ))),
            None => Ok(()),
        }
    }

    fn response(&self) -> Result<Response, CliError> {
        let Some(response) = &self.response else {
            return Ok(Response::boxes());
        };
        match Path::new(response).extension() {
            None => Response::named(response).map_err(CliError::input),
            Some(_) => Response::parse(&read(response)?, response)
                .map_err(|error| CliError::input(format!("{response}: {error}"))),
        }
    }

    fn light(&self) -> Result<Option<Curve>, CliError> {
        let Some(light) = &self.light else {
            return Ok(None);
        };
        let curve = match Path::new(light).extension() {
            None => illuminant(light).map_err(CliError::input)?,
            Some(_) => {
                let [curve] = read_columns(&read(light)?, ["relative"], None)
                    .map_err(|error| CliError::input(format!("{light}: {error}")))?;
                curve
            }
        };
        Ok(Some(curve))
    }
}

/// The water of a table that an option names.
pub(super) fn read_water(path: &str) -> Result<WaterSpectrum, CliError> {
    WaterSpectrum::parse(&read(path)?).map_err(|error| CliError::input(format!("{path}: {error}")))
}

/// The text of a file that an option names.
fn read(path: &str) -> Result<String, CliError> {
    fs::read_to_string(path).map_err(|error| CliError::input(format!("{path}: {error}")))
}

/// A water as a camera sees it in a light.
struct Seen<'a> {
    water: &'a WaterSpectrum,
    response: &'a Response,
    light: Option<&'a Curve>,
}

impl Seen<'_> {
    /// Mean of `of` per channel, weighted by response and light.
    fn mean(&self, of: impl Fn(f64) -> f64) -> [f64; 3] {
        let shone = |nm: f64| self.light.map_or(1.0, |curve| curve.at(nm));
        let range_nm = Some(self.water.range_nm());
        let lit = self.response.channel_values(range_nm, shone);
        let sum = self
            .response
            .channel_values(range_nm, |nm| shone(nm) * of(nm));
        std::array::from_fn(|k| sum[k] / lit[k])
    }

    /// Coefficients that three bands have near zero range.
    fn near_zero_range(&self) -> Iops {
        Iops {
            a: self.mean(|nm| self.water.a.at(nm)),
            b: self.mean(|nm| self.water.b.at(nm)),
        }
    }

    fn after(&self, range_m: f64) -> AfterRange {
        AfterRange {
            range_m,
            left: self.mean(|nm| (-range_m * (self.water.a.at(nm) + self.water.b.at(nm))).exp()),
            wideband: self.near_zero_range().c().map(|c| (-range_m * c).exp()),
        }
    }
}

fn write_table(out: &mut dyn Write, sheet: &Sheet<'_>) -> io::Result<()> {
    let water = sheet.water;
    if let Some(backscatter_fraction) = sheet.backscatter_fraction {
        writeln!(out, "# {}", sheet.name)?;
        writeln!(out, "# phase = {}", phase_entry(backscatter_fraction))?;
    }
    writeln!(out, "wavelength_nm,a_per_m,b_per_m,c_per_m")?;
    for (&(nm, a), &(_, b)) in water.a.nodes().iter().zip(water.b.nodes()) {
        let row = [nm, a, b, a + b].map(|value| significant(value, DIGITS));
        writeln!(out, "{}", row.join(","))?;
    }
    Ok(())
}

/// What is left after a range, beneath another table where `beneath`.
fn write_range(
    out: &mut dyn Write,
    iops: &Iops,
    after: &AfterRange,
    beneath: bool,
) -> io::Result<()> {
    if beneath {
        writeln!(out)?;
    }
    writeln!(
        out,
        "channel,c_per_m,range_m,light_left,light_left_wideband,ratio"
    )?;
    for (k, channel) in ["r", "g", "b"].iter().enumerate() {
        let (left, wideband) = (after.left[k], after.wideband[k]);
        let row = [iops.c()[k], after.range_m, left, wideband, left / wideband];
        let row = row.map(|value| significant(value, DIGITS));
        writeln!(out, "{channel},{}", row.join(","))?;
    }
    Ok(())
}

fn write_json(
    out: &mut dyn Write,
    sheet: &Sheet<'_>,
    response: &str,
    iops: &Iops,
    after: Option<&AfterRange>,
) -> io::Result<()> {
    let water = sheet.water;
    let column = |curve: &Curve| curve.nodes().iter().map(|node| node.1).collect::<Vec<_>>();
    let wavelengths: Vec<f64> = water.a.nodes().iter().map(|node| node.0).collect();
    let range = after.map(|after| {
        json!({
            "range_m": after.range_m,
            "light_left": after.left,
            "light_left_wideband": after.wideband,
        })
    });
    let mut document = json!({
        "water": sheet.name,
        "wavelength_nm": wavelengths,
        "a_per_m": column(&water.a),
        "b_per_m": column(&water.b),
        "response": response,
        "wideband": {"a_per_m": iops.a, "b_per_m": iops.b, "c_per_m": iops.c()},
        "range": range,
    });
    if let Some(backscatter_fraction) = sheet.backscatter_fraction {
        document["backscatter_fraction"] = json!(backscatter_fraction);
    }
    writeln!(out, "{document}")
}

fn plot(water: &WaterSpectrum, name: &str, path: &Path) -> Result<(), CliError> {
    use_font().map_err(CliError::failed)?;
    let c: Vec<(f64, f64)> = water
        .a
        .nodes()
        .iter()
        .map(|&(nm, a)| (nm, a + water.b.at(nm)))
        .collect();
    let highest = c.iter().map(|point| point.1).fold(1e-9, f64::max);
    let (low_nm, high_nm) = water.range_nm();
    let frame = bitmap(PLOT_PX, |area| {
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        let mut chart = ChartBuilder::on(area)
            .caption(format!("water {name}"), ("sans-serif", 24))
            .margin(14)
            .x_label_area_size(48)
            .y_label_area_size(64)
            .build_cartesian_2d(low_nm..high_nm, 0.0..1.05 * highest)
            .map_err(|e| e.to_string())?;
        chart
            .configure_mesh()
            .x_desc("wavelength, nm")
            .y_desc("1/m")
            .axis_desc_style(("sans-serif", 17))
            .label_style(("sans-serif", 15))
            .draw()
            .map_err(|e| e.to_string())?;
        for (curve, colour, label) in [
            (water.a.nodes(), RED, "a, absorption"),
            (water.b.nodes(), BLUE, "b, scattering"),
            (&c[..], BLACK, "c, attenuation"),
        ] {
            chart
                .draw_series(LineSeries::new(
                    curve.iter().copied(),
                    colour.stroke_width(2),
                ))
                .map_err(|e| e.to_string())?
                .label(label)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(2))
                });
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperMiddle)
            .background_style(WHITE)
            .label_font(("sans-serif", 16))
            .draw()
            .map_err(|e| e.to_string())?;
        area.present().map_err(|e| e.to_string())
    })
    .map_err(CliError::failed)?;
    write_frame(path, &frame).map_err(|error| match error {
        ImageError::System { .. } => CliError::failed(error),
        other => CliError::input(other),
    })
}
