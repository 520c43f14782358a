//! One value of a scene file, read as what it should be.

use std::path::{Path, PathBuf};

use glam::DVec3;
use toml::Spanned;
use toml::de::DeValue;

use super::SceneError;
use super::document::{Document, listed};
use super::range::Range;

/// Characters of a wrong value that an error message repeats.
const QUOTED_CHARS: usize = 60;

/// What rounding leaves of the square of a unit vector's length beside 1.
const UNIT_WITHIN: f64 = 1e-15;

/// One value of the file.
#[derive(Clone)]
pub(super) struct Value<'d> {
    pub(super) doc: &'d Document<'d>,
    pub(super) value: &'d Spanned<DeValue<'d>>,
    pub(super) path: String,
    /// Stands between this path and a field's name: a point, or a space after a counted element (`object 2 plane`).
    pub(super) separator: char,
}

impl<'d> Value<'d> {
    /// Line, counted from 1.
    pub(super) fn line(&self) -> usize {
        self.doc.line_at(self.value.span().start)
    }

    /// The value as the file writes it, in one line, shortened.
    pub(super) fn written(&self) -> String {
        let text = self.doc.text.get(self.value.span()).unwrap_or_default();
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        match words.char_indices().nth(QUOTED_CHARS) {
            Some((end, _)) => format!("{} ...", &words[..end]),
            None => words,
        }
    }

    /// The error that this value is not what it should be.
    pub(super) fn invalid(&self, expected: impl Into<String>) -> SceneError {
        self.invalid_got(expected, self.written())
    }

    /// As [`Value::invalid`], with another description of what was found.
    pub(super) fn invalid_got(
        &self,
        expected: impl Into<String>,
        got: impl Into<String>,
    ) -> SceneError {
        SceneError::InvalidValue {
            file: self.doc.file.to_string(),
            line: self.line(),
            field: self.path.clone(),
            expected: expected.into(),
            got: got.into(),
        }
    }

    /// The error that the file this value names cannot be used.
    pub(super) fn unusable_file(&self, path: &Path, reason: impl Into<String>) -> SceneError {
        SceneError::ReferencedFile {
            file: self.doc.file.to_string(),
            line: self.line(),
            field: self.path.clone(),
            path: path.display().to_string(),
            reason: reason.into(),
        }
    }

    /// Whether this is a table.
    pub(super) fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    /// Whether this is text.
    pub(super) fn is_text(&self) -> bool {
        self.value.get_ref().is_str()
    }

    /// Whether this is an array.
    pub(super) fn is_array(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// How many elements an array has, 0 for what is none.
    pub(super) fn count(&self) -> usize {
        self.value
            .get_ref()
            .as_array()
            .map_or(0, |array| array.len())
    }

    /// The elements of an array, their paths numbered from 1.
    pub(super) fn as_elements(&self) -> Result<Vec<Value<'d>>, SceneError> {
        let Some(array) = self.value.get_ref().as_array() else {
            return Err(self.invalid("an array of tables"));
        };
        let element = |(i, value)| Value {
            doc: self.doc,
            value,
            path: format!("{} {}", self.path, i + 1),
            separator: ' ',
        };
        Ok(array.iter().enumerate().map(element).collect())
    }

    /// Text.
    pub(super) fn as_text(&self) -> Result<&'d str, SceneError> {
        self.value
            .get_ref()
            .as_str()
            .ok_or_else(|| self.invalid("text in quotes"))
    }

    /// A path, as [`Document::path`] takes it; that of a shipped file (`shipped:NAME`) stays.
    pub(super) fn as_path(&self) -> Result<PathBuf, SceneError> {
        let text = self.as_text()?;
        if text.is_empty() {
            return Err(self.invalid("the path of a file"));
        }
        Ok(self.doc.path(text, self.value.span().start))
    }

    /// True or false.
    pub(super) fn as_bool(&self) -> Result<bool, SceneError> {
        self.value
            .get_ref()
            .as_bool()
            .ok_or_else(|| self.invalid("true or false"))
    }

    /// One of a list of words; the value that stands beside it.
    pub(super) fn as_choice<T: Clone>(&self, choices: &[(&str, T)]) -> Result<T, SceneError> {
        let words: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
        let one_of = if words.len() == 1 { "" } else { "one of " };
        let expected = || self.invalid(format!("{one_of}{}", listed(&words)));
        let text = self.value.get_ref().as_str().ok_or_else(expected)?;
        let chosen = choices.iter().find(|(word, _)| *word == text);
        chosen
            .map(|(_, choice)| choice.clone())
            .ok_or_else(expected)
    }

    /// A finite number inside a range; whole numbers count as numbers.
    pub(super) fn as_number(&self, range: Range) -> Result<f64, SceneError> {
        let parsed = match self.value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .ok()
                .map(|whole| whole as f64),
            _ => None,
        };
        let Some(number) = parsed else {
            return Err(self.invalid(format!("a number {}", range.describe()).trim_end()));
        };
        match range.refusal(number) {
            Some(expected) => Err(self.invalid(expected)),
            None => Ok(number),
        }
    }

    /// A whole number in `[low, high]`.
    pub(super) fn as_whole(&self, low: u32, high: u32, unit: &str) -> Result<u32, SceneError> {
        let parsed = match self.value.get_ref() {
            DeValue::Integer(integer) => {
                u32::from_str_radix(integer.as_str(), integer.radix()).ok()
            }
            _ => None,
        };
        let expected =
            || self.invalid(format!("a whole number in [{low}, {high}] {unit}").trim_end());
        parsed
            .filter(|whole| (low..=high).contains(whole))
            .ok_or_else(expected)
    }

    /// An array of exactly `N` numbers, each inside the range.
    pub(super) fn as_numbers<const N: usize>(&self, range: Range) -> Result<[f64; N], SceneError> {
        let shape =
            || self.invalid(format!("an array of {N} numbers {}", range.describe()).trim_end());
        let array = self
            .value
            .get_ref()
            .as_array()
            .filter(|array| array.len() == N)
            .ok_or_else(shape)?;
        let mut numbers = [0.0; N];
        for (number, value) in numbers.iter_mut().zip(array.iter()) {
            *number = Value {
                value,
                ..self.clone()
            }
            .as_number(range)?;
        }
        Ok(numbers)
    }

    /// A direction, returned with unit length.
    pub(super) fn as_direction(&self) -> Result<DVec3, SceneError> {
        let vector = DVec3::from_array(self.as_numbers(Range::finite(""))?);
        let largest = vector.abs().max_element();
        if largest == 0.0 {
            return Err(self.invalid("a direction of non-zero length"));
        }
        // A unit vector stays as it is to the last bit, so that a scene that is read, written and read again is the same.
        if (vector.length_squared() - 1.0).abs() < UNIT_WITHIN {
            return Ok(vector);
        }
        // Scaled first: the square of a very small or large component would leave the range of f64.
        Ok((vector / largest).normalize())
    }
}
