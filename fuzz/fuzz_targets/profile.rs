//! A profile that loads answers inside its range and survives writing and reading.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_calib::Profile;

fuzz_target!(|bytes: &[u8]| {
    let Ok(value) = serde_json::from_slice(bytes) else {
        return;
    };
    if let Ok(profile) = Profile::from_json(&value) {
        let (min, max) = profile.distance_range_m();
        profile.k_c_on(min).expect("inside");
        profile.k_c_off(max).expect("inside");
        let text = profile.to_json();
        let again =
            Profile::from_json(&serde_json::from_str(&text).expect("JSON")).expect("usable");
        assert_eq!(again, profile);
    }
});
