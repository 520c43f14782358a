//! `uw camera-fit beam`: a lamp's intensity by angle from pictures of a white board in air.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Destination, frames, names, rounded};
use crate::camera_fit::beam::{BeamFit, Board, fit};
use crate::cli::error::{CliError, note};
use crate::cli::output;
use uw_calib::vehicle::Measurement;

#[derive(Debug, Args)]
pub(super) struct BeamArguments {
    /// PNG or TIFF pictures of a white board that one lamp alone lights, in air in a dark room.
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// Distance from camera and lamp to the board, m; the board stands across the camera's axis.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    distance_m: f64,
    /// How far the lamp is to the right of the camera, m (negative: to the left); its axis is along the camera's.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    lamp_right_m: f64,
    /// Horizontal field of view in air, degrees (behind a flat port wider than the vehicle's under water).
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    hfov_deg: f64,
    /// Diffuse reflectance of the board.
    #[arg(
        long,
        value_name = "R",
        default_value_t = 0.9,
        allow_hyphen_values = true
    )]
    reflectance: f64,
    /// Exposure time of the pictures over that of the vehicle's `exposure`.
    #[arg(
        long,
        value_name = "X",
        default_value_t = 1.0,
        allow_hyphen_values = true
    )]
    relative_exposure: f64,
    #[command(flatten)]
    to: Destination,
}

impl BeamArguments {
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let frames = frames(&self.pictures)?;
        let board = Board {
            distance_m: self.distance_m,
            reflectance: self.reflectance,
            lamp_right_m: self.lamp_right_m,
            hfov_deg: self.hfov_deg,
            relative_exposure: self.relative_exposure,
        };
        let found = fit(&frames, &board, &file.vehicle)
            .map_err(|error| CliError::input(format_args!("{}: {error}", names(&self.pictures))))?;
        let last = found.profile.last().map_or(0.0, |row| row[0]);
        let vehicle = &mut file.vehicle;
        vehicle.lamp_intensity = rounded(found.intensity_w_per_sr);
        vehicle.lamp_half_angle_deg = rounded(last);
        let rows = found.profile.iter().map(|row| row.map(rounded));
        vehicle.lamp_profile = Some(rows.collect());
        let from = format!(
            "uw camera-fit beam: {} pictures of a board of reflectance {} at {} m, lamp {} m to the right",
            frames.len(),
            self.reflectance,
            self.distance_m,
            self.lamp_right_m
        );
        let known = ["lamp_intensity", "lamp_half_angle_deg", "lamp_profile"].map(|field| {
            let known = Measurement {
                error: None,
                from: from.clone(),
            };
            (field.to_owned(), known)
        });
        self.to.write(file, BTreeMap::from(known))?;
        if !found.ends && !json {
            note(format_args!(
                "uw: warning: the beam goes on beyond what the pictures show ({last:.1} degrees): what is beyond counts as dark; add \
                 pictures from nearer"
            ));
        }
        output::to_stdout(|out| match json {
            true => writeln!(out, "{}", object(&found)),
            false => writeln!(out, "{}", text(&found)),
        })
    }
}

fn object(found: &BeamFit) -> serde_json::Value {
    json!({
        "lamp_intensity": found.intensity_w_per_sr, "lamp_profile": found.profile, "spread": found.spread,
        "half_deg": found.half_deg, "ends": found.ends, "off_cosine": found.off_cosine,
    })
}

fn text(found: &BeamFit) -> String {
    let half = found.half_deg.map_or_else(
        || "beyond the picture".to_owned(),
        |angle| format!("{angle:.2} degrees from the axis"),
    );
    let widest = found.spread.iter().copied().fold(0.0, f64::max);
    format!(
        "lamp_intensity  {:.5e} W/sr in each channel, if the vehicle's exposure is right\nlamp_profile    {} rows; half of the intensity \
         is left at {half}\npixels of a row spread by at most {:.1} %, the profile is off a cosine by {:.1} % down to half (of the \
         intensity on the axis)",
        found.intensity_w_per_sr,
        found.profile.len(),
        100.0 * widest,
        100.0 * found.off_cosine
    )
}
