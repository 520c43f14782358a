//! The daemon's configuration file, TOML; `default.toml` beside this file shows all of it.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use thiserror::Error;
use uw_calib::Encoding;
use uw_calib::json::{FieldError, Object};

use crate::links::dvl::DvlConfig;
use crate::links::mavlink::MavlinkConfig;
use crate::links::ros2::Ros2Config;
use crate::links::rosbridge::RosbridgeConfig;
use crate::log::LogConfig;
use crate::tls::TlsFiles;
use uw_guidance::daemon::Limits;
use uw_guidance::operations::files::exposure;
use uw_guidance::service::Settings;

mod links;
mod photographs;
mod sections;
mod vehicle;

/// Format name and version of a configuration file.
pub const CONFIG_FORMAT: &str = "uwguide-config/1";
/// The text of a configuration file with every default and an explanation.
pub const DEFAULT_CONFIG: &str = include_str!("default.toml");
/// Longest token, bytes.
const MAX_TOKEN_BYTES: usize = 4096;
/// Shortest token, bytes: 16 are 96 bits in base64.
const MIN_TOKEN_BYTES: usize = 16;

/// Why a configuration cannot be used.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// File name.
        file: String,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{file}: not valid TOML: {source}")]
    Toml {
        /// File name.
        file: String,
        /// What the parser found, with line and column.
        source: Box<toml::de::Error>,
    },
    /// A field is wrong.
    #[error("{file}: {source}")]
    Field {
        /// File name.
        file: String,
        /// The field and what is wrong with it.
        source: FieldError,
    },
}

/// What contrast is predicted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PredictorKind {
    /// A model file.
    Network,
    /// A water file.
    Physics,
}

/// What the daemon can be told in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Config {
    /// What answers are made with; the token is read by [`Config::read_token`].
    pub settings: Settings,
    /// What connections may take.
    pub limits: Limits,
    /// File whose first line clients have to show.
    pub token_file: Option<PathBuf>,
    /// What contrast is predicted from; a water file means physics, else a network.
    pub predictor: Option<PredictorKind>,
    /// The water file.
    pub water: Option<PathBuf>,
    /// The vehicle: the name of a shipped one or a file.
    pub vehicle: Option<String>,
    /// How the camera's counts stand for light, where `[images]` says it.
    pub encoding: Option<Encoding>,
    /// What of pictures is left out: polygons or a picture.
    pub mask: Option<PathBuf>,
    /// From the camera's pictures to those of the ideal camera.
    pub undistortion: Option<PathBuf>,
    /// Files of TLS.
    pub tls: Option<TlsFiles>,
    /// Loopback address of metrics and health checks.
    pub metrics: Option<String>,
    /// Names for which metrics are served, beside those of this machine.
    pub metrics_hosts: Vec<String>,
    /// Logs.
    pub log: LogConfig,
    /// File that requests and replies are recorded in.
    pub record: Option<PathBuf>,
    /// Whether new logs and recordings may be read by their group.
    pub group_may_read: bool,
    /// A Doppler log.
    pub dvl: Option<DvlConfig>,
    /// An autopilot.
    pub mavlink: Option<MavlinkConfig>,
    /// ROS 2 itself.
    pub ros2: Ros2Config,
    /// ROS through rosbridge.
    pub rosbridge: Option<RosbridgeConfig>,
}

impl Config {
    /// Reads and checks a configuration file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let file = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|source| ConfigError::Read {
            file: file.clone(),
            source,
        })?;
        Self::parse(&text, &file)
    }

    /// Checks the text of a configuration file; `file` is for messages.
    pub fn parse(text: &str, file: &str) -> Result<Self, ConfigError> {
        let file = file.to_owned();
        let value: Value = toml::from_str(text).map_err(|source| ConfigError::Toml {
            file: file.clone(),
            source: Box::new(source),
        })?;
        sections::config(&value).map_err(|source| ConfigError::Field { file, source })
    }

    /// Puts the token of the token file into the settings.
    pub fn read_token(&mut self) -> Result<(), ConfigError> {
        let Some(path) = &self.token_file else {
            return Ok(());
        };
        let file = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|source| ConfigError::Read {
            file: file.clone(),
            source,
        })?;
        let token = text.lines().next().unwrap_or_default().trim().to_owned();
        if !(MIN_TOKEN_BYTES..=MAX_TOKEN_BYTES).contains(&token.len()) {
            let expected = format!("{MIN_TOKEN_BYTES} to {MAX_TOKEN_BYTES} bytes long");
            let got = format!("{} bytes", token.len());
            let source = FieldError::out_of_range("the token in the first line", expected, got);
            return Err(ConfigError::Field { file, source });
        }
        self.settings.token = Some(token);
        Ok(())
    }

    /// Files of this configuration that others than their owner can read although they should not.
    pub fn exposures(&self) -> Vec<String> {
        let key = self.tls.as_ref().map(|tls| tls.key.as_path());
        let secrets = self.token_file.as_deref().into_iter().chain(key);
        let written = self
            .record
            .as_deref()
            .into_iter()
            .chain(self.log.file.as_deref());
        secrets
            .map(|file| exposure(file, false))
            .chain(written.map(|file| exposure(file, self.group_may_read)))
            .flatten()
            .collect()
    }
}

/// The object of a section, if the file has it.
fn section<'a>(document: &Object<'a>, name: &str) -> Result<Option<Object<'a>>, FieldError> {
    match document.get(name) {
        None => Ok(None),
        Some(_) => document.object(name).map(Some),
    }
}

#[cfg(test)]
mod tests;
