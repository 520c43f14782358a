//! Manifests of a calibration. The images that they list must exist: the corpus names the manifest itself.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_calib::manifest::Manifest;

fuzz_target!(|bytes: &[u8]| {
    let _ = Manifest::read(&uw_fuzz::as_file("manifest.csv", bytes));
});
