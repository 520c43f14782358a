//! Turns the compute kernels of `shaders/` into Rust: composed, parsed and checked by naga, and written as calls of functions,
//! of those of `src/four.rs`, `src/avx2.rs` or `src/avx512.rs` for several lanes at once, of those of `src/scalar.rs` for
//! one lane in double precision.

mod compose;
mod expressions;
mod function;
mod module;
mod places;
mod scalar;
mod types;

use std::{
    collections::HashSet,
    env,
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use function::Form;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Kernels that are turned into Rust.
const KERNELS: [&str; 2] = ["lamps", "ambient"];
/// How the kernels ask whether the water varies with depth or place, whether surfaces shine, and (daylight's alone) whether lamps are
/// in the air. Vector units have each kernel twice: the plain one is made without all that these need. Called but not taken, varying water
/// made scenes with a sun slower, because the compiler inlined less.
const PLAIN_WITHOUT: [(&str, &[&str]); 3] = [
    ("s.switches.HAS_LAYERS", &KERNELS),
    ("s.switches.HAS_GLOSS", &KERNELS),
    ("s.switches.HAS_AIR_LAMPS", &["ambient"]),
];
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
    let mut functions = HashSet::new();
    for kernel in KERNELS {
        let text = compose::compose(sources(), &format!("kernels/{kernel}"))?;
        let parsed = naga::front::wgsl::parse_str(&text);
        let module = parsed.map_err(|e| format!("{kernel}: {}", e.emit_to_string(&text)))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .map_err(|e| format!("{kernel}: {}", e.emit_to_string(&text)))?;
        functions.extend(module.functions.iter().filter_map(|(_, f)| f.name.clone()));
        for (set, attribute) in INSTRUCTION_SETS {
            let full = module::write(&module, &info, Form::Lanes, attribute);
            let mut plain = full.clone();
            for (switch, kernels) in PLAIN_WITHOUT {
                if plain.contains(switch) != kernels.contains(&kernel) {
                    return Err(format!("only {kernels:?} should ask for {switch}").into());
                }
                plain = plain.replace(switch, "false");
            }
            for (scenes, code) in [("plain", plain), ("full", full)] {
                fs::write(out.join(format!("{kernel}_{scenes}_{set}.rs")), code)?;
            }
        }
        let code = module::write(&module, &info, Form::Scalar, "");
        fs::write(out.join(format!("{kernel}_scalar.rs")), code)?;
    }
    let mut by_hand = [Form::Lanes, Form::Scalar]
        .into_iter()
        .flat_map(Form::by_hand);
    match by_hand.find(|(name, _)| !functions.contains(*name)) {
        Some((name, _)) => Err(format!("the kernels have no function {name}").into()),
        None => Ok(()),
    }
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
