//! The sections of the links; each is off without its address.

use uw_calib::json::{FieldError, Object};

use super::sections::positive;
use crate::links::Pauses;
use crate::links::dvl::{DvlConfig, DvlDistance};
use crate::links::mavlink::{Lamps, MavlinkConfig};
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
