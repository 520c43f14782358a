//! A glTF file in memory: the document, its buffers and the bytes of its images.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::gltf_json::{Buffer, Document};
use super::gltf_rules;

/// Some writers leave out the `=` at the end, and every reader of glTF takes that.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);
/// First bytes of a binary glTF file.
const GLB_MAGIC: &[u8] = b"glTF";
/// Bytes of the header of a binary glTF file.
const GLB_HEADER_BYTES: usize = 12;
/// Bytes of the header of one of its chunks: length and kind.
const CHUNK_HEADER_BYTES: usize = 8;
const CHUNK_JSON: &[u8] = b"JSON";
const CHUNK_BINARY: &[u8] = b"BIN\0";

/// Why a glTF file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// The file itself cannot be opened or read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The glTF file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither glTF JSON nor binary glTF of version 2, or cut short, or inconsistent in itself.
    #[error("{file}: not a valid glTF 2.0 file: {reason}")]
    Malformed {
        /// The glTF file.
        file: String,
        /// What is wrong.
        reason: String,
    },
    /// A buffer or an image is missing or unusable.
    #[error("{file}: {item}: {reason}")]
    Resource {
        /// The glTF file.
        file: String,
        /// Which one, such as `buffer 0 (hull.bin)`.
        item: String,
        /// What is wrong.
        reason: String,
    },
    /// A value is outside its range.
    #[error("{file}: {place} must be {expected}, got {got}")]
    Value {
        /// The glTF file.
        file: String,
        /// Where it stands, such as `mesh 0 (hull) primitive 1 POSITION 17`.
        place: String,
        /// What would be right.
        expected: String,
        /// The value.
        got: String,
    },
}

/// A glTF file with its buffers.
pub(super) struct GltfSource {
    pub(super) file: String,
    folder: PathBuf,
    pub(super) document: Document,
    /// `None` for a buffer that has no bytes of its own, which an extension may fill.
    buffers: Vec<Option<Vec<u8>>>,
}

impl GltfSource {
    /// Reads a `.gltf` or `.glb` file and all its buffers.
    pub(super) fn read(path: &Path) -> Result<Self, GltfError> {
        let file = path.display().to_string();
        let bytes = uw_assets::ALL
            .read(path)
            .map_err(|source| GltfError::Unreadable {
                file: file.clone(),
                source,
            })?;
        let malformed = |reason| GltfError::Malformed {
            file: file.clone(),
            reason,
        };
        let chunks = Chunks::split(&bytes).map_err(malformed)?;
        let document = gltf_rules::parse(chunks.json).map_err(malformed)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut source = Self {
            file,
            folder,
            document,
            buffers: Vec::new(),
        };
        source.buffers = source.read_buffers(&chunks)?;
        Ok(source)
    }

    fn read_buffers(&self, chunks: &Chunks<'_>) -> Result<Vec<Option<Vec<u8>>>, GltfError> {
        let read = |(index, buffer): (usize, &Buffer)| {
            let item = item("buffer", index, buffer.uri.as_deref());
            let bytes = match (&buffer.uri, chunks.binary) {
                (Some(uri), _) => self.read_uri(uri),
                (None, Some(binary)) if index == 0 => Ok(binary.to_vec()),
                (None, None) if index == 0 && chunks.is_binary_file => {
                    Err("the file has no binary chunk".to_string())
                }
                (None, _) => return Ok(None),
            };
            let bytes = bytes.map_err(|reason| self.resource(&item, reason))?;
            if bytes.len() < buffer.byte_length {
                let reason = format!(
                    "must hold byteLength = {} bytes, got {}",
                    buffer.byte_length,
                    bytes.len()
                );
                return Err(self.resource(&item, reason));
            }
            Ok(Some(bytes))
        };
        self.document.buffers.iter().enumerate().map(read).collect()
    }

    /// The bytes of a data URI or of a file beside this one.
    fn read_uri(&self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            return read_data_uri(data);
        }
        if uri.contains("://") {
            return Err("only files and data URIs are read, not network addresses".to_string());
        }
        let name = String::from_utf8(percent_decoded(uri)).map_err(|error| error.to_string())?;
        let path = self.folder.join(name);
        if uw_assets::shipped_name(&path).is_none() {
            let kind = fs::metadata(&path).map_err(|error| error.to_string())?;
            if !kind.is_file() {
                return Err("must be a file; a folder, pipe or device is not read".to_string());
            }
        }
        let bytes = uw_assets::ALL
            .read(&path)
            .map_err(|error| error.to_string())?;
        Ok(bytes.into_owned())
    }

    /// The encoded bytes of an image.
    pub(super) fn image_bytes(&self, index: usize) -> Result<Cow<'_, [u8]>, GltfError> {
        let image = &self.document.images[index];
        let item = item("image", index, image.uri.as_deref());
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.read_uri(uri).map(Cow::Owned),
            (None, Some(view)) => self.view_bytes(view).map(Cow::Borrowed),
            (None, None) => Err("must have a uri or a bufferView".to_string()),
        };
        bytes.map_err(|reason| self.resource(&item, reason))
    }

    /// The bytes of a buffer view, by its index. The error says what is wrong.
    pub(super) fn view_bytes(&self, index: usize) -> Result<&[u8], String> {
        let view = &self.document.buffer_views[index];
        let Some(buffer) = &self.buffers[view.buffer] else {
            return Err(format!(
                "buffer {} has no uri, and nothing else that is read here fills it",
                view.buffer
            ));
        };
        view.byte_offset
            .checked_add(view.byte_length)
            .and_then(|end| buffer.get(view.byte_offset..end))
            .ok_or_else(|| format!("buffer view {index} must not reach beyond its buffer"))
    }

    /// The error for an unusable buffer, image or accessor.
    pub(super) fn resource(&self, item: &str, reason: impl Into<String>) -> GltfError {
        GltfError::Resource {
            file: self.file.clone(),
            item: item.to_string(),
            reason: reason.into(),
        }
    }

    /// The error for a value outside its range.
    pub(super) fn value(
        &self,
        place: impl Into<String>,
        expected: &str,
        got: impl std::fmt::Debug,
    ) -> GltfError {
        let got = format!("{got:?}");
        GltfError::Value {
            file: self.file.clone(),
            place: place.into(),
            expected: expected.to_string(),
            got,
        }
    }
}

