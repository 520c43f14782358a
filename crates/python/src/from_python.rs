//! Scenes that are dictionaries: as the text that a scene file would have.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::{Table, Value};

use crate::errors::value_error;

/// Most dictionaries and lists within each other; a scene file has four.
const DEEPEST: usize = 16;

/// The text of a scene file with what `scene` holds.
///
/// # Errors
/// A `ValueError` that names the field whose value no scene file can hold.
pub(crate) fn scene_text(scene: &Bound<'_, PyDict>) -> PyResult<String> {
    let table = table(scene, "", 0)?;
    toml::to_string(&table).map_err(value_error)
}

/// A single value as a scene file would have it behind an equals sign.
///
/// # Errors
/// As [`scene_text`]; the field is called `path`.
pub(crate) fn value_text(item: &Bound<'_, PyAny>, path: &str) -> PyResult<String> {
    Ok(value(item, path, 0)?.to_string())
}

fn table(dict: &Bound<'_, PyDict>, path: &str, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, item) in dict {
        let Ok(key) = key.extract::<String>() else {
            let within = if path.is_empty() { "the scene" } else { path };
            return Err(value_error(format_args!(
                "dict: the names of fields in {within} must be texts, got {}",
                key.repr()?
            )));
        };
        let path = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        table.insert(key, value(&item, &path, depth + 1)?);
    }
    Ok(table)
}

fn value(item: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(value_error(format_args!(
            "dict: {path} must not lie more than {DEEPEST} dictionaries and lists deep"
        )));
    }
    let wrong = || {
        let got = item.repr().map(|text| text.to_string());
        value_error(format_args!(
            "dict: {path} must be a number, a text, true or false, a list or a dictionary, got {}",
            got.unwrap_or_default()
        ))
    };
    if item.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(item.extract()?));
    }
    if item.is_instance_of::<PyInt>() {
        return item.extract().map(Value::Integer).map_err(|_| wrong());
    }
    if item.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(item.extract()?));
    }
    if item.is_instance_of::<PyString>() {
        return item.extract().map(Value::String).map_err(|_| wrong());
    }
    if let Ok(dict) = item.cast::<PyDict>() {
        return Ok(Value::Table(table(dict, path, depth)?));
    }
    if item.is_instance_of::<PyList>() || item.is_instance_of::<PyTuple>() {
        let elements = item.try_iter()?.enumerate();
        let value = |(i, element): (usize, PyResult<Bound<'_, PyAny>>)| {
            value(&element?, &format!("{path}[{i}]"), depth + 1)
        };
        return elements
            .map(value)
            .collect::<PyResult<_>>()
            .map(Value::Array);
    }
    // Numbers and arrays of numpy, then paths.
    if let Ok(plain) = item.call_method0("tolist") {
        return value(&plain, path, depth + 1);
    }
    match item.call_method0("__fspath__") {
        Ok(file) => value(&file, path, depth + 1),
        Err(_) => Err(wrong()),
    }
}
