//! The command line `uw`: one file per subcommand, and what they share.
//!
//! Exit codes: 0 done, 1 a failure while running, 2 unusable arguments or input, 130 interrupted.
//! [`error`] makes them, [`output`] writes results (whole or not at all), [`interrupt`] and [`progress`] serve
//! the commands that take long, [`numbers`] reads and prints columns of numbers, [`values`] reads options.

mod adapters;
mod assets;
mod calibrate;
mod camera;
mod camera_fit;
mod dataset;
mod demo;
mod device;
mod doctor;
pub(crate) mod error;
mod error_time;
mod fit;
pub(crate) mod interrupt;
mod irradiance;
pub(crate) mod numbers;
pub(crate) mod output;
mod phase;
mod phase_model;
mod photo;
mod predict;
mod predict_physics;
pub(crate) mod progress;
mod project;
mod render;
mod scene;
mod sensor;
mod sequence;
mod shell;
mod stats;
mod undistortion;
pub(crate) mod values;
mod water;
mod water_constituents;
mod water_sight;
mod water_spectrum;
mod water_tables;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use error::CliError;

/// Renders underwater scenes, shows water as numbers, measures pictures, calibrates and predicts.
#[derive(Debug, Parser)]
#[command(name = "uw", version, after_help = ENVIRONMENT)]
struct Arguments {
    /// JSON instead of text: results of `adapters`, `camera-fit`, `doctor`, `error-time`, `render`, `sequence`, `stats` and `water` on standard
    /// output, and errors as one object on standard error.
    #[arg(long, global = true)]
    json: bool,
    /// Folder of the shipped models, profiles, vehicles, scenes and textures, from which alone they are then taken.
    #[arg(long, global = true, value_name = "DIR")]
    assets: Option<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

const ENVIRONMENT: &str = "\
Environment:
  UWGUIDE_ASSETS  Folder of the shipped files, as --assets; UW_ASSETS is its old name. Without either they are taken from `assets`
                  beside the program, `../share/uwguide` from there, `uwguide` in $XDG_DATA_HOME and $XDG_DATA_DIRS, or the program
                  itself; `uw doctor` tells from where";

/// What `uw` alone says.
const WELCOME: &str = "\
uw renders underwater scenes, measures pictures, calibrates and predicts. To begin:

  uw demo                       the whole way in two minutes: calibrate, ask the daemon, render before and after
  uw render flat_hull -o hull.png --width 320 --target-error 5%
                                a picture of a scene that ships
  uw assets --copy -o assets    the scenes, profiles and models that ship as files, to change them
  uw doctor                     what this machine has and where files come from

All commands: uw --help. One of them: uw render --help. The daemon is uwguide, the window viewer.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene file to an EXR, PNG or TIFF picture.
    Render(render::RenderArguments),
    /// Render pictures with depth and poses along a trajectory, on which the lamps move with the camera.
    Sequence(sequence::SequenceArguments),
    /// List the graphics adapters, best first.
    Adapters,
    /// Project points of the world to the picture of a scene's camera, or find the rays of image points.
    Project(project::ProjectArguments),
    /// Plane and scalar irradiances at depths below the water surface.
    Irradiance(irradiance::IrradianceArguments),
    /// Error against time on a set of scenes, with plots; or the references it needs.
    ErrorTime(error_time::ErrorTimeArguments),
    /// Values, samples or angles of a phase function.
    Phase(phase::PhaseArguments),
    /// Absorption, scattering and attenuation of a water, by its type, by what it holds or by how far one sees in it.
    Water(water::WaterArguments),
    /// Contrast and mean of pictures, in 8-bit counts.
    Stats(stats::StatsArguments),
    /// Apply the sensor of a scene to a linear picture.
    Sensor(sensor::SensorArguments),
    /// Make a calibration profile from the pictures that a manifest lists.
    Calibrate(calibrate::CalibrateArguments),
    /// Fit water and lamps to the pictures of a calibration, and make the water file for predictions by physics.
    Fit(fit::FitArguments),
    /// Make the file with which the daemon undistorts a camera's pictures.
    Undistortion(undistortion::UndistortionArguments),
    /// Find a vehicle's noise from frames of its camera, and its lamps from a data sheet.
    CameraFit(camera_fit::CameraFitArguments),
    /// Predict contrast: with a trained model for the rows of a table, or by physics from a picture.
    Predict(predict::PredictArguments),
    /// Make the water file of a known water, for predictions by physics.
    WaterTables(water_tables::WaterTablesArguments),
    /// Make a training set: render a grid of waters and views and pair the images.
    Dataset(dataset::DatasetArguments),
    /// See the whole way, small: calibrate, ask the daemon, render before and after.
    Demo(demo::DemoArguments),
    /// Make the shipped textures and models again, or copy the shipped files out of the program.
    Assets(assets::AssetsArguments),
    /// Tell what this machine and this program are, for reports of faults: processor, adapters, memory, shipped files.
    Doctor,
    /// Write the completions of a shell to standard output, as in: uw completions bash >
    /// ~/.local/share/bash-completion/completions/uw.
    Completions(shell::CompletionsArguments),
    /// Write the manual pages.
    Man(shell::ManArguments),
}

