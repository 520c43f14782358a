//! Writes the tables of embedded files: all that ships in the folders below, small files apart from large ones.

use std::env;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// A folder of `assets/`, the ending of its files that ship, and whether they are large.
const SHIPPED: [(&str, &str, bool); 6] = [
    ("models", "json", false),
    ("profiles", "json", false),
    ("vehicles", "toml", false),
    ("scenes", "toml", false),
    ("scenes", "glb", true),
    ("textures", "png", true),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let assets = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?)
        .join("../../assets")
        .canonicalize()?;
    let text = table("SMALL_FILES", &assets, false)? + &table("LARGE_FILES", &assets, true)?;
    let output = PathBuf::from(env::var("OUT_DIR")?).join("embedded.rs");
    Ok(fs::write(output, text)?)
}

/// A `static` of the files that are large or not, by their names in order.
fn table(name: &str, assets: &Path, large: bool) -> Result<String, Box<dyn Error>> {
    let mut files = Vec::new();
    for (folder, ending, is_large) in SHIPPED {
        println!("cargo:rerun-if-changed={}", assets.join(folder).display());
        if is_large == large {
            files.extend(names(&assets.join(folder), folder, ending)?);
        }
    }
    files.sort();
    let mut text = format!(
        "pub(crate) static {name}: [Embedded; {}] = [\n",
        files.len()
    );
    for file in &files {
        let path = assets.join(file);
        writeln!(
            text,
            "    Embedded {{ name: {file:?}, bytes: include_bytes!({path:?}) }},"
        )?;
    }
    text.push_str("];\n");
    Ok(text)
}

/// The files of `folder` with this ending, as `assets/` names them.
fn names(path: &Path, folder: &str, ending: &str) -> Result<Vec<String>, Box<dyn Error>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(path)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == ending) {
            let file = path.file_name().and_then(|name| name.to_str());
            names.push(format!("{folder}/{}", file.ok_or("a name in UTF-8")?));
        }
    }
    Ok(names)
}
