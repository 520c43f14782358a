//! What can be wrong with the water a user describes.

/// Errors of this crate. Each names the field, what was got and what would be right.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MediaError {
    /// A number lies outside its range, or is not finite.
    #[error("{field} must be {expected}, got {got}")]
    OutOfRange {
        /// Name of the field as a scene file writes it.
        field: &'static str,
        /// The valid range, in words and signs.
        expected: &'static str,
        /// The refused value.
        got: f64,
    },
    /// A name that is not in the list of names.
    #[error("unknown {kind} {got:?}; {}known: {known}", question(got, known))]
    UnknownName {
        /// What kind of name was looked up.
        kind: &'static str,
        /// The refused name.
        got: String,
        /// Names that would be right.
        known: String,
    },
    /// An interval of wavelengths that cannot be read or lies outside the table.
    #[error("band {got:?} must be {expected}")]
    BadInterval {
        /// The refused text.
        got: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A data set does not hold the water type that was asked for.
    #[error("bands {bands:?} do not cover Jerlov type {water_type}; covered: {covered}")]
    NotCovered {
        /// The name of the data set.
        bands: &'static str,
        /// The water type that is missing.
        water_type: String,
        /// The water types that it holds.
        covered: String,
    },
    /// A row of a phase function table is unusable.
    #[error("{source_name}, row {row}: {problem}")]
    BadRow {
        /// File name, or "table" for values handed over in memory.
        source_name: String,
        /// Row, counted from 1; in a file this is the line number.
        row: usize,
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// A phase function table is unusable as a whole.
    #[error("{source_name}: {problem}")]
    BadTable {
        /// File name, or "table" for values handed over in memory.
        source_name: String,
        /// What is wrong, and what would be right.
        problem: String,
    },
}

/// Passes `got` on when `valid`, otherwise says what would be right.
pub(crate) fn check(
    field: &'static str,
    got: f64,
    expected: &'static str,
    valid: bool,
) -> Result<f64, MediaError> {
    if valid {
        Ok(got)
    } else {
        Err(MediaError::OutOfRange {
            field,
            expected,
            got,
        })
    }
}

/// The one of `known` names, apart by spaces, that differs from `got` in upper and lower case only.
pub fn meant<'k>(got: &str, known: &'k str) -> Option<&'k str> {
    let mut names = known.split_whitespace();
    names.find(|name| name.eq_ignore_ascii_case(got.trim()))
}

/// The same as a question that stands before the known names.
fn question(got: &str, known: &str) -> String {
    meant(got, known).map_or_else(String::new, |name| format!("did you mean {name:?}? "))
}
