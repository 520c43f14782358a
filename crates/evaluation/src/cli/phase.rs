//! `uweval phase`.

use std::path::PathBuf;

use uw_assets::assets_dir;

use super::interrupt::cancel_flag;
use super::progress::note;
use crate::error::EvalError;
use crate::phase;

#[derive(clap::Args)]
pub(super) struct PhaseArguments {
    /// Folder for table, plot, renders and text
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Samples per pixel of the two renders
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    spp: u32,
    /// Worker threads; one per core by default
    #[arg(long)]
    threads: Option<usize>,
}

pub(super) fn run(arguments: &PhaseArguments) -> Result<(), EvalError> {
    let assets = assets_dir().map_err(|e| EvalError::Input(e.to_string()))?;
    let cancel = cancel_flag()?;
    let folder = &arguments.output;
    phase::run(folder, &assets, arguments.spp, arguments.threads, &cancel)
        .map_err(|e| e.or_stopped(&cancel))?;
    note(format_args!("wrote {}", folder.join("phase.md").display()));
    Ok(())
}
