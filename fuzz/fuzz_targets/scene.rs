//! Scene files. They may name other files: none is there.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use uw_render::scene::Scene;

fuzz_target!(|text: &str| {
    // A device would be read for ever.
    if !text.contains("/dev") && !text.contains("/proc") {
        let _ = Scene::parse(text, Path::new("no such folder"), "fuzz.toml");
    }
});
