//! Reports of a Doppler log: what is made of them is a request that the protocol accepts.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_daemon::links::dvl::{DvlDistance, state};
use uw_guidance::wire::request::Request;

fuzz_target!(|line: &[u8]| {
    for distance in [DvlDistance::Beams, DvlDistance::Altitude] {
        if let Some(request) = state(line, distance) {
            let _ = Request::parse(request.to_string().as_bytes());
        }
    }
});
