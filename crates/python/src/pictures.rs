//! Pictures: exposed, written, measured.

use std::path::{Path, PathBuf};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use numpy::{Element, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::Value;
use uw_calib::photo::{Exposed, Shot, frames};
use uw_calib::{
    Detail, Even, ImageStats, Measured, NoiseModel, Processing, StatsError, Treatment, View,
};
use uw_render::image::{Counts, ExrImage, Frame, ImageFormat, write_frame};
use uw_render::scene::Sensor;

use crate::arrays;
use crate::camera::Camera;
use crate::errors::value_error;
use crate::interrupt::interruptible;
use crate::numbers;
use crate::scene::Scene;

/// The numbers that the sensor of a scene, or the default one, makes of a picture. See ``uwguide.expose``.
#[pyfunction]
pub(crate) fn expose<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    scene: Option<&Bound<'py, Scene>>,
    seed: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let sensor = scene.and_then(|scene| scene.get().scene().sensor);
    let sensor: Sensor = sensor.unwrap_or_default();
    let seed = numbers::seed(seed)?;
    let picture = arrays::to_picture(&image)?;
    let frame = interruptible(py, None, |_| sensor.expose(&picture, seed))?;
    let shape = [frame.height as usize, frame.width as usize, 3];
    match frame.counts {
        Counts::Bits8(counts) => arrays::owning(py, counts, shape),
        Counts::Bits16(counts) => arrays::owning(py, counts, shape),
    }
}

/// A picture to be written.
#[derive(FromPyObject)]
pub(crate) enum Pixels<'py> {
    Bits8(PyReadonlyArray3<'py, u8>),
    Bits16(PyReadonlyArray3<'py, u16>),
    Radiance(PyReadonlyArray3<'py, f32>),
}

/// Writes a picture, whole or not at all. See ``uwguide.save``.
#[pyfunction]
pub(crate) fn save(py: Python<'_>, file: PathBuf, image: Pixels<'_>) -> PyResult<()> {
    let is_exr = ImageFormat::of(&file).map_err(value_error)? == ImageFormat::Exr;
    let counts = match (image, is_exr) {
        (Pixels::Radiance(array), true) => {
            let image = ExrImage::new(arrays::to_picture(&array)?);
            return py.detach(|| image.write(&file)).map_err(value_error);
        }
        (Pixels::Bits8(array), false) => (arrays::size(&array)?, Counts::Bits8(samples(&array)?)),
        (Pixels::Bits16(array), false) => (arrays::size(&array)?, Counts::Bits16(samples(&array)?)),
        (_, is_exr) => {
            let expected = match is_exr {
                true => "an .exr file holds radiance: image must be float32",
                false => {
                    ".png and .tif files hold the numbers of a sensor: image must be uint8 or uint16, which uwguide.expose makes of radiance"
                }
            };
            return Err(value_error(format_args!("{}: {expected}", file.display())));
        }
    };
    let ((height, width), counts) = counts;
    let frame = Frame {
        width,
        height,
        counts,
    };
    py.detach(|| write_frame(&file, &frame))
        .map_err(value_error)
}

/// Contrast per channel of pixels in 8-bit counts, fractions allowed.
#[pyfunction]
pub(crate) fn contrast_of_counts(
    py: Python<'_>,
    image: PyReadonlyArray3<'_, f64>,
) -> PyResult<[f64; 3]> {
    let (height, width) = arrays::size(&image)?;
    let (pixels, _) = image.as_slice().map_err(value_error)?.as_chunks::<3>();
    let stats = py.detach(|| ImageStats::from_counts(width as usize, height as usize, pixels));
    stats.map(|stats| stats.contrast).map_err(value_error)
}

/// What ``uw stats --json`` tells of a file, as JSON.
#[pyfunction]
pub(crate) fn measure_file(py: Python<'_>, file: PathBuf, camera: &Camera) -> PyResult<String> {
    let found = py.detach(|| of_file(&file, camera)).map_err(value_error)?;
    Ok(found.to_string())
}

fn of_file(path: &Path, camera: &Camera) -> Result<Value, StatsError> {
    let treatment = Treatment {
        encoding: camera.encoding,
        even: camera.even.clone(),
        ..Treatment::default()
    };
    let opened = treatment.open(&View {
        path,
        distance_m: None,
        exposed: Exposed::ALIKE,
    })?;
    let measured = opened.measure(&camera.noise)?;
    let files = frames::files(path)?;
    let first = files.first().map_or(path, |file| file.as_path());
    let processing = Processing::of_file(first, &camera.noise)?;
    let shot = Shot::of_file(first);
    let more = opened.told().iter().cloned().chain(shot.wrong.clone());
    let mut warnings = processing.warnings();
    warnings.extend(more);
    Ok(told(&measured, Some(&processing), &shot, warnings))
}

/// The same of an array.
#[pyfunction]
pub(crate) fn measure_rgb8(
    py: Python<'_>,
    image: PyReadonlyArray3<'_, u8>,
    camera: &Camera,
) -> PyResult<String> {
    measure(py, &image, camera, Measured::from_rgb8)
}

/// The same of an array of 16 bits.
#[pyfunction]
pub(crate) fn measure_rgb16(
    py: Python<'_>,
    image: PyReadonlyArray3<'_, u16>,
    camera: &Camera,
) -> PyResult<String> {
    measure(py, &image, camera, Measured::from_rgb16)
}

/// Measures the samples of a picture of a width and a height, with the noise taken from where the model says.
type Measure<T> =
    fn(usize, usize, &[T], &NoiseModel, Option<&Even>) -> Result<Measured, StatsError>;

fn measure<T: Element + Sync>(
    py: Python<'_>,
    image: &PyReadonlyArray3<'_, T>,
    camera: &Camera,
    measure: Measure<T>,
) -> PyResult<String> {
    let (height, width) = arrays::size(image)?;
    let samples = image.as_slice().map_err(value_error)?;
    let measured = py.detach(|| {
        let even = camera.even.as_ref();
        measure(
            width as usize,
            height as usize,
            samples,
            &camera.noise,
            even,
        )
    });
    let measured = measured.map_err(value_error)?;
    Ok(told(&measured, None, &Shot::default(), Vec::new()).to_string())
}

fn told(
    measured: &Measured,
    processing: Option<&Processing>,
    shot: &Shot,
    more: Vec<String>,
) -> Value {
    let mut warnings = measured.detail.as_ref().map_or_else(
        || {
            vec![
                "too small to find its noise (patches of less than 3 x 3 pixels); give noise_a and noise_b"
                    .to_owned(),
            ]
        },
        Detail::warnings,
    );
    warnings.extend(more);
    let mut told = measured.told(processing, shot);
    told["warnings"] = warnings.into();
    told
}

/// The bytes of a PNG file with the picture.
#[pyfunction]
pub(crate) fn encode_png<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, u8>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (height, width) = arrays::size(&image)?;
    let samples = image.as_slice().map_err(value_error)?;
    let encoded = py.detach(|| {
        let mut bytes = Vec::new();
        let encoder =
            PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
        let written = encoder.write_image(samples, width, height, ExtendedColorType::Rgb8);
        written.map(|()| bytes)
    });
    Ok(PyBytes::new(py, &encoded.map_err(value_error)?))
}

fn samples<T: Element + Copy>(array: &PyReadonlyArray3<'_, T>) -> PyResult<Vec<T>> {
    Ok(array.as_slice().map_err(value_error)?.to_vec())
}
