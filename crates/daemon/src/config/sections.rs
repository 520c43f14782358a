//! The sections of the configuration file.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use serde_json::Value;
use tracing::level_filters::LevelFilter;
use uw_calib::json::{FieldError, Object, array, number};
use uw_calib::response::LinearNoise;
use uw_calib::{Encoding, NoiseModel, SensorNoise};

use super::{CONFIG_FORMAT, Config, PredictorKind, links, section};
use crate::log::LogConfig;
use crate::tls::TlsFiles;
use uw_guidance::beams::BeamGeometry;
use uw_guidance::daemon::Limits;
use uw_guidance::feed::MaxAge;
use uw_guidance::service::{ImagePolicy, steering_with};

/// Longest time that can be given, s: a year, far inside what a clock can add.
const MAX_TIME_S: f64 = 365.0 * 86_400.0;
/// Most connections: what a process can have open.
const MAX_CONNECTIONS: usize = 65_536;
/// Most lines that are no JSON object which can be asked for.
const MAX_BAD_LINES: u32 = 1_000_000;
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
        .chain([
            "predictor",
            "water",
            "vehicle",
            "operations",
            "dvl",
            "mavlink",
            "ros2",
            "rosbridge",
        ])
        .collect();
    document.only(&known)?;
    let format = document.text("format")?;
    if format != CONFIG_FORMAT {
        let expected = format!("{CONFIG_FORMAT:?}");
        let got = format!("{format:?}");
        return Err(FieldError::invalid("format", expected, got));
    }
    let mut config = Config::default();
    if document.get("predictor").is_some() {
        config.predictor = Some(predictor(&document)?);
    }
    if let Some(water) = section(&document, "water")? {
        water.only(&["file"])?;
        config.water = path(&water, "file")?;
    }
    if let Some(vehicle) = section(&document, "vehicle")? {
        vehicle.only(&["file"])?;
        config.vehicle = match vehicle.get("file") {
            None => None,
            Some(_) => Some(vehicle.text("file")?.to_owned()),
        };
    }
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
        images.only(&[
            "directory",
            "noise_a",
            "noise_b",
            "encoding",
            "mask",
            "undistortion",
        ])?;
        config.mask = path(&images, "mask")?;
        config.undistortion = path(&images, "undistortion")?;
        config.encoding = encoding(&images)?;
        settings.treatment.encoding = config.encoding.unwrap_or_default();
        settings.noise = noise(&images, settings.treatment.encoding)?;
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
    if let Some(object) = section(&document, "ros2")? {
        config.ros2 = links::ros2(&object)?;
    }
    if let Some(object) = section(&document, "rosbridge")? {
        config.rosbridge = links::rosbridge(&object)?;
    }
    Ok(config)
}

fn predictor(document: &Object) -> Result<PredictorKind, FieldError> {
    match document.text("predictor")? {
        "network" => Ok(PredictorKind::Network),
        "physics" => Ok(PredictorKind::Physics),
        other => {
            let expected = "\"network\" or \"physics\"";
            Err(FieldError::invalid(
                "predictor",
                expected,
                format!("{other:?}"),
            ))
        }
    }
}

/// How its counts stand for light, where that is given.
fn encoding(images: &Object) -> Result<Option<Encoding>, FieldError> {
    if images.get("encoding").is_none() {
        return Ok(None);
    }
    match images.text("encoding")? {
        "srgb" => Ok(Some(Encoding::Srgb)),
        "linear" => Ok(Some(Encoding::Linear)),
        other => {
            let field = images.path_of("encoding");
            let expected = "\"srgb\" or \"linear\"";
            Err(FieldError::invalid(field, expected, format!("{other:?}")))
        }
    }
}

