//! Typed reading of TOML values that keeps the line and the path of every field, so that each error can name both.

use std::path::{Path, PathBuf};

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::SceneError;

/// Largest magnitude of any number in a scene file; keeps every product of two of them finite.
const LARGEST: f64 = 1e12;
/// Characters of a wrong value that an error message repeats.
const QUOTED_CHARS: usize = 60;
/// Similarity (Jaro-Winkler, 0 to 1) from which on a known field is proposed for an unknown one.
const SIMILAR: f64 = 0.8;

/// The text of a scene file and where it comes from.
pub(super) struct Document<'a> {
    /// Name for error messages.
    pub(super) file: &'a str,
    /// The whole text.
    pub(super) text: &'a str,
    /// Folder that paths in the file start from.
    pub(super) base_dir: &'a Path,
}

impl Document<'_> {
    /// Line, counted from 1, of a byte offset.
    pub(super) fn line_at(&self, offset: usize) -> usize {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }
}

/// The values that a number may take, with its unit.
#[derive(Clone, Copy)]
pub(super) struct Range {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    unit: &'static str,
}

impl Range {
    /// Any finite number.
    pub(super) const fn finite(unit: &'static str) -> Self {
        Self::closed(f64::NEG_INFINITY, f64::INFINITY, unit)
    }
    /// `>= 0`.
    pub(super) const fn non_negative(unit: &'static str) -> Self {
        Self::closed(0.0, f64::INFINITY, unit)
    }
    /// `> 0`.
    pub(super) const fn positive(unit: &'static str) -> Self {
        Self {
            low_open: true,
            ..Self::non_negative(unit)
        }
    }
    /// `[low, high]`.
    pub(super) const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low,
            high,
            low_open: false,
            high_open: false,
            unit,
        }
    }
    /// `[low, high)`.
    pub(super) const fn below(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            high_open: true,
            ..Self::closed(low, high, unit)
        }
    }
    /// `(low, high]`.
    pub(super) const fn above(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low_open: true,
            ..Self::closed(low, high, unit)
        }
    }
    /// `(low, high)`.
    pub(super) const fn open(low: f64, high: f64, unit: &'static str) -> Self {
        Self {
            low_open: true,
            high_open: true,
            ..Self::closed(low, high, unit)
        }
    }

    fn contains(&self, x: f64) -> bool {
        let above = if self.low_open {
            x > self.low
        } else {
            x >= self.low
        };
        let below = if self.high_open {
            x < self.high
        } else {
            x <= self.high
        };
        above && below
    }

    fn describe(&self) -> String {
        let range = match (self.low.is_finite(), self.high.is_finite()) {
            (false, false) => String::new(),
            (true, false) => format!("{} {}", if self.low_open { ">" } else { ">=" }, self.low),
            (false, true) => format!("{} {}", if self.high_open { "<" } else { "<=" }, self.high),
            (true, true) => format!(
                "in {}{}, {}{}",
                if self.low_open { '(' } else { '[' },
                self.low,
                self.high,
                if self.high_open { ')' } else { ']' }
            ),
        };
        [range.as_str(), self.unit]
            .iter()
            .filter(|part| !part.is_empty())
            .copied()
            .collect::<Vec<_>>()
            .join(" ")
    }

    /// What is wrong with `x`, said as what would be right; `None` when it is fine.
    fn refusal(&self, x: f64) -> Option<String> {
        if !x.is_finite() {
            Some(
                format!("a finite number {}", self.describe())
                    .trim_end()
                    .to_string(),
            )
        } else if !self.contains(x) {
            Some(self.describe())
        } else if x.abs() > LARGEST {
            Some(format!("at most {LARGEST:e} in magnitude"))
        } else {
            None
        }
    }
}

/// One table of the file; all its fields are known ones.
pub(super) struct Table<'d> {
    pub(super) doc: &'d Document<'d>,
    table: &'d DeTable<'d>,
    /// `water`, `object 2`, `object 2 plane`, or empty for the file itself.
    path: String,
    separator: char,
    line: usize,
}

/// One value of the file.
#[derive(Clone)]
pub(super) struct Value<'d> {
    pub(super) doc: &'d Document<'d>,
    value: &'d Spanned<DeValue<'d>>,
    path: String,
    /// Stands between this path and a field's name: a point, or a space after a counted element (`object 2 plane`).
    separator: char,
}

impl<'d> Table<'d> {
    /// The file itself.
    pub(super) fn root(
        doc: &'d Document<'d>,
        table: &'d DeTable<'d>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        Self {
            doc,
            table,
            path: String::new(),
            separator: '.',
            line: 1,
        }
        .knowing(known)
    }

