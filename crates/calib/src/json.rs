//! JSON read field by field: every error names the field by its path, and unknown fields are refused
//! together with the known field that was probably meant.

use serde_json::{Map, Value};
use thiserror::Error;

/// Characters of a wrong value that a message repeats.
const SHOWN_CHARS: usize = 60;

/// What is wrong with one field of a JSON document.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", self.message())]
pub struct FieldError {
    /// Path of the field, such as `depth[2].k_z`; empty for the document itself.
    pub field: String,
    /// What is wrong with it.
    pub problem: FieldProblem,
}

/// Kinds of wrong fields.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldProblem {
    /// A required field is not there.
    Missing,
    /// The field has no meaning here.
    Unknown {
        /// The known field closest in spelling, where one is close.
        suggestion: Option<String>,
        /// All known fields.
        known: Vec<String>,
    },
    /// The value has another JSON type.
    WrongType {
        /// What would be right.
        expected: String,
        /// What was given.
        got: String,
    },
    /// A number, or a count, outside its range.
    OutOfRange {
        /// What would be right.
        expected: String,
        /// What was given.
        got: String,
    },
    /// The value has the right type but is none of those allowed.
    Invalid {
        /// What would be right.
        expected: String,
        /// What was given.
        got: String,
    },
}

/// Formats of the project's JSON files that are taken for each other, and what they hold.
const FORMATS: [(&str, &str); 2] = [
    ("uw-profile/1", "a calibration profile"),
    ("uw-mlp", "a trained model"),
];

/// Refuses a document of another of the project's formats than `format`, before its fields are looked at.
///
/// # Errors
/// Names what the document is and what it should be.
pub fn expect_format(document: &Value, format: &str) -> Result<(), FieldError> {
    let of = |format: &str| FORMATS.iter().find(|(known, _)| *known == format);
    let got = document.get("format").and_then(Value::as_str).and_then(of);
    match (got, of(format)) {
        (Some((got, is)), Some((_, wanted))) if *got != format => Err(FieldError::invalid(
            "format",
            format!("{format:?} ({wanted})"),
            format!("{got:?} ({is})"),
        )),
        _ => Ok(()),
    }
}

impl FieldError {
    /// A value of the wrong JSON type at `field`.
    pub fn wrong_type(field: impl Into<String>, expected: impl Into<String>, got: &Value) -> Self {
        let problem = FieldProblem::WrongType {
            expected: expected.into(),
            got: shown(got),
        };
        Self {
            field: field.into(),
            problem,
        }
    }

    /// An unacceptable value at `field`.
    pub fn invalid(
        field: impl Into<String>,
        expected: impl Into<String>,
        got: impl ToString,
    ) -> Self {
        let problem = FieldProblem::Invalid {
            expected: expected.into(),
            got: got.to_string(),
        };
        Self {
            field: field.into(),
            problem,
        }
    }

    /// A number outside its range at `field`.
    pub fn out_of_range(
        field: impl Into<String>,
        expected: impl Into<String>,
        got: impl ToString,
    ) -> Self {
        let problem = FieldProblem::OutOfRange {
            expected: expected.into(),
            got: got.to_string(),
        };
        Self {
            field: field.into(),
            problem,
        }
    }

    /// The same error, with `parent` before its path.
    pub fn within(mut self, parent: &str) -> Self {
        self.field = match self.field.is_empty() {
            true => parent.to_owned(),
            false => format!("{parent}.{}", self.field),
        };
        self
    }

    /// A required field that is not there.
    pub fn missing(field: impl Into<String>) -> Self {
        Self {
            field: field.into(),
            problem: FieldProblem::Missing,
        }
    }

    fn message(&self) -> String {
        let field = if self.field.is_empty() {
            "the document"
        } else {
            &self.field
        };
        match &self.problem {
            FieldProblem::Missing => format!("{field} is missing"),
            FieldProblem::Unknown {
                suggestion: Some(near),
                ..
            } => {
                format!("unknown field {field}; did you mean {near}?")
            }
            FieldProblem::Unknown {
                suggestion: None,
                known,
            } => {
                format!(
                    "unknown field {field}; known fields are {}",
                    known.join(", ")
                )
            }
            FieldProblem::WrongType { expected, got }
            | FieldProblem::OutOfRange { expected, got }
            | FieldProblem::Invalid { expected, got } => {
                format!("{field} must be {expected}, got {got}")
            }
        }
    }
}

/// A JSON object and where it stands in its document.
#[derive(Clone, Debug)]
pub struct Object<'a> {
    path: String,
    map: &'a Map<String, Value>,
}

impl<'a> Object<'a> {
    /// `value` as an object; `path` is empty for a whole document.
    pub fn new(value: &'a Value, path: impl Into<String>) -> Result<Self, FieldError> {
        let path = path.into();
        match value {
            Value::Object(map) => Ok(Self { path, map }),
            other => Err(FieldError::wrong_type(path, "a JSON object", other)),
        }
    }

