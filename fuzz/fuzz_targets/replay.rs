//! Recordings: as they come, and behind a start that fits the model, so that the answers are reached too.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use uw_guidance::record::RECORD_FORMAT;
use uw_guidance::replay::replay;
use uw_guidance::service::{Basis, ImagePolicy, Settings};

static MODEL: LazyLock<Basis> = LazyLock::new(|| uw_fuzz::model().into());
static START: LazyLock<String> = LazyLock::new(|| {
    let service = uw_fuzz::service();
    let mut start = service.describe(&service.loaded());
    start["format"] = RECORD_FORMAT.into();
    start["kind"] = "start".into();
    start["sequence"] = 0.into();
    start.to_string()
});
static SETTINGS: LazyLock<Settings> = LazyLock::new(|| Settings {
    images: ImagePolicy::NoFile,
    ..Settings::default()
});

fuzz_target!(|recording: &[u8]| {
    let _ = replay(recording, &MODEL, "", &SETTINGS);
    let begun = [START.as_bytes(), b"\n", recording].concat();
    let _ = replay(&begun, &MODEL, "", &SETTINGS);
});
