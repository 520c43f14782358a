//! The daemon's configuration file, TOML.
//!
//! ```toml
//! format = "uwguide-config/1"
//!
//! [objective]              # a preset and single fields over it
//! preset = "release"
//! distance_m = [0.5, 2.5]
//!
//! [limits]
//! max_connections = 16
//! idle_time_s = 60.0
//! ```

use std::fs;
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use thiserror::Error;
use uw_calib::json::{FieldError, Object};

use crate::daemon::Limits;
use crate::objective::Objective;

/// Format name and version of a configuration file.
pub const CONFIG_FORMAT: &str = "uwguide-config/1";
/// Longest idle time, s: a year, far inside what a clock can add.
const MAX_IDLE_S: f64 = 365.0 * 86_400.0;

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

/// What the daemon can be told in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Config {
    /// The objective where a request does not say otherwise.
    pub objective: Objective,
    /// What connections may take.
    pub limits: Limits,
}

impl Config {
    /// Reads and checks a configuration file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let file = path.display().to_string();
        let text = fs::read_to_string(path).map_err(|source| ConfigError::Read {
            file: file.clone(),
            source,
        })?;
        let value: Value = toml::from_str(&text).map_err(|source| ConfigError::Toml {
            file: file.clone(),
            source: Box::new(source),
        })?;
        Self::from_value(&value).map_err(|source| ConfigError::Field { file, source })
    }

    fn from_value(value: &Value) -> Result<Self, FieldError> {
        let document = Object::new(value, "")?;
        document.only(&["format", "objective", "limits"])?;
        let format = document.text("format")?;
        if format != CONFIG_FORMAT {
            let expected = format!("{CONFIG_FORMAT:?}");
            return Err(FieldError::invalid(
                "format",
                expected,
                format!("{format:?}"),
            ));
        }
        let mut config = Self::default();
        if document.get("objective").is_some() {
            config.objective = config.objective.with(&document.object("objective")?)?;
        }
        if document.get("limits").is_some() {
            config.limits = read_limits(&document.object("limits")?)?;
        }
        Ok(config)
    }
}

fn read_limits(object: &Object) -> Result<Limits, FieldError> {
    object.only(&["max_connections", "idle_time_s"])?;
    let mut limits = Limits::default();
    if let Some(value) = object.get("max_connections") {
        let field = object.path_of("max_connections");
        limits.max_connections = value
            .as_u64()
            .and_then(|count| usize::try_from(count).ok())
            .filter(|&count| count > 0)
            .ok_or_else(|| FieldError::wrong_type(field, "a whole number > 0", value))?;
    }
    if object.get("idle_time_s").is_some() {
        let seconds = object.number("idle_time_s")?;
        if !(seconds > 0.0 && seconds <= MAX_IDLE_S) {
            let expected = format!("> 0 and at most {MAX_IDLE_S} s");
            return Err(FieldError::out_of_range(
                object.path_of("idle_time_s"),
                expected,
                seconds,
            ));
        }
        limits.idle_time = Duration::from_secs_f64(seconds);
    }
    Ok(limits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Config, ConfigError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("uwguide.toml");
        fs::write(&path, text).unwrap();
        Config::read(&path)
    }

    #[test]
    fn fields_lie_over_the_defaults() {
        let config = read(
            "format = \"uwguide-config/1\"\n[objective]\npreset = \"paper\"\nlambda_d = 2\n\
             [limits]\nidle_time_s = 1.5\n",
        )
        .unwrap();
        assert_eq!(
            config.objective,
            Objective {
                lambda_d: 2.0,
                ..Objective::paper()
            }
        );
        assert_eq!(config.limits.idle_time, Duration::from_millis(1500));
        assert_eq!(
            config.limits.max_connections,
            Limits::default().max_connections
        );
    }

    #[test]
    fn wrong_files_are_refused_with_the_field() {
        let cases = [
            ("[objective]\n", "format is missing"),
            ("format = \"uwguide-config/2\"\n", "format must be"),
            (
                "format = \"uwguide-config/1\"\n[objectiv]\n",
                "did you mean objective?",
            ),
            (
                "format = \"uwguide-config/1\"\n[objective]\nlambda_c = nan\n",
                "objective.lambda_c",
            ),
            (
                "format = \"uwguide-config/1\"\n[limits]\nidle_time_s = 0\n",
                "limits.idle_time_s",
            ),
            (
                "format = \"uwguide-config/1\"\n[limits]\nmax_connections = 0\n",
                "max_connections",
            ),
            ("format = \n", "not valid TOML"),
        ];
        for (text, expected) in cases {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}
