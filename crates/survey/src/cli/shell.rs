//! `uw completions` and `uw man`: what a shell and `man` know of the commands.

use std::fs;
use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::error::CliError;
use super::{Arguments, output};

/// Arguments of `uw completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionsArguments {
    /// The shell.
    shell: Shell,
}

impl CompletionsArguments {
    /// Writes the script to standard output.
    pub(super) fn run(&self) -> Result<(), CliError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "uw", &mut script);
        output::to_stdout(|out| out.write_all(&script))
    }
}

/// Arguments of `uw man`.
#[derive(Debug, Args)]
pub(super) struct ManArguments {
    /// Folder for a page of each command, as in `uw-render.1`; made where it is missing. Without it the page of `uw` goes to
    /// standard output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl ManArguments {
    /// Writes the pages.
    pub(super) fn run(&self) -> Result<(), CliError> {
        let Some(folder) = &self.output else {
            let page = clap_mangen::Man::new(Arguments::command());
            return output::to_stdout(|mut out| page.render(&mut out));
        };
        fs::create_dir_all(folder)
            .and_then(|()| clap_mangen::generate_to(Arguments::command(), folder))
            .map_err(|error| CliError::failed(format_args!("{}: {error}", folder.display())))
    }
}
