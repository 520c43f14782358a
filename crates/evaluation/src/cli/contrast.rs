//! `uweval contrast`.

use std::path::PathBuf;

use uw_assets::assets_dir;

use super::interrupt::cancel_flag;
use super::progress::note;
use crate::contrast;
use crate::error::EvalError;
use crate::operation;
use crate::operation::config::OperationConfig;

#[derive(clap::Args)]
pub(super) struct ContrastArguments {
    /// Configuration as of `uweval operation`, for its waters, target, distances and vehicle
    config: PathBuf,
    /// Folder for table, plot and text; views are shared with an operation in the same folder
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Worker threads; one per core by default
    #[arg(long)]
    threads: Option<usize>,
}

pub(super) fn run(arguments: &ContrastArguments) -> Result<(), EvalError> {
    let config = OperationConfig::read(&arguments.config)?;
    let assets = assets_dir().map_err(|e| EvalError::Input(e.to_string()))?;
    let (folder, threads) = (&arguments.output, arguments.threads);
    operation::claim(&config, folder)?;
    let cancel = cancel_flag()?;
    contrast::run(&config, folder, &assets, threads, &cancel).map_err(|e| e.or_stopped(&cancel))?;
    note(format_args!(
        "wrote {}",
        folder.join("contrast.md").display()
    ));
    Ok(())
}
