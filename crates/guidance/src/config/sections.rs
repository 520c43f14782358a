//! The sections of the configuration file.

use std::path::PathBuf;
use std::time::Duration;

use serde_json::Value;
use tracing::level_filters::LevelFilter;
use uw_calib::json::{FieldError, Object, array, number};

use super::{CONFIG_FORMAT, Config, links, section};
use crate::beams::BeamGeometry;
use crate::daemon::{Limits, TlsFiles};
use crate::feed::MaxAge;
use crate::operations::log::LogConfig;
use crate::service::{ImagePolicy, steering_with};

/// Longest time that can be given, s: a year, far inside what a clock can add.
const MAX_TIME_S: f64 = 365.0 * 86_400.0;
/// Most connections: what a process can have open.
const MAX_CONNECTIONS: usize = 65_536;
/// Highest rate of requests that can be given, 1/s.
const MAX_RATE_PER_S: f64 = 1e9;

const SECTIONS: [&str; 10] = [
    "format",
    "objective",
    "checks",
    "limits",
    "max_age",
    "steering",
    "beams",
    "images",
    "security",
    "tls",
];

pub(super) fn config(value: &Value) -> Result<Config, FieldError> {
    let document = Object::new(value, "")?;
    let known: Vec<&str> = SECTIONS
        .into_iter()
        .chain(["operations", "dvl", "mavlink", "rosbridge"])
        .collect();
    document.only(&known)?;
    let format = document.text("format")?;
    if format != CONFIG_FORMAT {
        let expected = format!("{CONFIG_FORMAT:?}");
        let got = format!("{format:?}");
        return Err(FieldError::invalid("format", expected, got));
    }
    let mut config = Config::default();
    let settings = &mut config.settings;
    if let Some(objective) = section(&document, "objective")? {
        settings.objective = settings.objective.with(&objective)?;
    }
    if let Some(checks) = section(&document, "checks")? {
        settings.checks = settings.checks.with(&checks)?;
    }
    if let Some(steering) = section(&document, "steering")? {
        settings.steering = steering_with(&settings.steering, &steering)?;
    }
    if let Some(ages) = section(&document, "max_age")? {
        settings.max_age = max_age(&ages)?;
    }
    if let Some(geometry) = section(&document, "beams")? {
        settings.beams = beams(&geometry)?;
    }
    if let Some(images) = section(&document, "images")? {
        images.only(&["directory"])?;
        if let Some(directory) = path(&images, "directory")? {
            settings.images = ImagePolicy::Under(directory);
        }
    }
    if let Some(object) = section(&document, "limits")? {
        config.limits = limits(&object)?;
    }
    if let Some(security) = section(&document, "security")? {
        security.only(&["token_file"])?;
        config.token_file = path(&security, "token_file")?;
    }
    if let Some(object) = section(&document, "tls")? {
        config.tls = tls(&object)?;
    }
    if let Some(object) = section(&document, "operations")? {
        operations(&object, &mut config)?;
    }
    if let Some(object) = section(&document, "dvl")? {
        config.dvl = links::dvl(&object)?;
    }
    if let Some(object) = section(&document, "mavlink")? {
        config.mavlink = links::mavlink(&object)?;
    }
    if let Some(object) = section(&document, "rosbridge")? {
        config.rosbridge = links::rosbridge(&object)?;
    }
    Ok(config)
}

fn limits(object: &Object) -> Result<Limits, FieldError> {
    object.only(&[
        "max_connections",
        "idle_time_s",
        "max_requests_per_s",
        "write_time_s",
    ])?;
    let mut limits = Limits::default();
    if let Some(value) = object.get("max_connections") {
        let expected = format!("a whole number from 1 to {MAX_CONNECTIONS}");
        limits.max_connections = value
            .as_u64()
            .and_then(|count| usize::try_from(count).ok())
            .filter(|count| (1..=MAX_CONNECTIONS).contains(count))
            .ok_or_else(|| {
                FieldError::wrong_type(object.path_of("max_connections"), expected, value)
            })?;
    }
    let mut seconds = [limits.idle_time, limits.write_time].map(|time| time.as_secs_f64());
    positive(object, "idle_time_s", MAX_TIME_S, &mut seconds[0])?;
    positive(object, "write_time_s", MAX_TIME_S, &mut seconds[1])?;
    [limits.idle_time, limits.write_time] = seconds.map(Duration::from_secs_f64);
    positive(
        object,
        "max_requests_per_s",
        MAX_RATE_PER_S,
        &mut limits.max_requests_per_s,
    )?;
    Ok(limits)
}

