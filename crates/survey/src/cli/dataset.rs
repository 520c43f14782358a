//! `uw dataset`: the training set of a grid of waters and views.

use std::cell::Cell;
use std::path::PathBuf;

use clap::Args;

use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::progress::ProgressDisplay;
use crate::assets::assets_dir;
use crate::dataset::{self, DatasetConfig, DatasetError, Observer};

/// Arguments of `uw dataset`.
#[derive(Debug, Args)]
pub(super) struct DatasetArguments {
    /// The configuration (TOML, format "uw-dataset/1"); without it the grid of the paper.
    config: Option<PathBuf>,
    /// Folder for the table, its parts and the profiles; an interrupted run goes on there.
    #[arg(
        short,
        long,
        value_name = "DIR",
        required_unless_present = "print_config"
    )]
    output: Option<PathBuf>,
    /// Threads; one per core by default.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=4096))]
    threads: Option<u64>,
    /// Print the configuration with all defaults and stop.
    #[arg(long)]
    print_config: bool,
    /// No progress.
    #[arg(short, long)]
    quiet: bool,
}

impl DatasetArguments {
    pub(super) fn run(&self) -> Result<(), CliError> {
        let config = match &self.config {
            Some(path) => DatasetConfig::read(path).map_err(CliError::input)?,
            None => DatasetConfig::default(),
        };
        if self.print_config {
            let text = config.to_text().map_err(CliError::failed)?;
            return super::output::to_stdout(|out| out.write_all(text.as_bytes()));
        }
        let Some(folder) = &self.output else {
            return Err(CliError::input("-o DIR is missing"));
        };
        let assets = assets_dir().map_err(CliError::input)?;
        let cancel = cancel_flag()?;
        let display = ProgressDisplay::start(self.quiet, true);
        let last = Cell::new(0);
        let progress = |done: usize, total: usize, name: &str| {
            last.set(done);
            display.update(Some(done as f64 / total as f64), || {
                format!("{done}/{total} environments {name}")
            });
        };
        let observer = Observer {
            progress: &progress,
            cancel: &cancel,
        };
        let threads = self.threads.map(|n| n as usize);
        let result = dataset::generate(&config, folder, &assets, threads, &observer);
        display.finish();
        let summary = result.map_err(|e| match e {
            DatasetError::Interrupted { .. } => CliError::Interrupted(e.to_string()),
            DatasetError::OtherConfig { .. } | DatasetError::Environment(_) => CliError::input(e),
            other => CliError::failed(other),
        })?;
        note(format_args!(
            "{}: {} entries from {} renders of targets",
            summary.table.display(),
            summary.entries,
            summary.renders
        ));
        Ok(())
    }
}
