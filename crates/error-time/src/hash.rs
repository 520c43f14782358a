//! Hashes that tell the contents of scenes and programs apart.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Fields of scene files that name other files, and the one of glTF files that does.
const FILE_FIELDS: [&str; 4] = ["texture", "gltf", "file", "uri"];
/// Where the JSON of a binary glTF file has its length, and where it begins (glTF 2.0, section 4.4).
const GLB_JSON_LENGTH: std::ops::Range<usize> = 12..16;
const GLB_JSON: usize = 20;

/// A file cannot be read for its hash.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot be read: {source}", path.display())]
pub struct HashError {
    /// The file.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

/// A hash of what a scene file says and of the files it names (textures, glTF with its buffers and pictures, beams,
/// phase tables), in 16 hexadecimal digits. Comments, spacing and the order of fields in a table do not matter.
///
/// # Errors
/// A file that cannot be read.
pub fn content_hash(path: &Path) -> Result<String, HashError> {
    let mut files = BTreeSet::new();
    let mut hash = Fnv::default();
    let bytes = read(path)?;
    // A scene that could be read is text and TOML; anything else is hashed as it stands.
    match std::str::from_utf8(&bytes)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
    {
        Some(table) => {
            let table = toml::Value::Table(table);
            hash.add(table.to_string().as_bytes());
            files_in_toml(&table, folder_of(path), &mut files);
        }
        None => hash.add(&bytes),
    }
    for file in files.clone() {
        let bytes = read(&file)?;
        let json = match file.extension().and_then(|e| e.to_str()) {
            Some("gltf") => Some(&bytes[..]),
            Some("glb") => glb_json(&bytes),
            _ => None,
        };
        if let Some(json) = json.and_then(|json| serde_json::from_slice(json).ok()) {
            files_in_json(&json, folder_of(&file), &mut files);
        }
    }
    for file in files {
        hash.add(&read(&file)?);
    }
    Ok(hash.hex())
}

/// A hash of the bytes of a file, in 16 hexadecimal digits.
///
/// # Errors
/// A file that cannot be read.
pub fn file_hash(path: &Path) -> Result<String, HashError> {
    let mut hash = Fnv::default();
    hash.add(&read(path)?);
    Ok(hash.hex())
}

fn read(path: &Path) -> Result<Vec<u8>, HashError> {
    fs::read(path).map_err(|source| HashError {
        path: path.to_path_buf(),
        source,
    })
}

/// The JSON chunk of a binary glTF file.
fn glb_json(bytes: &[u8]) -> Option<&[u8]> {
    let length = u32::from_le_bytes(bytes.get(GLB_JSON_LENGTH)?.try_into().ok()?);
    bytes.get(GLB_JSON..)?.get(..length as usize)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

/// Adds `name` if there is such a file: other strings under the same field names are no file names.
fn add_file(folder: &Path, name: &str, files: &mut BTreeSet<PathBuf>) {
    let path = folder.join(name);
    if path.is_file() {
        files.insert(path);
    }
}

fn files_in_toml(value: &toml::Value, folder: &Path, files: &mut BTreeSet<PathBuf>) {
    match value {
        toml::Value::Table(table) => {
            for (field, value) in table {
                match value {
                    toml::Value::String(name) if FILE_FIELDS.contains(&field.as_str()) => {
                        add_file(folder, name, files);
                    }
                    _ => files_in_toml(value, folder, files),
                }
            }
        }
        toml::Value::Array(values) => values.iter().for_each(|v| files_in_toml(v, folder, files)),
        _ => {}
    }
}

fn files_in_json(value: &serde_json::Value, folder: &Path, files: &mut BTreeSet<PathBuf>) {
    match value {
        serde_json::Value::Object(object) => {
            for (field, value) in object {
                match value.as_str() {
                    Some(name) if FILE_FIELDS.contains(&field.as_str()) => {
                        add_file(folder, name, files);
                    }
                    _ => files_in_json(value, folder, files),
                }
            }
        }
        serde_json::Value::Array(values) => {
            values.iter().for_each(|v| files_in_json(v, folder, files));
        }
        _ => {}
    }
}

/// 64-bit FNV-1a (Fowler, Noll and Vo): tells files apart that differ by accident, not by intent.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// Adds the bytes and their number, so that files do not run into each other.
    fn add(&mut self, bytes: &[u8]) {
        let length = (bytes.len() as u64).to_le_bytes();
        for &byte in bytes.iter().chain(&length) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn hex(&self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "[camera]\nwidth = 4\nheight = 3\n[[object]]\ngltf = \"hull.gltf\"\n";

    #[test]
    fn the_hash_follows_the_content_and_the_files_it_names() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        let hash = || content_hash(&folder.path().join("scene.toml")).unwrap();
        write("scene.toml", SCENE);
        write("hull.gltf", r#"{"images": [{"uri": "paint.png"}]}"#);
        write("paint.png", "red");
        let first = hash();
        assert!(first.len() == 16 && first.chars().all(|c| c.is_ascii_hexdigit()));
        write(
            "scene.toml",
            &format!(
                "# A comment.\n{}",
                SCENE.replace("width = 4\nheight = 3", "height=3\r\nwidth=4")
            ),
        );
        assert_eq!(hash(), first);
        write("unrelated.png", "blue");
        assert_eq!(hash(), first);
        let change = |name: &str, text: &str, other: &str| {
            write(name, other);
            assert_ne!(hash(), first, "{name}");
            write(name, text);
            assert_eq!(hash(), first, "{name}");
        };
        change(
            "scene.toml",
            SCENE,
            &SCENE.replace("height = 3", "height = 5"),
        );
        change(
            "hull.gltf",
            r#"{"images": [{"uri": "paint.png"}]}"#,
            r#"{"images": [{"uri": "paint.png"}], "x": 1}"#,
        );
        change("paint.png", "red", "green");
    }

    #[test]
    fn binary_gltf_names_its_files_too() {
        let folder = tempfile::tempdir().unwrap();
        let json = br#"{"images": [{"uri": "paint.png"}]}  "#;
        let mut glb = b"glTF\x02\0\0\0....".to_vec();
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        fs::write(folder.path().join("hull.glb"), &glb).unwrap();
        fs::write(folder.path().join("paint.png"), "red").unwrap();
        let scene = folder.path().join("scene.toml");
        fs::write(&scene, SCENE.replace("gltf\"", "glb\"")).unwrap();
        let first = content_hash(&scene).unwrap();
        fs::write(folder.path().join("paint.png"), "green").unwrap();
        assert_ne!(content_hash(&scene).unwrap(), first);
        // Cut in the middle of its length it names none.
        assert_eq!(glb_json(&glb[..14]), None);
    }
}
