//! Messages of an autopilot: what is made of them is a request that the protocol accepts.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_daemon::links::mavlink::state;
use uw_guidance::wire::request::Request;

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, text)) = bytes.split_first() else {
        return;
    };
    let Ok(message) = serde_json::from_slice(text) else {
        return;
    };
    let name = match kind {
        b'D' => "DISTANCE_SENSOR",
        b'V' => "VFR_HUD",
        _ => "NAMED_VALUE_FLOAT",
    };
    if let Some(request) = state(name, &message, "MAV_SENSOR_ROTATION_NONE") {
        let parsed = Request::parse(request.to_string().as_bytes());
        assert!(parsed.op.is_ok(), "{request} {parsed:?}");
    }
});
