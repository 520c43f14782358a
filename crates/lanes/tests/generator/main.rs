//! What the generator of `build/` writes for every construct of the language, in both forms.
//!
//! `UW_UPDATE_GOLDEN=1` writes the files anew; look at what has changed.

#![allow(dead_code, reason = "the build script uses more of its modules")]

#[path = "../../build/expressions.rs"]
mod expressions;
#[path = "../../build/function.rs"]
mod function;
#[path = "../../build/module.rs"]
mod module;
#[path = "../../build/places.rs"]
mod places;
#[path = "../../build/scalar.rs"]
mod scalar;
#[path = "../../build/types.rs"]
mod types;

use std::{fs, path::Path};

use function::Form;
use naga::{
    Module,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/generator"))
}

fn parsed(text: &str) -> (Module, ModuleInfo) {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    (module, info)
}

/// Compares with a file, or writes it.
fn assert_golden(name: &str, text: &str) {
    let path = folder().join(name);
    if std::env::var_os("UW_UPDATE_GOLDEN").is_some_and(|v| v == "1") {
        fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    let golden = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let lines = golden.lines().zip(text.lines());
    if let Some((number, (golden, ours))) = (1..).zip(lines).find(|(_, (a, b))| a != b) {
        panic!("{name}:{number}: {ours:?} is written, not {golden:?}");
    }
    assert_eq!(
        text.lines().count(),
        golden.lines().count(),
        "lines of {name}"
    );
}

#[test]
fn every_construct_is_written_as_it_was() {
    let (module, info) = parsed(include_str!("constructs.wgsl"));
    for (form, attribute, name) in [
        (Form::Lanes, "#[lane]", "constructs_lanes.txt"),
        (Form::Scalar, "", "constructs_scalar.txt"),
    ] {
        assert_golden(name, &module::write(&module, &info, form, attribute));
    }
}

/// Powers of two and numbers of the circle are themselves in double precision, other numbers what was written.
#[test]
fn numbers_in_double_precision_are_those_that_were_meant() {
    let text = "fn f() -> vec4f { return vec4f(0.1, 6.2831853, 2.3283064e-10, 1e30); }
        @compute @workgroup_size(1) fn main() { _ = f(); }";
    let (module, info) = parsed(text);
    let code = module::write(&module, &info, Form::Scalar, "");
    for number in [
        "0.1f64",
        "6.283185307179586f64",
        "2.3283064365386963e-10f64",
        "1e30f64",
    ] {
        assert!(code.contains(number), "{number} is not in\n{code}");
    }
}
