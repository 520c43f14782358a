//! Turns the compute kernels of `shaders/` into Rust that runs each of them on several lanes at once: composed by wesl,
//! parsed and checked by naga, and written as calls of the functions of `src/four.rs`, `src/avx2.rs` or `src/avx512.rs`.

mod compose;
mod expressions;
mod function;
mod module;
mod places;
mod types;

use std::{
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Kernels that are turned into Rust.
const KERNELS: [&str; 2] = ["lamps", "ambient"];
/// Instruction sets: the module with their functions, and the attribute of all functions that use it.
const INSTRUCTION_SETS: [(&str, &str); 4] = [
    ("baseline", ""),
    (
        "sse4",
        "#[target_feature(enable = \"fxsr,sse4.2,cmpxchg16b,popcnt\")]",
    ),
    ("avx2", "#[target_feature(enable = \"avx2,fma\")]"),
    (
        "avx512",
        "#[target_feature(enable = \"avx2,fma,avx512f,avx512vl,avx512dq,avx512bw\")]",
    ),
];

#[allow(clippy::print_stdout, reason = "that is how cargo is told")]
fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../../shaders");
    println!("cargo::rerun-if-changed={}", root.display());
    println!("cargo::rerun-if-changed=build");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let sources = sources(&root)?;
    let sources = || sources.iter().map(|(path, text)| (&**path, &**text));
    for kernel in KERNELS {
        let text = compose::compose(sources(), &format!("kernels/{kernel}"))?;
        let parsed = naga::front::wgsl::parse_str(&text);
        let module = parsed.map_err(|e| format!("{kernel}: {}", e.emit_to_string(&text)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .map_err(|e| format!("{kernel}: {}", e.emit_to_string(&text)))?;
        for (set, attribute) in INSTRUCTION_SETS {
            let code = module::write(&module, &info, attribute);
            fs::write(out.join(format!("{kernel}_{set}.rs")), code)?;
        }
    }
    Ok(())
}

/// The texts of all shaders that kernels import, by their paths below `shaders/`.
fn sources(root: &Path) -> Result<Vec<(String, String)>, Box<dyn Error>> {
    let mut sources = Vec::new();
    for folder in ["common", "kernels"] {
        for entry in fs::read_dir(root.join(folder))? {
            let path = entry?.path();
            let name = path.file_stem().and_then(|s| s.to_str());
            if let (Some(name), Some("wgsl")) = (name, path.extension().and_then(|e| e.to_str())) {
                sources.push((format!("{folder}/{name}"), fs::read_to_string(&path)?));
            }
        }
    }
    Ok(sources)
}