impl Command {
    fn run(&self, json: bool) -> Result<(), CliError> {
        match self {
            Self::Render(arguments) => arguments.run(json),
            Self::Sequence(arguments) => arguments.run(json),
            Self::Adapters => adapters::run(json),
            Self::Project(arguments) => arguments.run(json),
            Self::Irradiance(arguments) => arguments.run(json),
            Self::ErrorTime(arguments) => arguments.run(json),
            Self::Phase(arguments) => arguments.run(),
            Self::Water(arguments) => arguments.run(json),
            Self::Stats(arguments) => arguments.run(json),
            Self::Sensor(arguments) => arguments.run(),
            Self::Calibrate(arguments) => arguments.run(),
            Self::Fit(arguments) => arguments.run(),
            Self::Undistortion(arguments) => arguments.run(),
            Self::CameraFit(arguments) => arguments.run(json),
            Self::Predict(arguments) => arguments.run(),
            Self::WaterTables(arguments) => arguments.run(),
            Self::Dataset(arguments) => arguments.run(),
            Self::Demo(arguments) => arguments.run(),
            Self::Assets(arguments) => arguments.run(),
            Self::Doctor => doctor::run(json),
            Self::Completions(arguments) => arguments.run(),
            Self::Man(arguments) => arguments.run(),
        }
    }
}

/// The scene file that `given` means: itself, or the shipped scene of that name.
fn scene_file(given: &Path) -> Result<PathBuf, CliError> {
    uw_assets::ALL
        .named(given, "scenes", "toml")
        .map_err(CliError::input)
}

/// The model file that `--model` means: itself, or the shipped model of that name.
fn model_file(given: &Path) -> Result<PathBuf, CliError> {
    uw_assets::SMALL
        .named(given, "models", "json")
        .map_err(|error| CliError::input(format_args!("--model: {error}")))
}

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    let taken = arguments
        .assets
        .as_deref()
        .map_or(Ok(()), uw_assets::take_from);
    let done = taken
        .map_err(CliError::input)
        .and_then(|()| arguments.command.run(arguments.json));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(arguments.json),
    }
}

/// Answers arguments that did not parse, among them `--help` and `--version`.
fn refuse(error: &clap::Error) -> ExitCode {
    let json = std::env::args_os()
        .take_while(|argument| argument != "--")
        .any(|argument| argument == "--json");
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand && !json {
        error::note(WELCOME);
        return ExitCode::from(error::BAD_INPUT);
    }
    if error.use_stderr() && json {
        let text = error.render().to_string();
        let message = text.trim().trim_start_matches("error: ");
        return CliError::input(message).report(true);
    }
    // A closed standard output or error leaves nobody to tell.
    let _ = error.print();
    ExitCode::from(if error.use_stderr() {
        error::BAD_INPUT
    } else {
        0
    })
}