/// "mesh 3 (hull)", or "mesh 3" for what has no name.
pub(super) fn item(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if name.starts_with("data:") => format!("{kind} {index} (data URI)"),
        Some(name) => format!("{kind} {index} ({name})"),
        None => format!("{kind} {index}"),
    }
}

/// The parts of a file.
struct Chunks<'a> {
    json: &'a [u8],
    /// The binary chunk of a binary file.
    binary: Option<&'a [u8]>,
    is_binary_file: bool,
}

impl<'a> Chunks<'a> {
    /// A binary file's chunks; any other file is JSON.
    fn split(bytes: &'a [u8]) -> Result<Self, String> {
        if !bytes.starts_with(GLB_MAGIC) {
            return Ok(Self {
                json: bytes,
                binary: None,
                is_binary_file: false,
            });
        }
        let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
            return Err(format!(
                "the header must have {GLB_HEADER_BYTES} bytes, got {}",
                bytes.len()
            ));
        };
        if version != 2 {
            return Err(format!("the header must state version 2, got {version}"));
        }
        if !(GLB_HEADER_BYTES..=bytes.len()).contains(&length) {
            return Err(format!(
                "its header states {length} bytes, the file has {}",
                bytes.len()
            ));
        }
        let (json, rest) = chunk(&bytes[GLB_HEADER_BYTES..length], CHUNK_JSON)?;
        let json = json.ok_or("the first chunk must be JSON")?;
        let (binary, _) = chunk(rest, CHUNK_BINARY)?;
        Ok(Self {
            json,
            binary,
            is_binary_file: true,
        })
    }
}

/// The chunk that `bytes` start with, if it is of the given kind, and what follows it.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8]) -> Result<(Option<&'a [u8]>, &'a [u8]), String> {
    if bytes.is_empty() {
        return Ok((None, bytes));
    }
    let body = word(bytes, 0).and_then(|length| {
        let end = length.checked_add(CHUNK_HEADER_BYTES)?;
        Some((bytes.get(CHUNK_HEADER_BYTES..end)?, &bytes[end..]))
    });
    let Some((body, rest)) = body else {
        return Err("a chunk must not reach beyond the file".to_string());
    };
    let is_wanted = &bytes[4..CHUNK_HEADER_BYTES] == kind;
    Ok((is_wanted.then_some(body), rest))
}

/// The little-endian number at `offset`, if the bytes reach so far.
fn word(bytes: &[u8], offset: usize) -> Option<usize> {
    let word = bytes.get(offset..offset + 4)?;
    let word = u32::from_le_bytes(word.try_into().ok()?);
    usize::try_from(word).ok()
}

/// Decodes what follows `data:`.
fn read_data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (kind, payload) = data
        .split_once(',')
        .ok_or("a data URI must have a comma before its data")?;
    if kind.ends_with(";base64") {
        return BASE64.decode(payload).map_err(|error| error.to_string());
    }
    Ok(percent_decoded(payload))
}

/// Replaces `%41` by `A` and so on; a `%` without two hexadecimal digits stands for itself.
fn percent_decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let pair = bytes.get(i + 1..i + 3).filter(|_| bytes[i] == b'%');
        let value = pair
            .and_then(|pair| std::str::from_utf8(pair).ok())
            .filter(|pair| !pair.starts_with('+'));
        match value.and_then(|pair| u8::from_str_radix(pair, 16).ok()) {
            Some(byte) => {
                decoded.push(byte);
                i += 3;
            }
            None => {
                decoded.push(bytes[i]);
                i += 1;
            }
        }
    }
    decoded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded() {
        let cases = [
            ("application/octet-stream;base64,AAEC", vec![0, 1, 2]),
            (";base64,AAE=", vec![0, 1]),
            (";base64,AAE", vec![0, 1]),
            (",a%20b%zz%", b"a b%zz%".to_vec()),
            ("text/plain,%41%4a", b"AJ".to_vec()),
        ];
        for (uri, bytes) in cases {
            assert_eq!(read_data_uri(uri), Ok(bytes), "{uri}");
        }
        assert!(read_data_uri(";base64").is_err());
        assert!(read_data_uri(";base64,@@@").is_err());
    }
}