/// The noise of the camera; taken from the pictures where it is not given.
fn noise(images: &Object, encoding: Encoding) -> Result<NoiseModel, FieldError> {
    let given = ["noise_a", "noise_b"].map(|name| images.get(name).is_some());
    if given == [false, false] {
        return Ok(NoiseModel::Picture);
    }
    let (a, b) = (images.number("noise_a")?, images.number("noise_b")?);
    SensorNoise::new(encoding, LinearNoise { a, b })
        .map(NoiseModel::Sensor)
        .ok_or_else(|| {
            let (name, got) = if a >= 0.0 {
                ("noise_b", b)
            } else {
                ("noise_a", a)
            };
            FieldError::out_of_range(images.path_of(name), ">= 0", got)
        })
}

fn limits(object: &Object) -> Result<Limits, FieldError> {
    object.only(&[
        "max_connections",
        "max_connections_per_address",
        "first_line_time_s",
        "idle_time_s",
        "max_bad_lines",
        "max_requests_per_s",
        "write_time_s",
    ])?;
    let mut limits = Limits::default();
    let connections = 1..=MAX_CONNECTIONS;
    whole(
        object,
        "max_connections",
        connections.clone(),
        &mut limits.max_connections,
    )?;
    let share = &mut limits.max_connections_per_address;
    whole(object, "max_connections_per_address", connections, share)?;
    whole(
        object,
        "max_bad_lines",
        0..=MAX_BAD_LINES,
        &mut limits.max_bad_lines,
    )?;
    for (name, time) in [
        ("first_line_time_s", &mut limits.first_line_time),
        ("idle_time_s", &mut limits.idle_time),
        ("write_time_s", &mut limits.write_time),
    ] {
        let mut seconds = time.as_secs_f64();
        positive(object, name, MAX_TIME_S, &mut seconds)?;
        *time = Duration::from_secs_f64(seconds);
    }
    let rate = &mut limits.max_requests_per_s;
    positive(object, "max_requests_per_s", MAX_RATE_PER_S, rate)?;
    Ok(limits)
}

/// A whole number in a range, where there is one.
fn whole<T: TryFrom<u64> + PartialOrd + std::fmt::Display>(
    object: &Object,
    name: &str,
    range: RangeInclusive<T>,
    value: &mut T,
) -> Result<(), FieldError> {
    let Some(given) = object.get(name) else {
        return Ok(());
    };
    *value = given
        .as_u64()
        .and_then(|number| T::try_from(number).ok())
        .filter(|number| range.contains(number))
        .ok_or_else(|| {
            let expected = format!("a whole number from {} to {}", range.start(), range.end());
            FieldError::wrong_type(object.path_of(name), expected, given)
        })?;
    Ok(())
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
    object.only(&[
        "metrics",
        "metrics_hosts",
        "log_level",
        "log_format",
        "log_file",
        "record",
        "group_may_read",
    ])?;
    if object.get("metrics").is_some() {
        config.metrics = Some(object.text("metrics")?.to_owned());
    }
    if object.get("metrics_hosts").is_some() {
        config.metrics_hosts = names(object, "metrics_hosts")?;
    }
    if let Some(value) = object.get("group_may_read") {
        config.group_may_read = value.as_bool().ok_or_else(|| {
            FieldError::wrong_type(object.path_of("group_may_read"), "true or false", value)
        })?;
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

fn names(object: &Object, name: &str) -> Result<Vec<String>, FieldError> {
    let wrong = |path: &str, value: &Value| FieldError::wrong_type(path, "a host name", value);
    object
        .array(name)?
        .iter()
        .enumerate()
        .map(|(k, item)| {
            let path = format!("{}[{k}]", object.path_of(name));
            let text = item.as_str().ok_or_else(|| wrong(&path, item))?;
            let is_name = !text.is_empty() && !text.contains(['/', ' ']);
            match is_name {
                true => Ok(text.to_owned()),
                false => Err(FieldError::invalid(
                    path,
                    "a host name",
                    format!("{text:?}"),
                )),
            }
        })
        .collect()
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
