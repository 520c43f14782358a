//! `uw camera-fit level`: light of a lamp by the level that it is set to.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use uw_calib::vehicle::LevelCurve;

use super::{Destination, frames, names, rounded};
use crate::camera_fit::level::{LevelFit, fit};
use crate::cli::error::CliError;
use crate::cli::output;
use uw_calib::vehicle::Measurement;

#[derive(Debug, Args)]
pub(super) struct LevelArguments {
    /// PNG or TIFF pictures of a white board that the lamp alone lights, at several levels; camera, lamp and board stand still.
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// Level that the lamp was set to in each picture, percent, in the order of the pictures; 100 must be among them. A picture at 0
    /// shows the light of the room, which is taken off.
    #[arg(
        long,
        required = true,
        value_name = "P,P,..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    level: Vec<f64>,
    /// Exposure time of each picture in any unit, in the order of the pictures, where it was not the same for all.
    #[arg(
        long,
        value_name = "X,X,..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    relative_exposure: Option<Vec<f64>>,
    #[command(flatten)]
    to: Destination,
}

impl LevelArguments {
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let frames = frames(&self.pictures)?;
        let same = vec![1.0; frames.len()];
        let exposures = self.relative_exposure.as_ref().unwrap_or(&same);
        let wrong =
            |error: String| CliError::input(format_args!("{}: {error}", names(&self.pictures)));
        let found = fit(&frames, &self.level, exposures, file.vehicle.encoding)
            .map_err(|error| wrong(error.to_string()))?;
        let points = found.curve.points().iter();
        let points = points.map(|[level, light]| [*level, rounded(*light)]);
        let curve = LevelCurve::new(points.collect()).map_err(wrong)?;
        let errors = found.points.iter().map(|[.., error]| error / 100.0);
        let known = Measurement {
            error: Some(rounded(errors.fold(0.0, f64::max))),
            from: format!(
                "uw camera-fit level: {} pictures at {:?} %; error is the largest of a level's share of light",
                frames.len(),
                self.level
            ),
        };
        file.vehicle.level_curve = Some(curve);
        self.to
            .write(file, BTreeMap::from([("level_curve".to_owned(), known)]))?;
        output::to_stdout(|out| match json {
            true => writeln!(out, "{}", object(&found)),
            false => write!(out, "{}", text(&found)),
        })
    }
}

fn object(found: &LevelFit) -> serde_json::Value {
    json!({"level_curve": found.curve.points(), "points": found.points, "spread": found.spread})
}

fn text(found: &LevelFit) -> String {
    let mut told = String::from("level, light, standard error, percent of full\n");
    for [level, light, error] in &found.points {
        told += &format!("{level:7.2} {light:8.3} {error:8.3}\n");
    }
    told + &format!(
        "light over that at level 100 differs by at most {:.1} % from place to place on the board\n",
        100.0 * found.spread
    )
}
