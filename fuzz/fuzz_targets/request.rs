//! Lines of one connection: each gets one reply that is a JSON object.
#![no_main]

use libfuzzer_sys::fuzz_target;
use uw_guidance::service::Session;

fuzz_target!(|bytes: &[u8]| {
    let mut session = Session::new(uw_fuzz::service());
    for line in bytes.split(|&byte| byte == b'\n').take(16) {
        let reply = session.reply(line);
        let value: serde_json::Value = serde_json::from_str(&reply).expect("a reply is JSON");
        assert!(value["ok"].is_boolean());
        let mut now = session.service().now();
        now.since_start_s += 1e3;
        let _ = session.push(now).map(|answered| answered.line(0));
    }
});
