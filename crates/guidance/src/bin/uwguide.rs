//! `uwguide`: guidance over TCP.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use uw_calib::Profile;
use uw_guidance::{Config, Daemon, Model, Service};

/// Suggests distance and lamp level to a vehicle, over newline-delimited JSON on TCP.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Model file (uw-mlp, version 1).
    #[arg(long)]
    model: PathBuf,
    /// Calibration profile (uw-profile/1).
    #[arg(long)]
    profile: PathBuf,
    /// Address and port to listen on; port 0 takes a free one.
    #[arg(long, default_value = "127.0.0.1:7475")]
    listen: String,
    /// Configuration file (TOML): objective and limits.
    #[arg(long)]
    config: Option<PathBuf>,
}

/// Unusable arguments or input.
const BAD_INPUT: u8 = 2;
/// A failure while running.
const FAILED: u8 = 1;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let (service, config) = match load(&arguments) {
        Ok(loaded) => loaded,
        Err(error) => {
            eprintln!("uwguide: {error}");
            return ExitCode::from(BAD_INPUT);
        }
    };
    match run(&arguments.listen, service, config) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("uwguide: {error}");
            ExitCode::from(FAILED)
        }
    }
}

fn load(arguments: &Arguments) -> Result<(Service, Config), Box<dyn Error>> {
    let config = match &arguments.config {
        Some(path) => Config::read(path)?,
        None => Config::default(),
    };
    let model = Model::read(&arguments.model)?;
    let profile = Profile::read(&arguments.profile)?;
    let name = arguments.model.display().to_string();
    Ok((Service::new(model, name, profile, config.objective), config))
}

#[tokio::main]
async fn run(listen: &str, service: Service, config: Config) -> Result<(), Box<dyn Error>> {
    let daemon = Daemon::bind(listen, service, config.limits)
        .await
        .map_err(|error| format!("cannot listen on {listen}: {error}"))?;
    let interrupted = interruption()?;
    eprintln!("uwguide listening on {}", daemon.local_addr()?);
    daemon.run(interrupted).await;
    Ok(())
}

/// Done when the process is asked to end: Ctrl-C, and SIGTERM where there is one.
#[cfg(unix)]
fn interruption() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}

/// Done when the process is asked to end: Ctrl-C.
#[cfg(not(unix))]
fn interruption() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        // Without a handler the default ends the process, which serves as well.
        let _ = tokio::signal::ctrl_c().await;
    })
}
