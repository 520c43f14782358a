//! The sections of the links; each is off without its address.

use uw_calib::json::{FieldError, Object};

use super::sections::positive;
use crate::links::Pauses;
use crate::links::dvl::{DvlConfig, DvlDistance};
use crate::links::mavlink::{Lamps, MavlinkConfig};
use crate::links::ros2::{
    CameraAxis, DepthAxis, DepthType, ImageType, MOST_DOMAIN, NumberType, RangeType, Ros2Config,
};
use crate::links::rosbridge::RosbridgeConfig;

/// Fastest polling of an autopilot, Hz.
const MAX_RATE_HZ: f64 = 50.0;

fn text(object: &Object, name: &str) -> Result<Option<String>, FieldError> {
    match object.get(name) {
        None => Ok(None),
        Some(_) => Ok(Some(object.text(name)?.to_owned())),
    }
}

/// HOST:PORT, where there is one.
fn address(object: &Object) -> Result<Option<String>, FieldError> {
    let Some(address) = text(object, "address")? else {
        return Ok(None);
    };
    match address.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(Some(address)),
        _ => Err(FieldError::invalid(
            object.path_of("address"),
            "HOST:PORT",
            format!("{address:?}"),
        )),
    }
}

pub(super) fn dvl(object: &Object) -> Result<Option<DvlConfig>, FieldError> {
    object.only(&["address", "distance"])?;
    let distance = match text(object, "distance")?.as_deref() {
        None | Some("beams") => DvlDistance::Beams,
        Some("altitude") => DvlDistance::Altitude,
        Some(other) => {
            let field = object.path_of("distance");
            let got = format!("{other:?}");
            return Err(FieldError::invalid(field, "\"beams\" or \"altitude\"", got));
        }
    };
    Ok(address(object)?.map(|address| DvlConfig {
        address,
        distance,
        pauses: Pauses::default(),
    }))
}

pub(super) fn mavlink(object: &Object) -> Result<Option<MavlinkConfig>, FieldError> {
    object.only(&[
        "address",
        "prefix",
        "system",
        "rate_hz",
        "orientation",
        "lamps",
        "servo",
    ])?;
    let mut config = MavlinkConfig::default();
    if let Some(prefix) = text(object, "prefix")? {
        config.prefix = prefix;
    }
    if let Some(orientation) = text(object, "orientation")? {
        config.orientation = orientation;
    }
    if let Some(system) = small(object, "system")? {
        config.system = system;
    }
    positive(object, "rate_hz", MAX_RATE_HZ, &mut config.rate_hz)?;
    let servo = small(object, "servo")?;
    let field = object.path_of("lamps");
    config.lamps = match (text(object, "lamps")?.as_deref(), servo) {
        (None | Some("advise"), None) => Lamps::Advise,
        (Some("illuminator"), None) => Lamps::Illuminator,
        (Some("servo"), Some(output)) => Lamps::Servo(output),
        (Some("servo"), None) => return Err(FieldError::missing(object.path_of("servo"))),
        (None | Some("advise" | "illuminator"), Some(_)) => {
            let expected = "\"servo\" where servo is given";
            return Err(FieldError::invalid(field, expected, "something else"));
        }
        (Some(other), _) => {
            let expected = "one of advise, servo, illuminator";
            return Err(FieldError::invalid(field, expected, format!("{other:?}")));
        }
    };
    Ok(address(object)?.map(|address| MavlinkConfig { address, ..config }))
}

/// A whole number from 1 to 255.
fn small(object: &Object, name: &str) -> Result<Option<u8>, FieldError> {
    let Some(value) = object.get(name) else {
        return Ok(None);
    };
    let number = value.as_u64().and_then(|number| u8::try_from(number).ok());
    match number.filter(|&number| number > 0) {
        Some(number) => Ok(Some(number)),
        None => {
            let expected = "a whole number from 1 to 255";
            Err(FieldError::wrong_type(
                object.path_of(name),
                expected,
                value,
            ))
        }
    }
}

