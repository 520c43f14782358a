//! What `uw render` says of a finished picture.

use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};
use uw_render::integrator::RenderStats;

use crate::cli::error::{CliError, note};
use crate::cli::numbers::significant;
use crate::cli::output;

/// The relative error that the summary looks ahead to.
const GOAL: f64 = 0.05;
/// Fewest samples per pixel from whose error more can be foretold.
const TELLING_SAMPLES: u64 = 8;
/// Most times as many samples that are foretold.
const FARTHEST: f64 = 1e6;

/// The contents of a file of facts.
#[derive(Serialize)]
pub(super) struct Facts<'a> {
    #[serde(flatten)]
    pub(super) stats: &'a RenderStats,
    /// What the command line said instead of the scene file.
    pub(super) changes: Vec<String>,
}

/// A finished render.
pub(super) struct RenderSummary<'a> {
    /// The picture.
    pub(super) file: &'a Path,
    /// Width and height, pixels.
    pub(super) size_px: (u32, u32),
    /// Facts.
    pub(super) stats: &'a RenderStats,
    /// From the start of the command to its end, s.
    pub(super) seconds: f64,
}

impl RenderSummary<'_> {
    /// A line on standard error unless `quiet`, or with `json` an object on standard output.
    pub(super) fn tell(&self, json: bool, quiet: bool) -> Result<(), CliError> {
        if json {
            let object = self.json();
            return output::to_stdout(|out| writeln!(out, "{object}"));
        }
        if !quiet {
            note(self.line());
        }
        Ok(())
    }

    fn line(&self) -> String {
        let (width, height) = self.size_px;
        let samples = match self.stats.coarse_step_px {
            Some(_) => "coarse".to_owned(),
            None => format!("{} samples per pixel", self.stats.samples_per_pixel),
        };
        let kind = match self.stats.denoised {
            Some(_) => "denoised (biased), estimated ",
            None => "",
        };
        let error = self.error().map_or_else(String::new, |error| {
            format!(", {kind}relative error {}", percent(error))
        });
        let ahead = self
            .to_goal()
            .map_or_else(String::new, |(samples, seconds)| {
                format!(
                    "; {} would take about {samples} samples per pixel, {}",
                    percent(GOAL),
                    time(seconds)
                )
            });
        format!(
            "{}: {width} × {height} pixels, {samples}{error}, {}{ahead}",
            self.file.display(),
            time(self.seconds)
        )
    }

    fn json(&self) -> Value {
        let stats = self.stats;
        let ahead = self.to_goal().map(|(samples, seconds)| {
            json!({"relative_error": GOAL, "samples_per_pixel": samples, "seconds": seconds})
        });
        json!({
            "file": self.file.display().to_string(),
            "width_px": self.size_px.0,
            "height_px": self.size_px.1,
            "backend": stats.backend,
            "samples_per_pixel": stats.samples_per_pixel,
            "relative_error": self.error(),
            "denoised": stats.denoised,
            "filled_pixels": stats.filled_pixels,
            "setup_s": stats.setup_s,
            "render_s": stats.render_s,
            "seconds": self.seconds,
            "ahead": ahead,
        })
    }

    fn error(&self) -> Option<f64> {
        self.stats.relative_error.filter(|error| error.is_finite())
    }

    /// Samples per pixel and seconds for an error of [`GOAL`], which falls with the square root of both; `None` where it is
    /// reached, and where too little is known.
    fn to_goal(&self) -> Option<(u64, f64)> {
        let stats = self.stats;
        let factor = (self.error()? / GOAL).powi(2);
        let is_telling = stats.samples_per_pixel >= TELLING_SAMPLES
            && stats.filled_pixels == 0
            && stats.denoised.is_none();
        let samples = (factor * stats.samples_per_pixel as f64).ceil();
        let seconds = stats.setup_s + factor * stats.render_s;
        (is_telling && (1.0..=FARTHEST).contains(&factor) && factor > 1.0)
            .then_some((samples as u64, seconds))
    }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 2))
}

/// A time in the unit that suits it.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 100.0 => (s, "s"),
        s if s < 6_000.0 => (s / 60.0, "min"),
        s if s < 200_000.0 => (s / 3_600.0, "h"),
        s => (s / 86_400.0, "days"),
    };
    format!("{} {unit}", significant(value, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_shares_are_short() {
        for (seconds, text) in [
            (0.0123, "0.012 s"),
            (12.34, "12 s"),
            (99.9, "100 s"),
            (150.0, "2.5 min"),
            (7_200.0, "2 h"),
            (864_000.0, "10 days"),
        ] {
            assert_eq!(time(seconds), text);
        }
        assert_eq!([percent(0.05), percent(0.0213)], ["5 %", "2.1 %"]);
    }
}
