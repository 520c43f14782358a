//! Errors of the other crates, as Python sees them, and their warnings.

use std::ffi::CString;
use std::fmt::Display;

use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;

/// A `ValueError` with the text of the error.
pub(crate) fn value_error(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A `UserWarning` for each of the texts, at the `level` of the stack: 1 is the Python that calls what is compiled, 2 what calls that.
///
/// # Errors
/// The warning, where the user has made errors of them.
pub(crate) fn warn<T: Display>(
    py: Python<'_>,
    level: i32,
    texts: impl IntoIterator<Item = T>,
) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    for text in texts {
        // A text with a zero byte has been a path; what comes before it tells enough.
        let text = text.to_string();
        let text = text.split('\0').next().unwrap_or_default();
        let text = CString::new(text).map_err(value_error)?;
        PyErr::warn(py, &category, &text, level)?;
    }
    Ok(())
}
