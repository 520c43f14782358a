//! Everything that can be wrong with a scene file, each naming file, line, field and what would be right.

use super::GltfError;

/// Why a scene could not be read.
///
/// `field` is the path of the field in the file, such as `water.b` or `object 2 plane.size_m`
/// (objects and lamps are counted from 1).
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scene file itself cannot be opened or is not UTF-8.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The scene file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Another kind of file.
    #[error(
        "{file}: is {kind}, not a scene file (TOML that begins with format = \"uw-scene/1\"){hint}"
    )]
    NotAScene {
        /// The file.
        file: String,
        /// What it is, such as "a PNG picture".
        kind: &'static str,
        /// What to do with such a file; empty where nothing is to be said.
        hint: &'static str,
    },
    /// A camera's calibration in the place of a scene.
    #[error("{file}: {reason}")]
    Calibration {
        /// The calibration.
        file: String,
        /// What is wrong with it, with its line.
        reason: String,
    },
    /// A setting that takes the place of a value of the file cannot be used.
    #[error("--set {setting}: {reason}")]
    Setting {
        /// The setting as written.
        setting: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Not TOML.
    #[error("{file}:{line}: not valid TOML: {message}")]
    Syntax {
        /// The scene file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// What the TOML parser said.
        message: String,
    },
    /// A field that the format does not have.
    #[error("{file}:{line}: unknown field `{field}` in {within}; {hint}")]
    UnknownField {
        /// The scene file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// The name as written.
        field: String,
        /// The table that holds it.
        within: String,
        /// The field that was probably meant, or the list of known ones.
        hint: String,
    },
    /// A required field is missing.
    #[error("{file}:{line}: {within} lacks the required field `{field}` ({expected})")]
    MissingField {
        /// The scene file.
        file: String,
        /// Line of the table, counted from 1.
        line: usize,
        /// The table that lacks it.
        within: String,
        /// The missing field.
        field: String,
        /// What would be right.
        expected: String,
    },
    /// A value of the wrong type or outside its range.
    #[error("{file}:{line}: {field} must be {expected}, got {got}")]
    InvalidValue {
        /// The scene file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Path of the field.
        field: String,
        /// What would be right.
        expected: String,
        /// The value as written.
        got: String,
    },
    /// A file that the scene refers to (texture, table, beam profile) cannot be used.
    #[error("{file}:{line}: {field}: {path}: {reason}")]
    ReferencedFile {
        /// The scene file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Path of the field.
        field: String,
        /// The file referred to.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A glTF file that the scene refers to cannot be used.
    #[error("{file}:{line}: {field}: {source}")]
    Gltf {
        /// The scene file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// Path of the field.
        field: String,
        /// What is wrong with it.
        source: Box<GltfError>,
    },
}

impl SceneError {
    /// File and line, counted from 1, where the error has them.
    pub(super) fn place(&self) -> Option<(&str, usize)> {
        match self {
            Self::Unreadable { .. }
            | Self::NotAScene { .. }
            | Self::Calibration { .. }
            | Self::Setting { .. } => None,
            Self::Syntax { file, line, .. }
            | Self::UnknownField { file, line, .. }
            | Self::MissingField { file, line, .. }
            | Self::InvalidValue { file, line, .. }
            | Self::ReferencedFile { file, line, .. }
            | Self::Gltf { file, line, .. } => Some((file, *line)),
        }
    }
}
