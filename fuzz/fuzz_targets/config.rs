//! Configuration files.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_daemon::Config;

fuzz_target!(|text: &str| {
    let _ = Config::parse(text, "fuzz.toml");
});