    /// The table itself, unless it has a field that is not known.
    fn knowing(self, known: &[&str]) -> Result<Self, SceneError> {
        let unknown = self
            .table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()));
        if let Some(key) = unknown.min_by_key(|key| key.span().start) {
            return Err(SceneError::UnknownField {
                file: self.doc.file.to_string(),
                line: self.doc.line_at(key.span().start),
                field: key.get_ref().to_string(),
                within: within(&self.path),
                hint: hint(key.get_ref(), known),
            });
        }
        Ok(self)
    }

    /// Path of a field of this table.
    pub(super) fn path_of(&self, field: &str) -> String {
        if self.path.is_empty() {
            return field.to_string();
        }
        format!("{}{}{field}", self.path, self.separator)
    }

    /// A field that may be left out.
    pub(super) fn optional(&self, field: &str) -> Option<Value<'d>> {
        let value = self.table.get(field)?;
        Some(Value {
            doc: self.doc,
            value,
            path: self.path_of(field),
            separator: '.',
        })
    }

    /// A field that must be there; `expected` says what it should hold.
    pub(super) fn required(&self, field: &str, expected: &str) -> Result<Value<'d>, SceneError> {
        self.optional(field)
            .ok_or_else(|| self.missing(field, expected))
    }

    /// The error for a missing field.
    pub(super) fn missing(&self, field: &str, expected: &str) -> SceneError {
        SceneError::MissingField {
            file: self.doc.file.to_string(),
            line: self.line,
            within: within(&self.path),
            field: field.to_string(),
            expected: expected.to_string(),
        }
    }

    /// Refuses `field` because of what else the table holds; `reason` continues "must be left out ...".
    pub(super) fn refuse(&self, field: &str, reason: &str) -> Result<(), SceneError> {
        match self.optional(field) {
            Some(value) => Err(value.invalid(format!("left out {reason}"))),
            None => Ok(()),
        }
    }

    /// A sub-table, if it is there.
    pub(super) fn table(
        &self,
        field: &str,
        known: &[&str],
    ) -> Result<Option<Table<'d>>, SceneError> {
        let Some((key, value)) = self.table.get_key_value(field) else {
            return Ok(None);
        };
        let value = Value {
            doc: self.doc,
            value,
            path: self.path_of(field),
            separator: '.',
        };
        let line = self.doc.line_at(key.span().start);
        Ok(Some(Table {
            line,
            ..value.as_table(known)?
        }))
    }

    /// The elements of an array of tables, each to be read with [`Value::as_table`]; none when it is left out.
    pub(super) fn elements(&self, field: &str) -> Result<Vec<Value<'d>>, SceneError> {
        self.optional(field)
            .map_or(Ok(Vec::new()), |value| value.as_elements())
    }

    /// A number with a default.
    pub(super) fn number_or(
        &self,
        field: &str,
        range: Range,
        default: f64,
    ) -> Result<f64, SceneError> {
        self.optional(field)
            .map_or(Ok(default), |value| value.as_number(range))
    }

    /// A required number.
    pub(super) fn number(&self, field: &str, range: Range) -> Result<f64, SceneError> {
        self.required(field, &format!("a number {}", range.describe()))?
            .as_number(range)
    }

    /// A required array of `N` numbers.
    pub(super) fn numbers<const N: usize>(
        &self,
        field: &str,
        range: Range,
    ) -> Result<[f64; N], SceneError> {
        self.required(field, &format!("{N} numbers {}", range.describe()))?
            .as_numbers(range)
    }

    /// A required position or displacement.
    pub(super) fn vector(&self, field: &str) -> Result<DVec3, SceneError> {
        Ok(DVec3::from_array(self.numbers(field, Range::finite("m"))?))
    }

    /// A required direction, returned with unit length.
    pub(super) fn direction(&self, field: &str) -> Result<DVec3, SceneError> {
        self.required(field, "a direction of three numbers, not all zero")?
            .as_direction()
    }
}

impl<'d> Value<'d> {
    /// Line, counted from 1.
    pub(super) fn line(&self) -> usize {
        self.doc.line_at(self.value.span().start)
    }

    /// Path of the field, for messages.
    pub(super) fn path(&self) -> &str {
        &self.path
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

    /// A table with no other fields than the known ones.
    pub(super) fn as_table(&self, known: &[&str]) -> Result<Table<'d>, SceneError> {
        let Some(table) = self.value.get_ref().as_table() else {
            return Err(self.invalid(format!("a table with the fields {}", listed(known))));
        };
        let (path, line) = (self.path.clone(), self.line());
        Table {
            doc: self.doc,
            table,
            path,
            separator: self.separator,
            line,
        }
        .knowing(known)
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

    /// A path, taken from the folder of the scene file.
    pub(super) fn as_path(&self) -> Result<PathBuf, SceneError> {
        let text = self.as_text()?;
        if text.is_empty() {
            return Err(self.invalid("the path of a file"));
        }
        Ok(self.doc.base_dir.join(text))
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
        let expected = || self.invalid(format!("one of {}", listed(&words)));
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
        // Scaled first: the square of a very small or large component would leave the range of f64.
        Ok((vector / largest).normalize())
    }
}

fn within(path: &str) -> String {
    if path.is_empty() {
        "the scene file".to_string()
    } else {
        path.to_string()
    }
}

fn listed(names: &[&str]) -> String {
    names
        .iter()
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

/// "did you mean ..." when a known field is close, the known fields otherwise.
fn hint(unknown: &str, known: &[&str]) -> String {
    let scored = known
        .iter()
        .map(|name| (strsim::jaro_winkler(unknown, name), *name));
    match scored.max_by(|x, y| x.0.total_cmp(&y.0)) {
        Some((score, name)) if score >= SIMILAR => format!("did you mean `{name}`?"),
        _ => format!("known fields are {}", listed(known)),
    }
}
