//! Files that are no scene files, told by how they begin.

use super::SceneError;

/// How files of other kinds begin, what they are, and what to do with them.
const KINDS: [(&[u8], &str, &str); 10] = [
    (b"\x89PNG\r\n", "a PNG picture", ""),
    (b"\xff\xd8\xff", "a JPEG picture", ""),
    (b"II*\0", "a TIFF picture", ""),
    (b"MM\0*", "a TIFF picture", ""),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture", ""),
    (b"glTF", "a glTF file", GLTF),
    (b"PAR1", "a Parquet table", ""),
    (b"PK\x03\x04", "a ZIP archive", ""),
    (b"\x1f\x8b", "a compressed file (gzip)", ""),
    (b"%PDF", "a PDF document", ""),
];
const GLTF: &str = "; a scene file names it under [[object]] with gltf = \"FILE\"";

/// Whether `bytes`, the content of `file`, may be a scene file.
///
/// # Errors
/// It begins as no TOML file does, or holds no text.
pub(super) fn check_kind(file: &str, bytes: &[u8]) -> Result<(), SceneError> {
    let known = KINDS.iter().find(|(start, ..)| bytes.starts_with(start));
    let (kind, hint) = match known {
        Some((_, kind, hint)) => (*kind, *hint),
        None if bytes.contains(&0) => ("a binary file", ""),
        None => match bytes.trim_ascii_start().first() {
            Some(b'{') => json(bytes),
            _ => return Ok(()),
        },
    };
    Err(SceneError::NotAScene {
        file: file.to_owned(),
        kind,
        hint,
    })
}

/// What a JSON file is.
fn json(bytes: &[u8]) -> (&'static str, &'static str) {
    let holds = |word: &str| bytes.windows(word.len()).any(|w| w == word.as_bytes());
    if holds("\"asset\"") {
        ("a glTF file", GLTF)
    } else if holds("\"uw-profile/1\"") {
        ("a calibration profile", "")
    } else if holds("\"uw-mlp\"") {
        ("a model file", "")
    } else {
        ("a JSON file", "")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_files_are_told_by_how_they_begin() {
        for (content, kind) in [
            (
                &b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..],
                "is a PNG picture, not a scene file",
            ),
            (b"glTF\x02\0\0\0", "is a glTF file, not a scene file"),
            (b" {\"asset\": {\"version\": \"2.0\"}}", "gltf = \"FILE\""),
            (
                b"{\"format\": \"uw-profile/1\"}",
                "is a calibration profile",
            ),
            (
                b"{\"format\": \"uw-mlp\", \"version\": 1}",
                "is a model file",
            ),
            (b"{}", "is a JSON file"),
            (b"\x7fELF\x02\x01\x01\0", "is a binary file"),
        ] {
            let error = check_kind("pool.toml", content).err();
            let text = error.map(|e| e.to_string()).unwrap_or_default();
            assert!(
                text.starts_with("pool.toml: ") && text.contains(kind),
                "{text}"
            );
        }
        assert!(check_kind("pool.toml", b"\nformat = \"uw-scene/1\"").is_ok());
        assert!(check_kind("pool.toml", b"").is_ok());
    }
}
