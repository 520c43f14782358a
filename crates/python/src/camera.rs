//! What is known of the camera that took pictures.

use std::path::Path;

use pyo3::prelude::*;
use uw_calib::response::LinearNoise;
use uw_calib::vehicle::Vehicle;
use uw_calib::{Encoding, Even, NoiseModel, SensorNoise, VehicleFile};

use crate::errors::value_error;
use crate::numbers;

/// Encoding, noise and lens: those given, else a vehicle's.
#[pyclass(frozen, module = "uwguide._native")]
pub(crate) struct Camera {
    pub(crate) encoding: Encoding,
    pub(crate) noise: NoiseModel,
    pub(crate) even: Option<Even>,
    pub(crate) vehicle: Option<Vehicle>,
}

#[pymethods]
impl Camera {
    #[new]
    pub(crate) fn new(
        vehicle: Option<&str>,
        encoding: Option<&str>,
        noise: Option<(f64, f64)>,
    ) -> PyResult<Self> {
        let found = vehicle.map(|name| VehicleFile::find(name, Path::new("")));
        let found = found.transpose().map_err(value_error)?;
        let vehicle = found.map(|file| file.vehicle);
        let given = encoding.map(self::encoding).transpose()?;
        let of_vehicle = vehicle.as_ref().map(|vehicle| vehicle.encoding);
        let encoding = given.or(of_vehicle).unwrap_or_default();
        let known = vehicle.as_ref().map(|v| (v.noise_a, v.noise_b));
        Ok(Self {
            encoding,
            noise: noise_model(noise.or(known), encoding)?,
            even: (vehicle.as_ref()).and_then(|vehicle| Even::of_vehicle(vehicle, encoding)),
            vehicle,
        })
    }
}

/// The encoding of that name.
///
/// # Errors
/// There is none.
pub(crate) fn encoding(name: &str) -> PyResult<Encoding> {
    let choices = [("srgb", Encoding::Srgb), ("linear", Encoding::Linear)];
    numbers::choice("encoding", name, choices)
}

/// Where the noise is taken from: the sensor's two numbers, or the picture.
fn noise_model(numbers: Option<(f64, f64)>, encoding: Encoding) -> PyResult<NoiseModel> {
    let Some((a, b)) = numbers else {
        return Ok(NoiseModel::Picture);
    };
    let noise = SensorNoise::new(encoding, LinearNoise { a, b });
    noise.map(NoiseModel::Sensor).ok_or_else(|| {
        value_error(format_args!(
            "noise_a and noise_b must be finite and >= 0, got {a} and {b}"
        ))
    })
}
