//! Recordings.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_guidance::replay::replay;
use uw_guidance::service::Settings;

fuzz_target!(|text: &str| {
    let _ = replay(text, &uw_fuzz::model(), "", &Settings::default());
});