pub(super) fn rosbridge(object: &Object) -> Result<Option<RosbridgeConfig>, FieldError> {
    object.only(&["address", "service", "service_type"])?;
    let service = text(object, "service")?;
    let service_type = text(object, "service_type")?;
    Ok(address(object)?.map(|address| RosbridgeConfig {
        address,
        service: service.unwrap_or_else(|| "/uwguide/suggest".to_owned()),
        service_type: service_type.unwrap_or_else(|| "std_srvs/srv/Trigger".to_owned()),
        pauses: Pauses::default(),
    }))
}

/// Longest silence, s.
const MOST_SILENCE_S: f64 = 3600.0;
/// Most that a range may be off the camera's distance, m.
const MOST_OFFSET_M: f64 = 10.0;
/// Largest pressure at a surface, Pa, and density of a water, kg/m³.
const MOST_PRESSURE_PA: f64 = 1e6;
const MOST_DENSITY_KG_PER_M3: f64 = 2000.0;

pub(super) fn ros2(object: &Object) -> Result<Ros2Config, FieldError> {
    object.only(&[
        "enabled",
        "domain_id",
        "range_topic",
        "range_type",
        "depth_topic",
        "depth_type",
        "depth_axis",
        "light_topic",
        "light_type",
        "image_topic",
        "image_type",
        "suggestion_topic",
        "range_offset_m",
        "surface_pressure_pa",
        "water_density_kg_per_m3",
        "camera_axis",
        "stamps",
        "reliable",
        "silence_s",
        "rate_hz",
    ])?;
    let mut config = Ros2Config::default();
    flag(object, "enabled", &mut config.enabled)?;
    flag(object, "reliable", &mut config.reliable)?;
    config.domain_id = domain(object)?;
    let image_types = [
        ("sensor_msgs/msg/CompressedImage", ImageType::Compressed),
        ("sensor_msgs/msg/Image", ImageType::Raw),
    ];
    one_of(object, "image_type", &image_types, &mut config.image_type)?;
    config.image_topic = config.image_type.usual_topic().to_owned();
    for (name, topic) in [
        ("range_topic", &mut config.range_topic),
        ("depth_topic", &mut config.depth_topic),
        ("light_topic", &mut config.light_topic),
        ("image_topic", &mut config.image_topic),
        ("suggestion_topic", &mut config.suggestion_topic),
    ] {
        if let Some(given) = topic_name(object, name)? {
            *topic = given;
        }
    }
    number_types(object, &mut config)?;
    config.depth_axis = depth_axis(object, config.depth_type)?;
    let axes = [("x", CameraAxis::X), ("z", CameraAxis::Z)];
    one_of(object, "camera_axis", &axes, &mut config.camera_axis)?;
    let stamps = [("header", true), ("arrival", false)];
    one_of(object, "stamps", &stamps, &mut config.stamps)?;
    if object.get("range_offset_m").is_some() {
        let offset_m = object.number("range_offset_m")?;
        if !(offset_m.abs() <= MOST_OFFSET_M) {
            return Err(FieldError::out_of_range(
                object.path_of("range_offset_m"),
                format!("from -{MOST_OFFSET_M} to {MOST_OFFSET_M} m"),
                offset_m,
            ));
        }
        config.range_offset_m = offset_m;
    }
    for (name, most, value) in [
        (
            "surface_pressure_pa",
            MOST_PRESSURE_PA,
            &mut config.surface_pressure_pa,
        ),
        (
            "water_density_kg_per_m3",
            MOST_DENSITY_KG_PER_M3,
            &mut config.water_density_kg_per_m3,
        ),
        ("silence_s", MOST_SILENCE_S, &mut config.silence_s),
        ("rate_hz", MAX_RATE_HZ, &mut config.rate_hz),
    ] {
        positive(object, name, most, value)?;
    }
    Ok(config)
}

