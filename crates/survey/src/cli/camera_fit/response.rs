//! `uw camera-fit response`: which encoding a camera's counts have.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use uw_calib::Encoding;

use super::{Destination, frames, names};
use crate::camera_fit::response::{ResponseFit, fit};
use crate::cli::error::CliError;
use crate::cli::output;
use uw_calib::vehicle::Measurement;

#[derive(Debug, Args)]
pub(super) struct ResponseArguments {
    /// PNG or TIFF pictures of one still view at several exposure times, or of grey cards that fill the view one after another at
    /// one exposure, in light that stays as it is and falls off across them.
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// Relative light of each picture in the order of the pictures: exposure times, or reflectances of the cards.
    #[arg(
        long,
        required = true,
        value_name = "X,X,..",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    light: Vec<f64>,
    #[command(flatten)]
    to: Destination,
}

impl ResponseArguments {
    pub(super) fn run(&self, json: bool) -> Result<(), CliError> {
        let mut file = self.to.start()?;
        let frames = frames(&self.pictures)?;
        let wrong = |error: &dyn std::fmt::Display| {
            CliError::input(format_args!("{}: {error}", names(&self.pictures)))
        };
        let found = fit(&frames, &self.light).map_err(|error| wrong(&error))?;
        let from = format!(
            "uw camera-fit response: {} pictures, {}",
            frames.len(),
            known(&found)
        );
        file.vehicle.encoding = found.encoding;
        let measured = Measurement { error: None, from };
        self.to
            .write(file, BTreeMap::from([("encoding".to_owned(), measured)]))?;
        output::to_stdout(|out| match json {
            true => writeln!(out, "{}", object(&found)),
            false => writeln!(
                out,
                "encoding  {}\nthe curve: {}\ncontradiction of the pictures {:.1} % of light, scatter {:.2} counts, {} blocks of pixels",
                found.encoding.name(),
                told(&found),
                100.0 * found.contradiction,
                found.scatter_counts,
                found.blocks
            ),
        })
    }
}

/// How well the encoding is known.
fn known(found: &ResponseFit) -> String {
    if let Encoding::Curve(_) = found.encoding {
        let ends = [found.curve.first(), found.curve.last()];
        let [low, high] = ends.map(|row| row.map_or(0.0, |row| row[0]));
        return format!("seen from {low} to {high} counts, beyond as sRGB goes on");
    }
    let nearer = found.nearer();
    format!(
        "light off by {:.1} % (most {:+.1} % at {} counts)",
        100.0 * nearer.rms,
        100.0 * nearer.most,
        nearer.at_counts
    )
}

fn told(found: &ResponseFit) -> String {
    let one = found.off.map(|off| {
        format!(
            "off {} by {:.1} % of light (most {:+.1} % at {} counts)",
            off.encoding.name(),
            100.0 * off.rms,
            100.0 * off.most,
            off.at_counts
        )
    });
    one.join(", ")
}

fn object(found: &ResponseFit) -> serde_json::Value {
    let off = found.off.map(|off| {
        json!({"encoding": off.encoding.name(), "rms": off.rms, "most": off.most, "at_counts": off.at_counts})
    });
    json!({
        "encoding": found.encoding.name(), "off": off, "curve": found.curve, "contradiction": found.contradiction,
        "scatter_counts": found.scatter_counts, "blocks": found.blocks,
    })
}
