//! `uweval operation`.

use std::path::PathBuf;

use uw_assets::assets_dir;

use super::interrupt::cancel_flag;
use super::progress::{Lines, note};
use crate::error::EvalError;
use crate::operation::config::OperationConfig;
use crate::operation::{self, Observer, report};

#[derive(clap::Args)]
pub(super) struct OperationArguments {
    /// Configuration (TOML, format "uw-operation/1"); `--print-config` shows the default
    #[arg(required_unless_present = "print_config")]
    config: Option<PathBuf>,
    /// Folder for views, report, plots and tables; a stopped run goes on there
    #[arg(
        short,
        long,
        value_name = "DIR",
        required_unless_present = "print_config"
    )]
    output: Option<PathBuf>,
    /// Worker threads; one per core by default
    #[arg(long)]
    threads: Option<usize>,
    /// Write the default configuration to standard output and stop
    #[arg(long)]
    print_config: bool,
}

pub(super) fn run(arguments: &OperationArguments) -> Result<(), EvalError> {
    if arguments.print_config {
        return print_config();
    }
    let (Some(config), Some(folder)) = (&arguments.config, &arguments.output) else {
        return Err(EvalError::Input("CONFIG and -o DIR are needed".into()));
    };
    let config = OperationConfig::read(config)?;
    let assets = assets_dir().map_err(|e| EvalError::Input(e.to_string()))?;
    operation::claim(&config, folder)?;
    let cancel = cancel_flag()?;
    let lines = Lines::new();
    let observer = Observer {
        progress: &|share, doing| lines.tell(share, doing),
        cancel: &cancel,
    };
    let found = operation::run(&config, folder, &assets, arguments.threads, &observer)?;
    report::write(&config, &found, folder)?;
    note(format_args!(
        "wrote {}",
        folder.join(report::REPORT).display()
    ));
    Ok(())
}

fn print_config() -> Result<(), EvalError> {
    use std::io::Write;
    let text = toml::to_string(&OperationConfig::default())
        .map_err(|e| EvalError::Input(e.to_string()))?;
    let written = std::io::stdout().lock().write_all(text.as_bytes());
    written.map_err(|e| EvalError::output("standard output".as_ref(), e))
}
