//! `uwtrain`: a dataset in, a model file and a report out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use uw_training::columns::CONTRAST_SCALE_COUNTS;
use uw_training::train::Epoch;
use uw_training::{Error, Offsets, Report, Settings, SplitBy, Table, output, train};

/// Trains the network that predicts image contrast after a move of vehicle or lamp.
///
/// Exit 0 when done, 2 for unusable arguments or input, 1 for a failure while running.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// CSV file made by `uw dataset`, or a folder that holds dataset.csv
    dataset: PathBuf,
    /// Model file to write; an existing file is replaced
    #[arg(short, long, value_name = "MODEL.json")]
    output: PathBuf,
    /// Passes over the training rows
    #[arg(long, default_value_t = Settings::default().epochs)]
    epochs: usize,
    /// Rows per step of the optimiser
    #[arg(long, default_value_t = Settings::default().batch)]
    batch: usize,
    /// Seed of the split, the initial weights and the order of the rows
    #[arg(long, default_value_t = Settings::default().seed)]
    seed: u64,
    /// Step size of Adam
    #[arg(long, default_value_t = Settings::default().learning_rate, allow_negative_numbers = true)]
    learning_rate: f64,
    /// Part of the rows or environments kept for the test, between 0 and 1
    #[arg(long, default_value_t = Settings::default().test_fraction, allow_negative_numbers = true)]
    test_fraction: f64,
    /// What is kept for the test: single rows, or whole environments (needs the column `environment`)
    #[arg(long, value_enum, default_value_t = SplitArgument::Row)]
    split: SplitArgument,
    /// How the candidate move is given to the network: as changes or as absolute values
    #[arg(long, value_enum, default_value_t = InputsArgument::Delta)]
    inputs: InputsArgument,
    /// Leave the nine calibration inputs out
    #[arg(long)]
    no_calibration: bool,
    /// Folder for the report, made if missing [default: beside the model]
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum SplitArgument {
    Row,
    Environment,
}

#[derive(Clone, Copy, ValueEnum)]
enum InputsArgument {
    Delta,
    Target,
}

impl Arguments {
    fn settings(&self) -> Settings {
        Settings {
            epochs: self.epochs,
            batch: self.batch,
            learning_rate: self.learning_rate,
            test_fraction: self.test_fraction,
            split: match self.split {
                SplitArgument::Row => SplitBy::Row,
                SplitArgument::Environment => SplitBy::Environment,
            },
            calibration: !self.no_calibration,
            seed: self.seed,
        }
    }

    fn offsets(&self) -> Offsets {
        match self.inputs {
            InputsArgument::Delta => Offsets::Delta,
            InputsArgument::Target => Offsets::Target,
        }
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("uwtrain: {error}");
            ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let settings = arguments.settings();
    settings.check()?;
    let report_path = output::report_path(
        &arguments.dataset,
        &arguments.output,
        arguments.report.as_deref(),
    )?;
    let table = Table::read(&arguments.dataset, arguments.offsets())?;
    announce(&arguments.dataset, &table, &settings);
    let trained = train(&table, &settings, |epoch| print_epoch(epoch, &settings))?;
    let report = Report::new(&arguments.dataset, &table, &settings, &trained);
    trained.model.write(&arguments.output)?;
    report.write(&report_path)?;
    eprintln!(
        "test MAE {:.4} counts ({:.5} of contrast/15), train MAE {:.4} counts",
        report.test().mae_counts,
        report.test().mae_scaled,
        report.train().mae_counts,
    );
    eprintln!(
        "wrote {} and {}",
        arguments.output.display(),
        report_path.display()
    );
    Ok(())
}

fn announce(dataset: &Path, table: &Table, settings: &Settings) {
    let environments = table.environments.as_ref().map_or(0, |e| e.names.len());
    eprintln!(
        "{}: {} rows, {environments} environments; {} epochs of batches of {}, split by {}, seed {}",
        dataset.display(),
        table.rows(),
        settings.epochs,
        settings.batch,
        settings.split.word(),
        settings.seed,
    );
}

fn print_epoch(epoch: &Epoch, settings: &Settings) {
    let scaled = |counts: f64| counts / f64::from(CONTRAST_SCALE_COUNTS);
    eprintln!(
        "epoch {:>3}/{}: train MAE {:.4} counts ({:.5}), test MAE {:.4} counts ({:.5}), {:.2} s",
        epoch.epoch,
        settings.epochs,
        epoch.train_mae_counts,
        scaled(epoch.train_mae_counts),
        epoch.test_mae_counts,
        scaled(epoch.test_mae_counts),
        epoch.seconds,
    );
}
