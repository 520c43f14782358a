//! Manifests of a calibration. The images that they list must exist: the corpus names the manifest itself.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_calib::manifest::Manifest;
use uw_calib::vehicle::LevelCurve;

fuzz_target!(|bytes: &[u8]| {
    let curve = LevelCurve::new(vec![[0.0, 0.0], [50.0, 20.0], [100.0, 100.0]]);
    let file = uw_fuzz::as_file("manifest.csv", bytes);
    let _ = Manifest::read(&file, None);
    let _ = Manifest::read(&file, curve.as_ref().ok());
});
