//! `uw stats`: mean and contrast of pictures.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use uw_calib::PatchGrid;

use super::error::CliError;
use super::output;

/// Arguments of `uw stats`.
#[derive(Debug, Args)]
pub(super) struct StatsArguments {
    /// PNG, TIFF or JPEG pictures.
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
}

struct Measured {
    file: String,
    grid: PatchGrid,
}

impl StatsArguments {
    /// Measures all pictures, then prints a table, or a list of objects where `json`.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut measured = Vec::with_capacity(self.images.len());
        for path in &self.images {
            measured.push(Measured {
                file: path.display().to_string(),
                grid: PatchGrid::from_file(path).map_err(CliError::input)?,
            });
        }
        output::to_stdout(|out| {
            if json {
                write_json(out, &measured)
            } else {
                write_table(out, &measured)
            }
        })
    }
}

fn write_json(out: &mut dyn Write, measured: &[Measured]) -> io::Result<()> {
    let object = |Measured { file, grid }: &Measured| {
        json!({
            "file": file,
            "width": grid.width,
            "height": grid.height,
            "contrast": grid.stats.contrast,
            "mean": grid.stats.mean,
        })
    };
    let list: Vec<_> = measured.iter().map(object).collect();
    serde_json::to_writer_pretty(&mut *out, &list)?;
    writeln!(out)
}

fn write_table(out: &mut dyn Write, measured: &[Measured]) -> io::Result<()> {
    let widest = measured
        .iter()
        .map(|m| m.file.chars().count())
        .max()
        .unwrap_or(0)
        .max(4);
    writeln!(
        out,
        "{:widest$}  {:>11}  {:>23}  {:>23}",
        "file", "size", "contrast R G B", "mean R G B"
    )?;
    for Measured { file, grid } in measured {
        let size = format!("{} x {}", grid.width, grid.height);
        let triple = |v: [f64; 3]| format!("{:7.3} {:7.3} {:7.3}", v[0], v[1], v[2]);
        let (contrast, mean) = (triple(grid.stats.contrast), triple(grid.stats.mean));
        writeln!(out, "{file:widest$}  {size:>11}  {contrast}  {mean}")?;
    }
    writeln!(out, "in 8-bit counts, 0 to 255")
}
