//! Numbers of users, within their ranges.

use std::ops::RangeInclusive;

use pyo3::prelude::*;

use crate::errors::value_error;

/// Most samples per pixel.
pub(crate) const MOST_SAMPLES: u32 = 1 << 30;
/// Most worker threads.
const MOST_THREADS: u16 = 1024;

/// A whole number in `range`; a float that is one, as in `1e6`, too.
///
/// # Errors
/// A `ValueError` that calls it `name` and says what would be right.
pub(crate) fn whole<T>(
    name: &str,
    given: &Bound<'_, PyAny>,
    range: RangeInclusive<T>,
) -> PyResult<T>
where
    T: Copy + PartialOrd + std::fmt::Display + TryFrom<u64>,
{
    let of_float = || {
        let value = given.extract::<f64>().ok()?;
        // 2^53, up to which every whole number has a float of its own.
        let is_whole = value.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&value);
        is_whole.then_some(value as u64)
    };
    let number = given.extract::<u64>().ok().or_else(of_float);
    let number = number.and_then(|number| T::try_from(number).ok());
    number
        .filter(|number| range.contains(number))
        .ok_or_else(|| {
            let (least, most) = (range.start(), range.end());
            wrong(name, &format!("a whole number in {least}..={most}"), given)
        })
}

/// Samples per pixel.
///
/// # Errors
/// As [`whole`].
pub(crate) fn samples(name: &str, given: &Bound<'_, PyAny>) -> PyResult<u32> {
    whole(name, given, 1..=MOST_SAMPLES)
}

/// A seed of random numbers.
///
/// # Errors
/// As [`whole`].
pub(crate) fn seed(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    whole("seed", given, 0..=u64::MAX)
}

/// Worker threads; none for one per core.
///
/// # Errors
/// As [`whole`].
pub(crate) fn threads(given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<usize>> {
    let number = given.map(|given| whole("threads", given, 1..=MOST_THREADS));
    Ok(number.transpose()?.map(usize::from))
}

/// A finite number above 0, where there is one.
///
/// # Errors
/// A `ValueError` that calls it `name`.
pub(crate) fn positive(name: &str, given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<f64>> {
    given
        .map(|given| number(name, given, "a finite number > 0", |v| v > 0.0))
        .transpose()
}

/// A finite number that is `right`, which `expected` tells.
///
/// # Errors
/// A `ValueError` that calls it `name`.
pub(crate) fn number(
    name: &str,
    given: &Bound<'_, PyAny>,
    expected: &str,
    right: impl Fn(f64) -> bool,
) -> PyResult<f64> {
    let number = given.extract::<f64>().ok();
    let number = number.filter(|number| number.is_finite() && right(*number));
    number.ok_or_else(|| wrong(name, expected, given))
}

/// One of some names.
///
/// # Errors
/// A `ValueError` that lists them.
pub(crate) fn choice<T: Copy, const N: usize>(
    name: &str,
    given: &str,
    choices: [(&str, T); N],
) -> PyResult<T> {
    let found = choices.iter().find(|(known, _)| *known == given);
    found.map(|(_, choice)| *choice).ok_or_else(|| {
        let known = choices.map(|(known, _)| known).join(", ");
        value_error(format_args!("{name} must be one of {known}, got {given:?}"))
    })
}

fn wrong(name: &str, expected: &str, given: &Bound<'_, PyAny>) -> PyErr {
    match given.repr() {
        Ok(got) => value_error(format_args!("{name} must be {expected}, got {got}")),
        Err(error) => error,
    }
}
