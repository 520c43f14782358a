//! Typed reading of TOML values that keeps the line and the path of every field, so that each error can name both.

use glam::DVec3;
use toml::de::DeTable;

use super::SceneError;
use super::document::{Document, listed};
use super::range::Range;
use super::value::Value;

/// Similarity (Jaro-Winkler, 0 to 1) from which on a known field is proposed for an unknown one.
const SIMILAR: f64 = 0.8;

/// One table of the file; all its fields are known ones.
pub(super) struct Table<'d> {
    pub(super) doc: &'d Document<'d>,
    pub(super) table: &'d DeTable<'d>,
    /// `water`, `object 2`, `object 2 plane`, or empty for the file itself.
    pub(super) path: String,
    pub(super) separator: char,
    pub(super) line: usize,
}

impl<'d> Value<'d> {
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
    pub(super) fn knowing(self, known: &[&str]) -> Result<Self, SceneError> {
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

fn within(path: &str) -> String {
    if path.is_empty() {
        "the scene file".to_string()
    } else {
        path.to_string()
    }
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
