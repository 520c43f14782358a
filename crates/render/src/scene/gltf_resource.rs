//! A glTF file in memory: the document, its buffers and the bytes of its images.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use gltf::{Document, Gltf};

/// Bytes of the header of a binary glTF file.
const GLB_HEADER_BYTES: u32 = 12;

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
    buffers: Vec<Vec<u8>>,
}

impl GltfSource {
    /// Reads a `.gltf` or `.glb` file and all its buffers.
    pub(super) fn read(path: &Path) -> Result<Self, GltfError> {
        let file = path.display().to_string();
        let bytes = fs::read(path).map_err(|source| GltfError::Unreadable {
            file: file.clone(),
            source,
        })?;
        let malformed = |reason| GltfError::Malformed {
            file: file.clone(),
            reason,
        };
        let (document, blob) = parse(&bytes).map_err(malformed)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut source = Self {
            file,
            folder,
            document,
            buffers: Vec::new(),
        };
        source.buffers = source.read_buffers(blob)?;
        Ok(source)
    }

    fn read_buffers(&self, mut blob: Option<Vec<u8>>) -> Result<Vec<Vec<u8>>, GltfError> {
        let read = |buffer: gltf::Buffer<'_>| {
            let (name, bytes) = match buffer.source() {
                gltf::buffer::Source::Bin => (
                    None,
                    blob.take()
                        .ok_or("the file has no binary chunk".to_string()),
                ),
                gltf::buffer::Source::Uri(uri) => (Some(uri), self.read_uri(uri)),
            };
            let item = item("buffer", buffer.index(), name);
            let bytes = bytes.map_err(|reason| self.resource(&item, reason))?;
            if bytes.len() < buffer.length() {
                let reason = format!(
                    "must hold byteLength = {} bytes, got {}",
                    buffer.length(),
                    bytes.len()
                );
                return Err(self.resource(&item, reason));
            }
            Ok(bytes)
        };
        self.document.buffers().map(read).collect()
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
        fs::read(self.folder.join(name)).map_err(|error| error.to_string())
    }

    /// The encoded bytes of an image.
    pub(super) fn image_bytes(&self, index: usize) -> Result<Vec<u8>, GltfError> {
        let image = &self.document.as_json().images[index];
        let item = item("image", index, image.uri.as_deref());
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.read_uri(uri),
            (None, Some(view)) => {
                let view = self.document.views().nth(view.value());
                view.and_then(|view| self.view_bytes(&view))
                    .map(<[u8]>::to_vec)
                    .ok_or_else(|| "its buffer view reaches beyond the buffer".to_string())
            }
            (None, None) => Err("must have a uri or a bufferView".to_string()),
        };
        bytes.map_err(|reason| self.resource(&item, reason))
    }

    /// The bytes of a buffer view; `None` when it reaches beyond its buffer.
    pub(super) fn view_bytes(&self, view: &gltf::buffer::View<'_>) -> Option<&[u8]> {
        let end = view.offset().checked_add(view.length())?;
        self.buffers
            .get(view.buffer().index())?
            .get(view.offset()..end)
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

/// Refuses binary files whose length field cannot be right, which the parser takes for granted.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let Some(field) = bytes
        .get(8..12)
        .and_then(|field| <[u8; 4]>::try_from(field).ok())
    else {
        return Err(format!(
            "the header must have {GLB_HEADER_BYTES} bytes, got {}",
            bytes.len()
        ));
    };
    let length = u32::from_le_bytes(field);
    if length < GLB_HEADER_BYTES || length as usize > bytes.len() {
        return Err(format!(
            "its header states {length} bytes, the file has {}",
            bytes.len()
        ));
    }
    Ok(())
}

/// Parses and validates the file. What validation takes for granted is checked before it.
fn parse(bytes: &[u8]) -> Result<(Document, Option<Vec<u8>>), String> {
    check_header(bytes)?;
    let Gltf { document, blob } =
        Gltf::from_slice_without_validation(bytes).map_err(|error| describe(&error))?;
    let json = document.into_json();
    let accessors = json.accessors.len();
    for (i, mesh) in json.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let listed = primitive.attributes.values().map(|index| index.value());
            if let Some(index) = listed.max().filter(|index| *index >= accessors) {
                let place = format!("meshes[{i}].primitives[{j}].attributes");
                return Err(format!(
                    "{place} must be accessors below {accessors}, got {index}"
                ));
            }
        }
    }
    let document = Document::from_json(json).map_err(|error| describe(&error))?;
    Ok((document, blob))
}

fn describe(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Validation(errors) => match errors.first() {
            Some((path, error)) => format!("{path}: {error}"),
            None => error.to_string(),
        },
        _ => error.to_string(),
    }
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
