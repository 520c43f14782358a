//! `uwtrain`: a dataset in, a model file and a report out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use uw_training::columns::CONTRAST_SCALE_COUNTS;
use uw_training::train::Epoch;
use uw_training::{
    Comparison, Error, Model, Offsets, Pictures, Report, Schedule, Settings, SplitBy, Table,
    Trained, UnseenSet, output, plots, train,
};

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
    /// Train nothing: write this model again, its weights as they are, with the ranges, residuals and camera of the
    /// dataset it was trained on
    #[arg(long, value_name = "MODEL.json", conflicts_with_all = ["compare", "unseen", "report"])]
    describe: Option<PathBuf>,
    /// Manifest of the dataset, which names camera, lamps and textures; several for a joined table [default:
    /// manifest.json beside the dataset]
    #[arg(long, value_name = "MANIFEST.json")]
    manifest: Vec<PathBuf>,
    /// Units in each of the two hidden layers
    #[arg(long, default_value_t = Settings::default().hidden)]
    hidden: usize,
    /// How the step size changes over the training
    #[arg(long, value_enum, default_value_t = ScheduleArgument::Constant)]
    schedule: ScheduleArgument,
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
    /// How the candidate move is given to the network: as changes, as absolute values, or as absolute values with
    /// the calibration at the candidate's distance
    #[arg(long, value_enum, default_value_t = InputsArgument::Delta)]
    inputs: InputsArgument,
    /// Leave the nine calibration inputs out
    #[arg(long)]
    no_calibration: bool,
    /// Also train with the other split and without calibration, and put the errors side by side
    #[arg(long)]
    compare: bool,
    /// A dataset of environments that the other does not hold, and its name in the comparison
    #[arg(long, value_name = "NAME=DATASET", value_parser = unseen_argument, requires = "compare")]
    unseen: Vec<(String, PathBuf)>,
    /// Folder for the report, made if missing [default: beside the model]
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum ScheduleArgument {
    Constant,
    Cosine,
}

fn unseen_argument(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, path)) if !name.is_empty() && !path.is_empty() => {
            Ok((name.to_owned(), PathBuf::from(path)))
        }
        _ => Err(format!("must be NAME=DATASET, got {text:?}")),
    }
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
    Ahead,
}

impl Arguments {
    fn settings(&self) -> Settings {
        Settings {
            hidden: self.hidden,
            schedule: match self.schedule {
                ScheduleArgument::Constant => Schedule::Constant,
                ScheduleArgument::Cosine => Schedule::Cosine,
            },
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
            InputsArgument::Ahead => Offsets::Ahead,
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

/// Writes a model again with what its dataset says about where it can be trusted.
fn describe(model_path: &Path, arguments: &Arguments) -> Result<(), Error> {
    output::report_path(&arguments.dataset, &arguments.output, None)?;
    let mut model = Model::read(model_path)?;
    let table = read_table(arguments, model.offsets(model_path)?)?;
    let rows: Vec<usize> = (0..table.rows()).collect();
    model.describe(&table, &rows, table.pictures.as_ref());
    model.write(&arguments.output)?;
    eprintln!("wrote {}", arguments.output.display());
    Ok(())
}

/// The dataset with what its manifest says.
fn read_table(arguments: &Arguments, offsets: Offsets) -> Result<Table, Error> {
    let pictures = Pictures::read(&arguments.dataset, &arguments.manifest)?;
    if pictures.is_none() {
        eprintln!(
            "no manifest beside {}: the model will not say for which camera, lamps and sun it is; --manifest names one",
            arguments.dataset.display()
        );
    }
    let table = Table::read(&arguments.dataset, offsets)?;
    Ok(Table { pictures, ..table })
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    if let Some(model) = &arguments.describe {
        return describe(model, arguments);
    }
    let settings = arguments.settings();
    settings.check()?;
    let report_path = output::report_path(
        &arguments.dataset,
        &arguments.output,
        arguments.report.as_deref(),
    )?;
    let table = read_table(arguments, arguments.offsets())?;
    let unseen = read_unseen(arguments)?;
    announce(&arguments.dataset, &table, &settings);
    let trained = train(&table, &settings, |epoch| print_epoch(epoch, &settings))?;
    let mut report = Report::new(&arguments.dataset, &table, &settings, &trained);
    if arguments.compare {
        let tell = |word: &str, epoch: &Epoch, settings: &Settings| {
            eprint!("{word}: ");
            print_epoch(epoch, settings);
        };
        let comparison = Comparison::make(&table, &settings, &trained, &unseen, tell)?;
        report = report.with_comparison(comparison);
    }
    trained.model.write(&arguments.output)?;
    report.write(&report_path)?;
    write_pictures(&report, &report_path, &table, &trained)?;
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

fn read_unseen(arguments: &Arguments) -> Result<Vec<UnseenSet>, Error> {
    let read = |(name, path): &(String, PathBuf)| {
        Ok(UnseenSet {
            name: name.clone(),
            table: Table::read(path, arguments.offsets())?,
        })
    };
    arguments.unseen.iter().map(read).collect()
}

/// The plots and the report for people, beside the report.
fn write_pictures(
    report: &Report,
    report_path: &Path,
    table: &Table,
    trained: &Trained,
) -> Result<(), Error> {
    let beside = |ending: &str| report_path.with_extension("").with_extension(ending);
    let (curve, scatter) = (beside("curve.png"), beside("scatter.png"));
    plots::learning_curve(&curve, &trained.curve)?;
    plots::predicted_against_true(&scatter, table, trained)?;
    let names = [&curve, &scatter].map(|path| {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    });
    output::write_text(&beside("report.md"), &report.to_markdown(&names))
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
