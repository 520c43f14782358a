//! `uw stats`: mean and contrast of pictures, with and without noise.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use uw_calib::photo::{Exposed, Shot, frames};
use uw_calib::{Measured, NoiseModel, NoiseSource, Processing, StatsError, Treatment, View};

use super::camera::CameraArguments;
use super::error::{CliError, note};
use super::output;
use super::photo::PhotoArguments;

/// Arguments of `uw stats`.
#[derive(Debug, Args)]
pub(super) struct StatsArguments {
    /// PNG, TIFF or JPEG pictures, or folders of frames of one still view.
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    photo: PhotoArguments,
}

struct Row {
    file: String,
    picture: Measured,
    processing: Processing,
    told: Vec<String>,
    shot: Shot,
}

impl StatsArguments {
    /// Measures all pictures, then prints a table, or a list of objects where `json`.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let camera = self.camera.camera()?;
        let known = (camera.vehicle.as_ref(), camera.even, camera.encoding);
        let treatment = self.photo.treatment(known, &[])?;
        let rows = self
            .images
            .iter()
            .map(|path| row(path, &treatment, &camera.noise));
        let rows = rows
            .collect::<Result<Vec<Row>, _>>()
            .map_err(CliError::input)?;
        output::to_stdout(|out| {
            if json {
                write_json(out, &rows)
            } else {
                write_table(out, &rows)
            }
        })?;
        if !json {
            for row in &rows {
                for warning in warnings(row) {
                    note(format_args!("uw: warning: {}: {warning}", row.file));
                }
            }
        }
        Ok(())
    }
}

fn row(path: &Path, treatment: &Treatment, noise: &NoiseModel) -> Result<Row, StatsError> {
    let opened = treatment.open(&View {
        path,
        distance_m: None,
        exposed: Exposed::ALIKE,
    })?;
    let files = frames::files(path)?;
    let processing = files.first().map(|file| Processing::of_file(file, noise));
    Ok(Row {
        file: path.display().to_string(),
        picture: opened.measure(noise)?,
        processing: processing.transpose()?.unwrap_or_default(),
        told: opened.told().to_vec(),
        shot: files
            .first()
            .map(|file| Shot::of_file(file))
            .unwrap_or_default(),
    })
}

fn warnings(row: &Row) -> Vec<String> {
    let mut warnings = match &row.picture.detail {
        Some(detail) => detail.warnings(),
        None => vec![
            "too small to find its noise (patches of less than 3 x 3 pixels); give --vehicle, or --noise-a and --noise-b".to_owned(),
        ],
    };
    warnings.extend(row.processing.warnings());
    warnings.extend_from_slice(&row.told);
    warnings.extend(row.shot.wrong.clone());
    warnings
}

fn write_json(out: &mut dyn Write, rows: &[Row]) -> io::Result<()> {
    let object = |row: &Row| {
        let mut told = row.picture.told(Some(&row.processing), &row.shot);
        told["file"] = row.file.as_str().into();
        told["warnings"] = warnings(row).into();
        told
    };
    let list: Vec<_> = rows.iter().map(object).collect();
    serde_json::to_writer_pretty(&mut *out, &list)?;
    writeln!(out)
}

fn write_table(out: &mut dyn Write, rows: &[Row]) -> io::Result<()> {
    let widest = rows
        .iter()
        .map(|m| m.file.chars().count())
        .max()
        .unwrap_or(0)
        .max(4);
    writeln!(
        out,
        "{:widest$}  {:>11}  {:>23}  {:>23}  {:>23}  {:>23}  {:>23}  {:>17}  {:>17}",
        "file",
        "size",
        "contrast R G B",
        "mean R G B",
        "without noise R G B",
        "noise floor R G B",
        "noise R G B",
        "black % R G B",
        "full % R G B"
    )?;
    for Row { file, picture, .. } in rows {
        let grid = &picture.grid;
        let size = format!("{} x {}", grid.width, grid.height);
        let (contrast, mean) = (triple(grid.stats.contrast), triple(grid.stats.mean));
        let more = match &picture.detail {
            None => "-".to_owned(),
            Some(detail) => {
                let columns = [detail.contrast, detail.floor, detail.noise].map(triple);
                let shares = [detail.black, detail.saturated].map(percent);
                format!("{}  {}", columns.join("  "), shares.join("  "))
            }
        };
        writeln!(
            out,
            "{file:widest$}  {size:>11}  {contrast}  {mean}  {more}"
        )?;
    }
    writeln!(out, "in 8-bit counts, 0 to 255")?;
    match rows
        .iter()
        .find_map(|row| row.picture.detail.as_ref())
        .map(|d| d.source)
    {
        Some(NoiseSource::Picture) => writeln!(
            out,
            "noise from differences of neighbouring pixels: too large where texture is as fine as a pixel, too small where the camera \
             smooths; --vehicle, or --noise-a and --noise-b, give it"
        ),
        Some(NoiseSource::Sensor) => writeln!(out, "noise as it was given"),
        None => Ok(()),
    }
}

fn triple(v: [f64; 3]) -> String {
    format!("{:7.3} {:7.3} {:7.3}", v[0], v[1], v[2])
}

fn percent(share: [f64; 3]) -> String {
    let [r, g, b] = share.map(|s| 100.0 * s);
    format!("{r:5.1} {g:5.1} {b:5.1}")
}
