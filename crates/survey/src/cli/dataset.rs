//! `uw dataset`: the training set of a grid of waters and views.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use cpu_time::ProcessTime;

use super::error::{CliError, note};
use super::interrupt::cancel_flag;
use super::progress::ProgressDisplay;
use crate::dataset::{
    self, CheckPlan, Counts, DatasetConfig, DatasetError, Observer, Progress, RunOptions, Shard,
    Summary,
};
use uw_assets::assets_dir;

/// Arguments of `uw dataset`.
#[derive(Debug, Args)]
pub(super) struct DatasetArguments {
    /// The configuration (TOML, format "uw-dataset/1"); without it the grid of that name.
    config: Option<PathBuf>,
    /// Folder for renders, tables, profiles and manifest; an interrupted run goes on there.
    #[arg(
        short,
        long,
        value_name = "DIR",
        required_unless_present = "print_config"
    )]
    output: Option<PathBuf>,
    /// The grid without a configuration file.
    #[arg(long, value_parser = ["paper", "wide"], default_value = "paper", conflicts_with = "config")]
    grid: String,
    /// Make part i of n (1 <= i <= n); the part that finds all others done writes the tables.
    #[arg(long, value_name = "i/n", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// First take over what these folders hold of the same dataset.
    #[arg(long, value_name = "DIR", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Go on with what the folder holds. This is what happens anyway; the option only refuses a folder
    /// that holds nothing.
    #[arg(long)]
    resume: bool,
    /// Write every image too: PNG per lamp level, EXR per place with layers for daylight, lamps, their backscatter and depth.
    #[arg(long)]
    keep_images: bool,
    /// Instead of making anything, verify all files against their checksums and the tables against their parts, then render
    /// the images of this many random entries plainly and compare their labels. Exit 1 where something differs.
    #[arg(long, value_name = "N")]
    check: Option<usize>,
    /// Samples of each pixel of the check.
    #[arg(long, default_value_t = 4096, requires = "check")]
    check_spp: u32,
    /// Random pixels in each of the 60 patches of the check.
    #[arg(long, default_value_t = 8, requires = "check", value_parser = clap::value_parser!(u64).range(2..=10_000))]
    check_pixels: u64,
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
        let config = self.configuration()?;
        if self.print_config {
            let text = config.to_text().map_err(CliError::failed)?;
            return super::output::to_stdout(|out| out.write_all(text.as_bytes()));
        }
        let Some(folder) = &self.output else {
            return Err(CliError::input("-o DIR is missing"));
        };
        if self.resume && !folder.join("config.toml").is_file() {
            return Err(CliError::input(format_args!(
                "{}: nothing to resume, it holds no config.toml",
                folder.display()
            )));
        }
        if !self.merge.is_empty() {
            dataset::merge(&config, folder, &self.merge, &tell_user).map_err(explain)?;
        }
        if let Some(entries) = self.check {
            return self.check(&config, folder, entries);
        }
        let counts = Counts::of(&config);
        note(format_args!(
            "{} entries are pairs of {} images of {} renders: {} of daylight, {} of lamps, {} looking up",
            counts.entries,
            counts.images,
            counts.renders(),
            counts.daylight,
            counts.lamps,
            counts.upward
        ));
        let (started, cpu) = (Instant::now(), ProcessTime::now());
        let summary = self.generate(&config, folder)?;
        tell(&summary, started.elapsed(), cpu.elapsed());
        Ok(())
    }

    /// Checks labels, prints the summary and writes `check.json` into the folder.
    fn check(&self, config: &DatasetConfig, folder: &Path, entries: usize) -> Result<(), CliError> {
        if entries == 0 || self.check_spp < 2 {
            return Err(CliError::input(
                "--check and --check-spp must be at least 1 and 2",
            ));
        }
        let assets = assets_dir().map_err(CliError::input)?;
        let cancel = cancel_flag()?;
        let display = ProgressDisplay::start(self.quiet, true);
        let progress = |p: &Progress| {
            display.update(Some(p.images as f64 / p.images_total as f64), || {
                format!(
                    "{} of {} patches of {entries} images",
                    p.images, p.images_total
                )
            });
        };
        let observer = Observer {
            progress: &progress,
            tell: &|line| display.suspended(|| tell_user(line)),
            cancel: &cancel,
        };
        let plan = CheckPlan {
            entries,
            samples_per_pixel: self.check_spp,
            pixels_per_patch: self.check_pixels as usize,
        };
        let threads = self.threads.map(|n| n as usize);
        let report = dataset::check(config, folder, &assets, &plan, threads, &observer);
        display.finish();
        let report = report.map_err(explain)?;
        let text = serde_json::to_string_pretty(&report).map_err(CliError::failed)?;
        super::output::to_file(&folder.join("check.json"), |out| {
            out.write_all(text.as_bytes())
        })?;
        let wrong = report.wrong();
        note(format_args!(
            "{entries} entries: mean absolute difference {:.3} counts ({:+.3} against 0.1 + 1 %), mean {:+.3} ± {:.3}",
            report.mean_absolute, report.mean_excess, report.mean, report.mean_error
        ));
        if wrong.is_empty() {
            return Ok(());
        }
        Err(CliError::failed(format_args!(
            "{} of {entries} entries have labels further from plain renders than their errors, 0.1 counts and 1 % allow:\n{}",
            wrong.len(),
            wrong.join("\n")
        )))
    }

    fn configuration(&self) -> Result<DatasetConfig, CliError> {
        match &self.config {
            Some(path) => DatasetConfig::read(path).map_err(CliError::input),
            None => DatasetConfig::preset(&self.grid)
                .ok_or_else(|| CliError::input(format_args!("unknown grid {:?}", self.grid))),
        }
    }

    fn generate(&self, config: &DatasetConfig, folder: &Path) -> Result<Summary, CliError> {
        let assets = assets_dir().map_err(CliError::input)?;
        let cancel = cancel_flag()?;
        let display = ProgressDisplay::start(self.quiet, true);
        let progress = |p: &Progress| {
            display.update(Some(p.images as f64 / p.images_total.max(1) as f64), || {
                let left = (p.images_total - p.images) as f64 / p.images_per_s.max(1e-9);
                let left = if p.images_per_s > 0.0 {
                    format!("{left:.0} s left")
                } else {
                    String::new()
                };
                format!(
                    "{}/{} images, {:.1} images/s, {left}",
                    p.images, p.images_total, p.images_per_s
                )
            });
        };
        let observer = Observer {
            progress: &progress,
            tell: &|line| display.suspended(|| tell_user(line)),
            cancel: &cancel,
        };
        let options = RunOptions {
            shard: self.shard.unwrap_or(Shard::WHOLE),
            threads: self.threads.map(|n| n as usize),
            keep_images: self.keep_images,
        };
        let result = dataset::generate(config, folder, &assets, &options, &observer);
        display.finish();
        result.map_err(explain)
    }
}

/// Tells what a user should know about the folder's files.
fn tell_user(line: &str) {
    note(format_args!("uw: {line}"));
}

fn explain(error: DatasetError) -> CliError {
    match error {
        DatasetError::Interrupted { .. } => CliError::Interrupted(error.to_string()),
        DatasetError::OtherConfig { .. }
        | DatasetError::Config(_)
        | DatasetError::Environment(_) => CliError::input(error),
        other => CliError::failed(other),
    }
}

fn tell(summary: &Summary, wall: Duration, cpu: Duration) {
    note(format_args!(
        "{} renders made in {:.1} s ({:.1} s of processor time); exposure {} m² sr/W\n{}",
        summary.times.renders(),
        wall.as_secs_f64(),
        cpu.as_secs_f64(),
        summary.exposure,
        summary.times
    ));
    if summary.tables.is_empty() {
        note("this part is done; other parts are missing before there is a table");
    }
    for table in &summary.tables {
        note(format_args!(
            "{}: {} entries",
            table.display(),
            summary.counts.entries
        ));
    }
}
