//! A model that loads can be evaluated.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_guidance::Model;

fuzz_target!(|bytes: &[u8]| {
    let Ok(value) = serde_json::from_slice(bytes) else {
        return;
    };
    if let Ok(model) = Model::from_json(&value) {
        model.forward(&[1.0; 20]).expect("20 inputs");
    }
});