    /// Path of a member of this object.
    pub fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Refuses members other than `known`.
    pub fn only(&self, known: &[&str]) -> Result<(), FieldError> {
        match self.map.keys().find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(key) => Err(FieldError {
                field: self.path_of(&clipped(key)),
                problem: FieldProblem::Unknown {
                    suggestion: nearest(key, known).map(str::to_owned),
                    known: known.iter().map(|&k| k.to_owned()).collect(),
                },
            }),
        }
    }

    /// The member, if it is there.
    pub fn get(&self, name: &str) -> Option<&'a Value> {
        self.map.get(name)
    }

    /// The member, which has to be there.
    pub fn required(&self, name: &str) -> Result<&'a Value, FieldError> {
        self.get(name)
            .ok_or_else(|| FieldError::missing(self.path_of(name)))
    }

    /// A number; JSON numbers are always finite.
    pub fn number(&self, name: &str) -> Result<f64, FieldError> {
        number(self.required(name)?, &self.path_of(name))
    }

    /// An array of exactly `N` numbers.
    pub fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], FieldError> {
        numbers(self.required(name)?, &self.path_of(name))
    }

    /// A string.
    pub fn text(&self, name: &str) -> Result<&'a str, FieldError> {
        let value = self.required(name)?;
        value
            .as_str()
            .ok_or_else(|| FieldError::wrong_type(self.path_of(name), "a string", value))
    }

    /// An array.
    pub fn array(&self, name: &str) -> Result<&'a [Value], FieldError> {
        array(self.required(name)?, &self.path_of(name))
    }

    /// An object.
    pub fn object(&self, name: &str) -> Result<Object<'a>, FieldError> {
        Object::new(self.required(name)?, self.path_of(name))
    }
}

/// `value` as a number.
pub fn number(value: &Value, path: &str) -> Result<f64, FieldError> {
    value
        .as_f64()
        .ok_or_else(|| FieldError::wrong_type(path, "a finite number", value))
}

/// `value` as an array.
pub fn array<'a>(value: &'a Value, path: &str) -> Result<&'a [Value], FieldError> {
    match value {
        Value::Array(items) => Ok(items),
        other => Err(FieldError::wrong_type(path, "an array", other)),
    }
}

/// `value` as an array of exactly `N` numbers.
pub fn numbers<const N: usize>(value: &Value, path: &str) -> Result<[f64; N], FieldError> {
    let items = match value {
        Value::Array(items) if items.len() == N => items,
        other => {
            return Err(FieldError::wrong_type(
                path,
                format!("an array of {N} numbers"),
                other,
            ));
        }
    };
    let mut out = [0.0; N];
    for (k, item) in items.iter().enumerate() {
        out[k] = number(item, &format!("{path}[{k}]"))?;
    }
    Ok(out)
}

/// The candidate closest in spelling to `word`, if it is close enough to be meant.
pub fn nearest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    candidates
        .iter()
        .map(|&candidate| (strsim::jaro_winkler(word, candidate), candidate))
        .filter(|&(similarity, _)| similarity >= 0.8)
        .max_by(|x, y| x.0.total_cmp(&y.0))
        .map(|(_, candidate)| candidate)
}

/// A value as a message shows it: its type and its beginning.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(b) => format!("the boolean {b}"),
        Value::Number(n) => format!("the number {n}"),
        Value::String(s) => format!("the string {:?}", clipped(s)),
        Value::Array(items) => format!("an array of {}", items.len()),
        Value::Object(map) => format!("an object of {} fields", map.len()),
    }
}

fn clipped(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARS) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_misspelt_field_is_named_with_the_one_meant() {
        let document = json!({"outer": {"dpeth_m": 1.0}});
        let outer = Object::new(&document, "").unwrap().object("outer").unwrap();
        let error = outer.only(&["depth_m", "distance_m"]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown field outer.dpeth_m; did you mean depth_m?"
        );
    }

    #[test]
    fn a_far_off_field_lists_what_is_known() {
        let document = json!({"zzz": 1});
        let error = Object::new(&document, "")
            .unwrap()
            .only(&["mean", "std"])
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown field zzz; known fields are mean, std"
        );
    }

    #[test]
    fn wrong_types_and_lengths_say_what_is_right() {
        let document = json!({"k": [1, "x", 3], "n": "3.0", "short": [1]});
        let object = Object::new(&document, "").unwrap();
        assert_eq!(
            object.numbers::<3>("k").unwrap_err().to_string(),
            "k[1] must be a finite number, got the string \"x\""
        );
        assert_eq!(
            object.number("n").unwrap_err().to_string(),
            "n must be a finite number, got the string \"3.0\""
        );
        assert_eq!(
            object.numbers::<3>("short").unwrap_err().to_string(),
            "short must be an array of 3 numbers, got an array of 1"
        );
        assert_eq!(
            object.number("gone").unwrap_err().to_string(),
            "gone is missing"
        );
    }

    #[test]
    fn long_values_are_clipped_at_character_boundaries() {
        let document = json!({"name": "ä".repeat(500)});
        let error = Object::new(&document, "")
            .unwrap()
            .number("name")
            .unwrap_err();
        assert!(error.to_string().len() < 250);
    }
}
