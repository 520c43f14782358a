//! Stage 6: what calibration and the split are worth: the same training with and without either, and the errors
//! in environments that no training row knows.

use std::fmt::Write;

use serde::Serialize;

use crate::report::Errors;
use crate::train::Epoch;
use crate::{Error, Settings, SplitBy, Table, Trained, train};

/// Rows of an environment that is in no training row.
#[derive(Clone, Debug)]
pub struct UnseenSet {
    /// Its name in the report.
    pub name: String,
    /// Its rows.
    pub table: Table,
}

/// Errors of one kind of network, contrast / 15.
#[derive(Clone, Debug, Serialize)]
pub struct ComparedModel {
    /// Whether it has the calibration inputs.
    pub calibration: bool,
    /// Test error when single rows are kept for the test.
    pub test_by_row: f64,
    /// Test error when whole environments are kept for the test.
    pub test_by_environment: f64,
    /// Error of the first of the two in the unseen environments, in the order of [`Comparison::unseen`].
    pub unseen: Vec<f64>,
}

/// Networks with and without calibration.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Names of the unseen environments.
    pub unseen: Vec<String>,
    /// With calibration, then without.
    pub models: Vec<ComparedModel>,
}

impl Comparison {
    /// Trains what `settings` leaves to be compared with: the same with the other split, and both without
    /// calibration. `trained` is the network of `settings`; `progress` sees all epochs, with a word for the run.
    ///
    /// # Errors
    /// As [`train`].
    pub fn make(
        table: &Table,
        settings: &Settings,
        trained: &Trained,
        unseen: &[UnseenSet],
        mut progress: impl FnMut(&str, &Epoch, &Settings),
    ) -> Result<Self, Error> {
        let mut models = Vec::new();
        for calibration in [true, false] {
            let mut tests = [0.0; 2];
            let mut errors = Vec::new();
            for (test, split) in tests.iter_mut().zip([SplitBy::Row, SplitBy::Environment]) {
                let settings = Settings {
                    calibration,
                    split,
                    ..settings.clone()
                };
                let word = run_word(&settings);
                let fresh;
                let result = if calibration == trained.calibration && split == trained.by {
                    trained
                } else {
                    fresh = train(table, &settings, |epoch| progress(&word, epoch, &settings))?;
                    &fresh
                };
                *test = Errors::of(&result.test_predictions, table, &result.split.test).mae_scaled;
                if split == SplitBy::Row {
                    errors = unseen.iter().map(|set| unseen_error(result, set)).collect();
                }
            }
            models.push(ComparedModel {
                calibration,
                test_by_row: tests[0],
                test_by_environment: tests[1],
                unseen: errors,
            });
        }
        Ok(Self {
            unseen: unseen.iter().map(|set| set.name.clone()).collect(),
            models,
        })
    }

    /// As a table in Markdown.
    pub fn to_markdown(&self) -> String {
        let mut text =
            "\n## With and without calibration\n\nMean absolute error, contrast / 15.\n\n\
                        | network | test, split by row | test, split by environment |"
                .to_owned();
        // Writing to a string cannot fail.
        for name in &self.unseen {
            let _ = write!(text, " {name} |");
        }
        text.push_str("\n|---|---|---|");
        text.push_str(&"---|".repeat(self.unseen.len()));
        text.push('\n');
        for model in &self.models {
            let word = if model.calibration { "with" } else { "without" };
            let _ = write!(
                text,
                "| {word} calibration | {:.4} | {:.4} |",
                model.test_by_row, model.test_by_environment
            );
            for error in &model.unseen {
                let _ = write!(text, " {error:.4} |");
            }
            text.push('\n');
        }
        text
    }
}

fn run_word(settings: &Settings) -> String {
    let with = if settings.calibration {
        "with"
    } else {
        "without"
    };
    format!("{with} calibration, split by {}", settings.split.word())
}

fn unseen_error(trained: &Trained, set: &UnseenSet) -> f64 {
    let rows: Vec<usize> = (0..set.table.rows()).collect();
    let predicted = trained.model.predict(&set.table.inputs);
    Errors::of(&predicted, &set.table, &rows).mae_scaled
}
