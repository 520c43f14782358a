//! Arrays of numpy from what the renderer has made, which they take over without a copy, and the other way round.

use numpy::ndarray::IntoDimension;
use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use uw_render::image::{LayerData, Picture};

use crate::errors::value_error;

/// An array of `shape` that owns `values`.
pub(crate) fn owning<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: impl IntoDimension,
) -> PyResult<Bound<'_, PyAny>> {
    let array = PyArray1::from_vec(py, values);
    Ok(array.reshape(shape)?.into_any())
}

/// The picture, height × width × 3.
pub(crate) fn of_picture(py: Python<'_>, picture: Picture) -> PyResult<Bound<'_, PyAny>> {
    let size = [picture.height as usize, picture.width as usize];
    colours(py, picture.data, size)
}

/// A layer of a picture of `size` (height, width): height × width, × 3 where it has three channels.
pub(crate) fn of_layer(
    py: Python<'_>,
    data: LayerData,
    size: [usize; 2],
) -> PyResult<Bound<'_, PyAny>> {
    match data {
        LayerData::Colour(values) | LayerData::Vector(values) => colours(py, values, size),
        LayerData::Scalar(values) => owning(py, values, size),
    }
}

fn colours(
    py: Python<'_>,
    values: Vec<[f32; 3]>,
    [height, width]: [usize; 2],
) -> PyResult<Bound<'_, PyAny>> {
    owning(py, values.into_flattened(), [height, width, 3])
}

/// A picture from height × width × 3 values of radiance.
pub(crate) fn to_picture(array: &PyReadonlyArray3<'_, f32>) -> PyResult<Picture> {
    let (height, width) = size(array)?;
    let (triples, _) = array.as_slice().map_err(value_error)?.as_chunks::<3>();
    Ok(Picture {
        width,
        height,
        data: triples.to_vec(),
    })
}

/// Height and width, pixels, of an array of height × width × 3.
pub(crate) fn size<T: Element>(array: &PyReadonlyArray3<'_, T>) -> PyResult<(u32, u32)> {
    let side = |at: usize| u32::try_from(array.shape()[at]).map_err(value_error);
    Ok((side(0)?, side(1)?))
}
