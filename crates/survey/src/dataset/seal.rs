//! Checksums of the files that a later run reads, so that none is believed that something has changed since.
//!
//! A checksum is the CRC-32 of the file's name inside the output folder and of its bytes: a changed digit, a flipped
//! bit, a torn file and a file under another's name are all found. Where it stands depends on the kind of file: at the
//! end (`.sums`), as the last number of every line (tables of images), or as the field `crc32` (JSON). A damaged file is
//! named and made again; one of an earlier version, without a checksum, is used and counted.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// Field of the checksum in JSON.
const FIELD: &str = "crc32";

/// What was found where a file should be.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Found<T> {
    /// No file.
    Absent,
    /// A file that cannot be believed, and why.
    Damaged(String),
    /// A file of an earlier version, which carries no checksum.
    Unsealed(T),
    /// A file as it was written.
    Sealed(T),
}

impl<T> Found<T> {
    /// Damage by a checksum that is not that of the bytes.
    pub(super) fn changed() -> Self {
        Self::Damaged("its bytes do not match its checksum".into())
    }

    /// The same with another content; `None` of `map` is damage of the kind `reason`.
    pub(super) fn and_then<U>(self, reason: &str, map: impl FnOnce(T) -> Option<U>) -> Found<U> {
        let or_damaged = |content, seal: fn(U) -> Found<U>| match map(content) {
            Some(content) => seal(content),
            None => Found::Damaged(reason.to_owned()),
        };
        match self {
            Self::Absent => Found::Absent,
            Self::Damaged(reason) => Found::Damaged(reason),
            Self::Unsealed(content) => or_damaged(content, Found::Unsealed),
            Self::Sealed(content) => or_damaged(content, Found::Sealed),
        }
    }

    /// Why the file cannot be believed, where it is there and cannot be.
    pub(super) fn damage(&self) -> Option<&str> {
        match self {
            Self::Damaged(reason) => Some(reason),
            _ => None,
        }
    }
}

/// CRC-32 of the `name` of a file and of its bytes.
pub(super) fn checksum(name: &str, bytes: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(name.as_bytes());
    // Ends the name, which holds no zero.
    hasher.update(&[0]);
    hasher.update(bytes);
    hasher.finalize()
}

/// `content` (an object) as JSON with its checksum as the field `crc32`.
pub(super) fn to_json<T: Serialize>(name: &str, content: &T) -> serde_json::Result<String> {
    let mut object = serde_json::to_value(content)?;
    let sum = checksum(name, object.to_string().as_bytes());
    if let Value::Object(fields) = &mut object {
        fields.insert(FIELD.into(), sum.into());
    }
    Ok(format!("{object:#}\n"))
}

/// Reads what [`to_json`] wrote.
pub(super) fn from_json<T: DeserializeOwned>(name: &str, text: &[u8]) -> Found<T> {
    let Ok(mut fields) = serde_json::from_slice::<Map<String, Value>>(text) else {
        return Found::Damaged("it is not a JSON object".into());
    };
    let stated = fields.remove(FIELD);
    let object = Value::Object(fields);
    let sum = checksum(name, object.to_string().as_bytes());
    let found = match stated {
        None => Found::Unsealed(object),
        Some(stated) if stated == sum => Found::Sealed(object),
        Some(_) => Found::changed(),
    };
    found.and_then("its fields are not those of this program", |object| {
        serde_json::from_value(object).ok()
    })
}

/// Keeps an eye on the files of an output folder and tells what is wrong with them.
pub(super) struct Watch<'a> {
    folder: &'a Path,
    tell: &'a (dyn Fn(&str) + Sync),
    unsealed: Mutex<BTreeSet<PathBuf>>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(folder: &'a Path, tell: &'a (dyn Fn(&str) + Sync)) -> Self {
        Self {
            folder,
            tell,
            unsealed: Mutex::default(),
        }
    }

    /// Name of a file inside the output folder, with `/` between its parts: what its checksum covers.
    pub(super) fn name(&self, path: &Path) -> String {
        name_in(self.folder, path)
    }

    /// What can be used of `found` at `path`; damage is told.
    pub(super) fn accept<T>(&self, path: &Path, found: Found<T>) -> Option<T> {
        match found {
            Found::Absent => None,
            Found::Damaged(reason) => {
                self.damaged(path, &reason);
                None
            }
            Found::Unsealed(content) => {
                let unsealed = self.unsealed.lock();
                unsealed
                    .unwrap_or_else(PoisonError::into_inner)
                    .insert(path.to_path_buf());
                Some(content)
            }
            Found::Sealed(content) => Some(content),
        }
    }

    /// Tells that the file at `path` is made again.
    pub(super) fn damaged(&self, path: &Path, reason: &str) {
        self.say(&format!(
            "{} is damaged: {reason}; it is made again",
            path.display()
        ));
    }

    pub(super) fn say(&self, line: &str) {
        (self.tell)(line);
    }

    /// Tells how many files without a checksum were used.
    pub(super) fn tell_unsealed(&self) {
        let unsealed = self.unsealed.lock();
        let unsealed = unsealed.unwrap_or_else(PoisonError::into_inner);
        if let Some(first) = unsealed.first() {
            self.say(&format!(
                "{} files carry no checksum, {} among them: an earlier version made them, and they were used as they are; \
                 delete them to have them made again with one",
                unsealed.len(),
                first.display()
            ));
        }
    }
}

/// Name of the file at `path` inside `folder`, with `/` between its parts.
pub(crate) fn name_in(folder: &Path, path: &Path) -> String {
    let inside = path.strip_prefix(folder).unwrap_or(path);
    let parts = inside.iter().map(|part| part.to_string_lossy());
    parts.collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Content {
        value: f64,
        list: Vec<u32>,
    }

    #[test]
    fn every_flipped_bit_of_a_json_file_is_found_or_harmless() {
        let content = Content {
            value: 8.610_000_000_000_001,
            list: vec![1, 20, 300],
        };
        let text = to_json("a.json", &content).expect("numbers");
        assert_eq!(
            from_json("a.json", text.as_bytes()),
            Found::Sealed(content.clone())
        );
        let other_name = from_json::<Content>("b.json", text.as_bytes());
        assert_eq!(other_name, Found::changed());
        for bit in 0..8 * text.len() {
            let mut bytes = text.clone().into_bytes();
            bytes[bit / 8] ^= 1 << (bit % 8);
            match from_json::<Content>("a.json", &bytes) {
                Found::Damaged(_) => {}
                // White space may become other white space.
                found => assert_eq!(found, Found::Sealed(content.clone()), "bit {bit}"),
            }
        }
    }

    #[test]
    fn json_without_a_checksum_is_of_an_earlier_version() {
        let found = from_json::<Content>("a.json", br#"{"value": 1, "list": []}"#);
        assert!(matches!(found, Found::Unsealed(_)), "{found:?}");
    }
}
