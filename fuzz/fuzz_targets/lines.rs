//! Splitting bytes into lines gives the same lines whatever pieces they come in.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tokio::io::BufReader;
use uw_guidance::wire::frame::{Frame, Lines};

fn lines(bytes: &[u8], piece: usize, of_client: bool) -> Vec<Frame> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .expect("a runtime");
    runtime.block_on(async {
        let reader = BufReader::with_capacity(piece, bytes);
        let mut lines = match of_client {
            true => Lines::of_client(reader),
            false => Lines::new(reader),
        };
        let mut frames = Vec::new();
        loop {
            match lines.next().await.expect("memory does not fail") {
                Frame::End => return frames,
                frame => frames.push(frame),
            }
        }
    })
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&piece, bytes)) = bytes.split_first() else {
        return;
    };
    for of_client in [false, true] {
        let pieces = lines(bytes, usize::from(piece).max(1), of_client);
        assert_eq!(pieces, lines(bytes, 8192, of_client));
    }
});