fn max_age(object: &Object) -> Result<MaxAge, FieldError> {
    object.only(&["depth_s", "distance_s", "light_s", "image_s"])?;
    let mut ages = MaxAge::default();
    positive(object, "depth_s", MAX_TIME_S, &mut ages.depth_s)?;
    positive(object, "distance_s", MAX_TIME_S, &mut ages.distance_s)?;
    positive(object, "light_s", MAX_TIME_S, &mut ages.light_s)?;
    positive(object, "image_s", MAX_TIME_S, &mut ages.image_s)?;
    Ok(ages)
}

fn beams(object: &Object) -> Result<BeamGeometry, FieldError> {
    object.only(&["tilt_deg", "azimuths_deg"])?;
    let mut beams = BeamGeometry::default();
    if object.get("tilt_deg").is_some() {
        beams.tilt_deg = object.number("tilt_deg")?;
    }
    if let Some(value) = object.get("azimuths_deg") {
        let path = object.path_of("azimuths_deg");
        beams.azimuths_deg = array(value, &path)?
            .iter()
            .enumerate()
            .map(|(k, item)| number(item, &format!("{path}[{k}]")))
            .collect::<Result<_, _>>()?;
    }
    beams.check().map_err(|error| error.within("beams"))?;
    Ok(beams)
}

fn tls(object: &Object) -> Result<Option<TlsFiles>, FieldError> {
    object.only(&["certificate", "key", "client_ca"])?;
    let files = (path(object, "certificate")?, path(object, "key")?);
    let client_ca = path(object, "client_ca")?;
    match files {
        (Some(certificate), Some(key)) => Ok(Some(TlsFiles {
            certificate,
            key,
            client_ca,
        })),
        (None, None) if client_ca.is_none() => Ok(None),
        (None, _) => Err(FieldError::missing(object.path_of("certificate"))),
        (_, None) => Err(FieldError::missing(object.path_of("key"))),
    }
}

fn operations(object: &Object, config: &mut Config) -> Result<(), FieldError> {
    object.only(&["metrics", "log_level", "log_format", "log_file", "record"])?;
    if object.get("metrics").is_some() {
        config.metrics = Some(object.text("metrics")?.to_owned());
    }
    config.record = path(object, "record")?;
    config.log = log(object)?;
    Ok(())
}

fn log(object: &Object) -> Result<LogConfig, FieldError> {
    let mut log = LogConfig {
        file: path(object, "log_file")?,
        ..LogConfig::default()
    };
    if object.get("log_level").is_some() {
        let text = object.text("log_level")?;
        let names = ["error", "warn", "info", "debug", "trace", "off"];
        let level = text.parse::<LevelFilter>().ok();
        log.level = level.filter(|_| names.contains(&text)).ok_or_else(|| {
            let expected = format!("one of {}", names.join(", "));
            FieldError::invalid(object.path_of("log_level"), expected, format!("{text:?}"))
        })?;
    }
    if object.get("log_format").is_some() {
        let field = object.path_of("log_format");
        log.json = match object.text("log_format")? {
            "text" => false,
            "json" => true,
            other => {
                let got = format!("{other:?}");
                return Err(FieldError::invalid(field, "\"text\" or \"json\"", got));
            }
        };
    }
    Ok(log)
}

/// A number > 0, where there is one.
pub(super) fn positive(
    object: &Object,
    name: &str,
    most: f64,
    value: &mut f64,
) -> Result<(), FieldError> {
    if object.get(name).is_none() {
        return Ok(());
    }
    let given = object.number(name)?;
    if !(given > 0.0 && given <= most) {
        let expected = format!("> 0 and at most {most}");
        return Err(FieldError::out_of_range(
            object.path_of(name),
            expected,
            given,
        ));
    }
    *value = given;
    Ok(())
}

fn path(object: &Object, name: &str) -> Result<Option<PathBuf>, FieldError> {
    match object.get(name) {
        None => Ok(None),
        Some(_) => Ok(Some(PathBuf::from(object.text(name)?))),
    }
}
