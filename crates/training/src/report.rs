//! Stage 6: what was trained on what, and how well it does; a JSON file beside the model.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use crate::columns::{CONTRAST_SCALE_COUNTS, OUTPUTS, inputs};
use crate::train::{Epoch, mae_counts, mean};
use crate::{Comparison, Error, Settings, Table, Trained, output};

/// The report of one training, format `uw-training-report/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    format: &'static str,
    made_by: String,
    dataset: Dataset,
    settings: SettingsEntry,
    split: SplitEntry,
    /// Errors over the training rows after the last epoch.
    train: Errors,
    /// Errors over the test rows after the last epoch.
    test: Errors,
    /// The learning curve.
    curve: Vec<Epoch>,
    /// Errors of this and of differently trained networks, where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    comparison: Option<Comparison>,
}

#[derive(Clone, Debug, Serialize)]
struct Dataset {
    /// File or folder name, without the folders above it.
    name: String,
    rows: usize,
    environments: Option<usize>,
}

#[derive(Clone, Debug, Serialize)]
struct SettingsEntry {
    network: String,
    loss: &'static str,
    optimiser: &'static str,
    inputs: &'static str,
    calibration: bool,
    epochs: usize,
    batch: usize,
    learning_rate: f64,
    schedule: &'static str,
    seed: u64,
}

#[derive(Clone, Debug, Serialize)]
struct SplitEntry {
    by: &'static str,
    test_fraction: f64,
    train_rows: usize,
    test_rows: usize,
    test_environments: Vec<String>,
}

/// Mean absolute errors over one set of rows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Mean over the three outputs, 8-bit counts.
    pub mae_counts: f64,
    /// The same in units of contrast / 15.
    pub mae_scaled: f64,
    /// Contrast R, 8-bit counts.
    pub mae_contrast_r_counts: f64,
    /// Contrast G, 8-bit counts.
    pub mae_contrast_g_counts: f64,
    /// Contrast B, 8-bit counts.
    pub mae_contrast_b_counts: f64,
}

impl Errors {
    /// Of predictions for the listed rows (not empty).
    pub fn of(predicted: &[[f32; OUTPUTS]], table: &Table, rows: &[usize]) -> Self {
        let per_output = mae_counts(predicted, table, rows);
        let [r, g, b] = per_output;
        Self {
            mae_counts: mean(&per_output),
            mae_scaled: mean(&per_output) / f64::from(CONTRAST_SCALE_COUNTS),
            mae_contrast_r_counts: r,
            mae_contrast_g_counts: g,
            mae_contrast_b_counts: b,
        }
    }
}

impl Report {
    /// Measures a trained network on its own rows.
    pub fn new(dataset: &Path, table: &Table, settings: &Settings, trained: &Trained) -> Self {
        let split = &trained.split;
        Self {
            format: "uw-training-report/1",
            made_by: format!("uwtrain {}", env!("CARGO_PKG_VERSION")),
            dataset: Dataset {
                name: own_name(dataset),
                rows: table.rows(),
                environments: table.environments.as_ref().map(|e| e.names.len()),
            },
            settings: SettingsEntry {
                network: format!(
                    "{1}-{0}-{0}-3 relu",
                    settings.hidden,
                    inputs(table.offsets).len()
                ),
                loss: "mean absolute error",
                optimiser: "adam",
                inputs: table.offsets.word(),
                calibration: settings.calibration,
                epochs: settings.epochs,
                batch: settings.batch,
                learning_rate: settings.learning_rate,
                schedule: settings.schedule.word(),
                seed: settings.seed,
            },
            split: SplitEntry {
                by: settings.split.word(),
                test_fraction: settings.test_fraction,
                train_rows: split.train.len(),
                test_rows: split.test.len(),
                test_environments: split.test_environments.clone(),
            },
            train: Errors::of(&trained.train_predictions, table, &split.train),
            test: Errors::of(&trained.test_predictions, table, &split.test),
            curve: trained.curve.clone(),
            comparison: None,
        }
    }

    /// The report with a comparison.
    pub fn with_comparison(self, comparison: Comparison) -> Self {
        Self {
            comparison: Some(comparison),
            ..self
        }
    }

    /// The report for people, in Markdown; `plots` names the pictures beside it.
    pub fn to_markdown(&self, plots: &[String]) -> String {
        let (settings, split) = (&self.settings, &self.split);
        let mut text = format!(
            "# Training report\n\n{} on `{}`: {} rows",
            self.made_by, self.dataset.name, self.dataset.rows
        );
        // Writing to a string cannot fail.
        if let Some(environments) = self.dataset.environments {
            let _ = write!(text, " of {environments} environments");
        }
        let _ = write!(
            text,
            ".\n\n{}, {}, Adam {} ({}), {} epochs of batches of {}, seed {}, inputs `{}`{}. Split by {}: {} rows to train, {} to test.\n\n",
            settings.network,
            settings.loss,
            settings.learning_rate,
            settings.schedule,
            settings.epochs,
            settings.batch,
            settings.seed,
            settings.inputs,
            if settings.calibration {
                ""
            } else {
                ", without calibration"
            },
            split.by,
            split.train_rows,
            split.test_rows
        );
        text.push_str("| mean absolute error | contrast / 15 | counts | R | G | B |\n|---|---|---|---|---|---|\n");
        for (name, errors) in [("training rows", &self.train), ("test rows", &self.test)] {
            let _ = writeln!(
                text,
                "| {name} | {:.4} | {:.3} | {:.3} | {:.3} | {:.3} |",
                errors.mae_scaled,
                errors.mae_counts,
                errors.mae_contrast_r_counts,
                errors.mae_contrast_g_counts,
                errors.mae_contrast_b_counts
            );
        }
        if let Some(comparison) = &self.comparison {
            text.push_str(&comparison.to_markdown());
        }
        for plot in plots {
            let _ = write!(text, "\n![{plot}]({plot})\n");
        }
        text
    }

    /// Errors over the training rows after the last epoch.
    pub fn train(&self) -> &Errors {
        &self.train
    }

    /// Errors over the test rows after the last epoch.
    pub fn test(&self) -> &Errors {
        &self.test
    }

    /// Writes the report whole or not at all.
    ///
    /// # Errors
    /// When the folder or the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        output::write_json(path, self, output::JsonLayout::Indented)
    }
}

/// The last part of a path, also of one like `.` that does not spell it.
fn own_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = full.file_name().unwrap_or(full.as_os_str());
    name.to_string_lossy().into_owned()
}