/// What distance, depth and light come as.
fn number_types(object: &Object, config: &mut Ros2Config) -> Result<(), FieldError> {
    let (double, single) = ("std_msgs/msg/Float64", "std_msgs/msg/Float32");
    let range_types = [
        ("sensor_msgs/msg/Range", RangeType::Echo),
        (double, RangeType::Metres(NumberType::Float64)),
        (single, RangeType::Metres(NumberType::Float32)),
    ];
    one_of(object, "range_type", &range_types, &mut config.range_type)?;
    let depth_types = [
        (double, DepthType::Metres(NumberType::Float64)),
        (single, DepthType::Metres(NumberType::Float32)),
        ("sensor_msgs/msg/FluidPressure", DepthType::Pressure),
        ("geometry_msgs/msg/PoseStamped", DepthType::Pose),
        (
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            DepthType::PoseWithCovariance,
        ),
        ("nav_msgs/msg/Odometry", DepthType::Odometry),
    ];
    one_of(object, "depth_type", &depth_types, &mut config.depth_type)?;
    let light_types = [(double, NumberType::Float64), (single, NumberType::Float32)];
    one_of(object, "light_type", &light_types, &mut config.light_type)
}

/// Which way a depth grows, where its type leaves that open.
fn depth_axis(object: &Object, of: DepthType) -> Result<Option<DepthAxis>, FieldError> {
    if object.get("depth_axis").is_some() && of == DepthType::Pressure {
        return Err(FieldError::invalid(
            object.path_of("depth_axis"),
            "absent with sensor_msgs/msg/FluidPressure, which grows downwards",
            "one",
        ));
    }
    let axes = [("up", Some(DepthAxis::Up)), ("down", Some(DepthAxis::Down))];
    let mut axis = None;
    one_of(object, "depth_axis", &axes, &mut axis)?;
    Ok(axis)
}

fn flag(object: &Object, name: &str, value: &mut bool) -> Result<(), FieldError> {
    if let Some(given) = object.get(name) {
        let wrong = || FieldError::wrong_type(object.path_of(name), "true or false", given);
        *value = given.as_bool().ok_or_else(wrong)?;
    }
    Ok(())
}

fn one_of<T: Copy>(
    object: &Object,
    name: &str,
    all: &[(&str, T)],
    value: &mut T,
) -> Result<(), FieldError> {
    let Some(given) = text(object, name)? else {
        return Ok(());
    };
    let Some((_, found)) = all.iter().find(|(known, _)| *known == given) else {
        let known: Vec<String> = all.iter().map(|(known, _)| format!("{known:?}")).collect();
        let (field, got) = (object.path_of(name), format!("{given:?}"));
        return Err(FieldError::invalid(field, known.join(" or "), got));
    };
    *value = *found;
    Ok(())
}

/// Domain of DDS.
fn domain(object: &Object) -> Result<Option<u16>, FieldError> {
    let Some(value) = object.get("domain_id") else {
        return Ok(None);
    };
    let number = value.as_u64().and_then(|number| u16::try_from(number).ok());
    match number.filter(|&number| number <= MOST_DOMAIN) {
        Some(number) => Ok(Some(number)),
        None => {
            let expected = format!("a whole number from 0 to {MOST_DOMAIN}");
            Err(FieldError::wrong_type(
                object.path_of("domain_id"),
                expected,
                value,
            ))
        }
    }
}

/// An absolute name of a topic, as ROS 2 has them.
fn topic_name(object: &Object, name: &str) -> Result<Option<String>, FieldError> {
    let Some(topic) = text(object, name)? else {
        return Ok(None);
    };
    let is_token = |token: &str| {
        let mut letters = token.chars();
        letters
            .next()
            .is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
            && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
            && !token.contains("__")
    };
    match topic.strip_prefix('/') {
        Some(tokens) if tokens.split('/').all(is_token) => Ok(Some(topic)),
        _ => Err(FieldError::invalid(
            object.path_of(name),
            "an absolute topic name such as \"/camera/image_raw/compressed\": letters, digits and single underscores between slashes",
            format!("{topic:?}"),
        )),
    }
}
