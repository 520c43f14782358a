//! Heads of requests to the metrics port: each gets a whole reply, and a page only where `Host` is one of its own.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tokio::sync::watch;
use uw_guidance::operations::http::Answers;

static ANSWERS: LazyLock<Answers> = LazyLock::new(|| {
    let (_, stopping) = watch::channel(false);
    Answers::new(uw_fuzz::service(), &["vehicle.local".to_owned()], stopping)
});

fuzz_target!(|head: &[u8]| {
    let reply = ANSWERS.reply(head);
    let (start, body) = reply.split_once("\r\n\r\n").expect("a head and a body");
    let length = format!("Content-Length: {}", body.len());
    assert!(start.lines().any(|line| line == length), "{start}");
    if start.starts_with("HTTP/1.1 200 ") {
        let text = String::from_utf8_lossy(head).to_ascii_lowercase();
        let own = ["localhost", "127.", "::", "0:", "vehicle.local", "http/1.0"];
        assert!(own.iter().any(|name| text.contains(name)), "{text}");
    }
});
