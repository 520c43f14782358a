//! `uw predict`: a trained model over the rows of a table, or physics from a picture.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use csv::{ReaderBuilder, StringRecord, Trim};
use uw_guidance::Model;

use super::error::CliError;
use super::numbers::significant;
use super::predict_physics::PhysicsArguments;
use super::{model_file, output};

/// Significant digits of the predictions.
const DIGITS: usize = 9;

/// Arguments of `uw predict`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("by").required(true)))]
pub(super) struct PredictArguments {
    /// Model file (uw-mlp, version 1), or the name of a shipped one: by a network, for the rows of INPUT.
    #[arg(long, value_name = "NAME|FILE", group = "by", requires = "input")]
    model: Option<PathBuf>,
    /// Water file (uw-water/1): by physics, from a picture, for --candidates.
    #[arg(long, group = "by", requires_all = ["image", "distance_m", "light_pct", "candidates"])]
    water: Option<PathBuf>,
    /// With --model: CSV table with a column for each input of the model, in any order; other columns are passed over.
    #[arg(conflicts_with = "water")]
    input: Option<PathBuf>,
    #[command(flatten)]
    physics: PhysicsArguments,
    /// CSV table to write, row by row, in 8-bit counts: contrast_r,contrast_g,contrast_b; with --water after distance_m and
    /// light_pct, and before the standard errors error_r,error_g,error_b.
    #[arg(short, long)]
    output: PathBuf,
}

impl PredictArguments {
    /// Predicts all rows, then writes them.
    pub(super) fn run(&self) -> Result<(), CliError> {
        output::check_writable(&self.output)?;
        let (model, input) = match (&self.model, &self.water, &self.input) {
            (_, Some(water), _) => return self.physics.run(water, &self.output),
            (Some(model), None, Some(input)) => (model, input),
            _ => return Err(CliError::input("--model needs a table of inputs")),
        };
        let model = Model::read(&model_file(model)?).map_err(CliError::input)?;
        let predictions = predict(&model, input)?;
        output::to_file(&self.output, |out| {
            writeln!(out, "contrast_r,contrast_g,contrast_b")?;
            for contrast in predictions {
                writeln!(
                    out,
                    "{}",
                    contrast.map(|counts| significant(counts, DIGITS)).join(",")
                )?;
            }
            Ok(())
        })
    }
}

fn predict(model: &Model, table: &Path) -> Result<Vec<[f64; 3]>, CliError> {
    let file = table.display();
    let unusable =
        |error: csv::Error| CliError::input(format!("{file}: not a usable table: {error}"));
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_path(table)
        .map_err(unusable)?;
    let header = reader.headers().map_err(unusable)?;
    let columns =
        columns(model, header).map_err(|error| CliError::input(format!("{file}:1: {error}")))?;
    let mut predictions = Vec::new();
    let mut inputs = Vec::with_capacity(columns.len());
    for row in reader.records() {
        let row = row.map_err(unusable)?;
        let line = row.position().map_or(0, csv::Position::line);
        inputs.clear();
        for (feature, &column) in model.inputs().iter().zip(&columns) {
            let got = row.get(column).unwrap_or_default();
            inputs.push(finite(got).ok_or_else(|| {
                let name = feature.name;
                CliError::input(format!(
                    "{file}:{line}: {name} must be a finite number, got {got:?}"
                ))
            })?);
        }
        predictions.push(model.forward(&inputs).map_err(CliError::input)?);
    }
    Ok(predictions)
}

/// The column of each input of the model.
fn columns(model: &Model, header: &StringRecord) -> Result<Vec<usize>, String> {
    let mut columns = Vec::new();
    let mut missing = Vec::new();
    for feature in model.inputs() {
        let mut found = (0..header.len()).filter(|&column| &header[column] == feature.name);
        match (found.next(), found.next()) {
            (Some(column), None) => columns.push(column),
            (Some(_), Some(_)) => return Err(format!("the column {} comes twice", feature.name)),
            (None, _) => missing.push(feature.name),
        }
    }
    if missing.is_empty() {
        Ok(columns)
    } else {
        Err(format!(
            "the table lacks the columns {} of the model",
            missing.join(", ")
        ))
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}
