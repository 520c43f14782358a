//! `uw camera-fit`: a vehicle's values from pictures of its camera and the data sheets of its lamps.

mod beam;
mod lamp;
mod lens;
mod level;
mod response;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::json;
use uw_render::image::{Frame, read_frame};

use super::camera::CurveName;
use super::error::{CliError, note};
use super::output;
use crate::camera_fit::noise::{NoiseFit, fit};
use uw_calib::vehicle::{Measurement, VehicleFile};

/// Arguments of `uw camera-fit`.
#[derive(Debug, Args)]
pub(super) struct CameraFitArguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The sensor's noise from two or more frames of one still view.
    Noise(NoiseFitArguments),
    /// The encoding of the counts, from an exposure series or grey cards.
    Response(response::ResponseArguments),
    /// What the lens leaves of the light towards the corners, from pictures of an evenly lit board.
    Vignetting(lens::VignettingArguments),
    /// Rid a picture of the vehicle's vignetting.
    Even(lens::EvenArguments),
    /// Intensity and cone of the lamps from a data sheet.
    Lamp(lamp::LampArguments),
    /// Intensity of a lamp by angle, from pictures of a white board in air.
    Beam(beam::BeamArguments),
    /// Light of a lamp by the level that it is set to, from pictures of a white board.
    Level(level::LevelArguments),
}

/// Where the values go.
#[derive(Debug, Args)]
struct Destination {
    /// Vehicle to write (uw-vehicle/1).
    #[arg(short, long)]
    output: PathBuf,
    /// Vehicle whose other values are kept: a shipped one's name or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = "default")]
    vehicle: String,
}

#[derive(Debug, Args)]
struct NoiseFitArguments {
    /// PNG or TIFF pictures of one view, taken one after another with camera, target, light and exposure fixed.
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// How the camera's counts stand for light, if not as the vehicle says.
    #[arg(long, value_enum)]
    encoding: Option<CurveName>,
    #[command(flatten)]
    to: Destination,
}

impl CameraFitArguments {
    /// Finds the values, writes the vehicle and tells them on standard output, as an object where `json`.
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        match &self.what {
            What::Noise(arguments) => arguments.run(json),
            What::Response(arguments) => arguments.run(json),
            What::Vignetting(arguments) => arguments.run(json),
            What::Even(arguments) => arguments.run(),
            What::Lamp(arguments) => arguments.run(json),
            What::Beam(arguments) => arguments.run(json),
            What::Level(arguments) => arguments.run(json),
        }
    }
}

impl Destination {
    /// The vehicle to start from, and that the output can be written.
    fn start(&self) -> Result<VehicleFile, CliError> {
        output::check_writable(&self.output)?;
        find(&self.vehicle)
    }

    fn write(
        &self,
        mut file: VehicleFile,
        known: BTreeMap<String, Measurement>,
    ) -> Result<(), CliError> {
        file.measured.extend(known);
        file.vehicle.check().map_err(CliError::failed)?;
        let text = file.to_text().map_err(CliError::failed)?;
        output::to_file(&self.output, |out| out.write_all(text.as_bytes()))
    }
}

/// The vehicle of `--vehicle`.
fn find(name_or_file: &str) -> Result<VehicleFile, CliError> {
    VehicleFile::find(name_or_file, Path::new(""))
        .map_err(|error| CliError::input(format_args!("--vehicle: {error}")))
}

fn frames(paths: &[PathBuf]) -> Result<Vec<Frame>, CliError> {
    let frames = paths.iter().map(|path| read_frame(path));
    frames.collect::<Result<_, _>>().map_err(CliError::input)
}

/// The files' names, for messages.
fn names(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    names.join(", ")
}

impl NoiseFitArguments {
    fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let frames = frames(&self.frames)?;
        if let Some(curve) = self.encoding {
            file.vehicle.encoding = curve.encoding();
        }
        let encoding = file.vehicle.encoding;
        let jpeg = self.frames.iter().any(|path| is_jpeg(path));
        let found = fit(&frames, encoding, jpeg)
            .map_err(|error| CliError::input(format_args!("{}: {error}", names(&self.frames))))?;
        let from = format!(
            "uw camera-fit noise: {} {} frames of {} x {} pixels, encoding {}",
            frames.len(),
            if jpeg { "JPEG" } else { "still" },
            frames[0].width,
            frames[0].height,
            encoding.name()
        );
        let measured = |error: f64| Measurement {
            error: Some(rounded(error)),
            from: from.clone(),
        };
        let known = BTreeMap::from([
            ("noise_a".to_owned(), measured(found.errors[0])),
            ("noise_b".to_owned(), measured(found.errors[1])),
        ]);
        file.vehicle.noise_a = rounded(found.noise.a);
        file.vehicle.noise_b = rounded(found.noise.b);
        self.to.write(file, known)?;
        if !json {
            for warning in &found.warnings {
                note(format_args!("uw: warning: {warning}"));
            }
        }
        output::to_stdout(|out| match json {
            true => writeln!(out, "{}", object(&found)),
            false => out.write_all(text(&found).as_bytes()),
        })
    }
}

/// To six digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Whether a file begins as JPEG files do.
fn is_jpeg(path: &Path) -> bool {
    use std::io::Read;
    let mut start = [0; 3];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && start == [0xff, 0xd8, 0xff]
}

fn object(fit: &NoiseFit) -> serde_json::Value {
    let channels = fit.channels.iter().map(|channel| {
        channel.map(|(noise, errors)| {
            json!({"noise_a": noise.a, "noise_b": noise.b, "noise_a_error": errors[0], "noise_b_error": errors[1]})
        })
    });
    json!({
        "noise_a": fit.noise.a, "noise_b": fit.noise.b, "noise_a_error": fit.errors[0], "noise_b_error": fit.errors[1],
        "channels": channels.collect::<Vec<_>>(), "gains": fit.gains, "pixels": fit.pixels,
        "correlation": fit.correlation, "misfit": fit.misfit, "warnings": fit.warnings,
    })
}

fn text(fit: &NoiseFit) -> String {
    let line = |name: &str, a: f64, b: f64, errors: [f64; 2]| {
        format!(
            "{name:8}  a = {a:.4e} ± {:.1e}   b = {b:.4e} ± {:.1e}\n",
            errors[0], errors[1]
        )
    };
    let mut told = line("noise", fit.noise.a, fit.noise.b, fit.errors);
    for (name, channel) in ["red", "green", "blue"].iter().zip(&fit.channels) {
        match channel {
            _ if fit.channels.len() == 1 => {}
            Some((noise, errors)) => told += &line(name, noise.a, noise.b, *errors),
            None => told += &format!("{name:8}  too few pixels\n"),
        }
    }
    let gains: Vec<String> = fit.gains.iter().map(|gain| format!("{gain:.4}")).collect();
    told += &format!(
        "variance of the linear signal y: a·y + b, ± one standard error; {} pixels of channels; light of the frames over their mean \
         (removed): {}; misfit {:.2}; correlation of neighbours {:+.3}\n",
        fit.pixels,
        gains.join(", "),
        fit.misfit,
        fit.correlation
    );
    told
}
