//! What can go wrong, by cause.

use std::path::PathBuf;

/// Why a model was not made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The dataset cannot be opened or read.
    #[error("{}: cannot read the dataset: {source}", path.display())]
    Read {
        /// The dataset's file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A dataset's manifest cannot be used.
    #[error("{}: {reason}", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A model file cannot be used.
    #[error("{}: cannot be read as a model: {reason}", path.display())]
    ModelFile {
        /// The model's file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The dataset is not well-formed CSV, for example a row has too few fields.
    #[error("{}: cannot be read as a CSV table: {source}", path.display())]
    Csv {
        /// The dataset's file.
        path: PathBuf,
        /// What the CSV reader said, with the line.
        source: csv::Error,
    },
    /// The dataset is not well-formed Parquet, or holds something unexpected.
    #[error("{}: cannot be read as a Parquet table: {reason}", path.display())]
    Parquet {
        /// The dataset's file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A needed column is not in the header.
    #[error("{}: column `{column}` is missing{}; the header has {found}", path.display(), suggestion(hint))]
    MissingColumn {
        /// The dataset's file.
        path: PathBuf,
        /// The column that was looked for.
        column: &'static str,
        /// What to do about it, where there is something.
        hint: Option<&'static str>,
        /// The columns that the file has.
        found: String,
    },
    /// A column that is read stands twice in the header.
    #[error("{}: column `{column}` occurs more than once in the header", path.display())]
    DuplicateColumn {
        /// The dataset's file.
        path: PathBuf,
        /// The repeated column.
        column: &'static str,
    },
    /// A field is not a finite number.
    #[error("{}:{line}: {column} must be a finite number, got `{got}`", path.display())]
    NotFinite {
        /// The dataset's file.
        path: PathBuf,
        /// Line in the file, from 1 (the header); in Parquet the row, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// The field as it stands in the file.
        got: String,
    },
    /// A row does not say to which environment it belongs.
    #[error("{}:{line}: environment must not be empty", path.display())]
    EmptyEnvironment {
        /// The dataset's file.
        path: PathBuf,
        /// Line in the file, from 1 (the header); in Parquet the row, from 1.
        line: u64,
    },
    /// There are not enough rows to train and test on.
    #[error("{}: at least {least} rows are needed, got {got}", path.display())]
    TooFewRows {
        /// The dataset's file.
        path: PathBuf,
        /// The smallest number that is accepted.
        least: usize,
        /// Rows in the file.
        got: usize,
    },
    /// A split by environment was asked of a table that does not name any.
    #[error(
        "a split by environment needs the column `{column}`, which the dataset does not have; use a split by row"
    )]
    NoEnvironments {
        /// The column that would name them.
        column: &'static str,
    },
    /// A split by environment needs at least one environment on each side.
    #[error(
        "a split by environment needs at least 2 different environments, got {got}; use a split by row"
    )]
    TooFewEnvironments {
        /// Different environments in the dataset.
        got: usize,
    },
    /// A setting is outside its range.
    #[error("{name} must be {expected}, got {got}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// The valid range.
        expected: &'static str,
        /// The value given.
        got: String,
    },
    /// The result cannot be put where it was asked for; found before the training starts.
    #[error("{}: cannot be written: {reason}", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// Why not, and what would be right.
        reason: String,
    },
    /// The training error became infinite or NaN.
    #[error(
        "the training error is not finite in epoch {epoch}: use a smaller learning rate than {learning_rate}"
    )]
    Diverged {
        /// Epoch, from 1.
        epoch: usize,
        /// The learning rate in use.
        learning_rate: f64,
    },
    /// The tensor library failed.
    #[error("the tensor library failed: {0}")]
    Backend(String),
    /// Writing failed.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl Error {
    /// True when arguments or input are to blame, false for a failure while running.
    pub fn is_bad_input(&self) -> bool {
        !matches!(
            self,
            Self::Diverged { .. } | Self::Backend(_) | Self::Write { .. }
        )
    }
}

fn suggestion(hint: &Option<&'static str>) -> String {
    hint.map_or_else(String::new, |text| format!(" ({text})"))
}
