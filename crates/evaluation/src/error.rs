//! Why an evaluation could not be made.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use uw_calib::ProfileError;
use uw_guidance::ModelError;
use uw_guidance::physics::WaterFileError;
use uw_media::MediaError;
use uw_render::image::ImageError;
use uw_render::integrator::RenderError;
use uw_survey::fit::{FitError, ReportError, WaterError};
use uw_twin::environment::EnvironmentError;
use uw_twin::routine::RoutineError;

use crate::niqe::{NiqeError, PristineError};
use crate::operation::config::ConfigError;
use crate::vision::VisionError;

/// Why an evaluation could not be made.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// Arguments or input cannot be used.
    #[error("{0}")]
    Input(String),
    /// The configuration cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The water's parameters are wrong.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// A water or a target cannot be made.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The calibration failed.
    #[error(transparent)]
    Routine(#[from] RoutineError),
    /// The calibration profile cannot answer.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// The model file cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No water can be fitted to the calibration's pictures.
    #[error("[twin]: {0}")]
    Fit(#[source] Box<FitError>),
    /// A fitted water's file cannot be made.
    #[error(transparent)]
    FittedWater(#[from] WaterError),
    /// The report of a fit cannot be written.
    #[error(transparent)]
    FitReport(#[from] ReportError),
    /// A water file cannot be used.
    #[error(transparent)]
    WaterFile(#[from] WaterFileError),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A vision step failed.
    #[error(transparent)]
    Vision(#[from] VisionError),
    /// An image has no NIQE.
    #[error(transparent)]
    Niqe(#[from] NiqeError),
    /// NIQE's model cannot be used.
    #[error(transparent)]
    Pristine(#[from] PristineError),
    /// The guidance gave no advice.
    #[error("no advice at {depth_m} m depth: {reason}")]
    NoAdvice {
        /// Depth, m.
        depth_m: f64,
        /// What the guidance says.
        reason: String,
    },
    /// A result cannot be written.
    #[error("{path}: {reason}")]
    Output {
        /// The file or folder.
        path: String,
        /// What is wrong.
        reason: String,
    },
    /// The user stopped the run.
    #[error("stopped; finished views are kept, the same command goes on with them")]
    Interrupted,
}

impl EvalError {
    /// A file or folder that cannot be written.
    pub fn output(path: &Path, reason: impl std::fmt::Display) -> Self {
        Self::Output {
            path: path.display().to_string(),
            reason: reason.to_string(),
        }
    }

    /// This error, or [`EvalError::Interrupted`] when it is the consequence of a stop.
    pub fn or_stopped(self, cancel: &AtomicBool) -> Self {
        if cancel.load(Ordering::Relaxed) {
            Self::Interrupted
        } else {
            self
        }
    }

    /// Whether arguments or input are to blame.
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::Input(_)
                | Self::Config(_)
                | Self::Media(_)
                | Self::Environment(_)
                | Self::Model(_)
                | Self::WaterFile(_)
        )
    }
}
