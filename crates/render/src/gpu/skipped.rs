//! Tests that need a graphics adapter, where there is none.

use std::{
    env,
    io::{self, Write},
    sync::atomic::{AtomicU32, Ordering},
    thread,
};

use crate::kernels::GpuError;

static SKIPPED: AtomicU32 = AtomicU32::new(0);

/// Says that the running test is skipped, why, and how many of this program's tests are by now, so that the last such
/// line has the total. Every test calls it once at most. The lines go around the test harness, which shows nothing of
/// tests that pass.
///
/// # Panics
/// With `UW_REQUIRE_GPU=1`, which does not allow it.
pub fn skip_test(error: &GpuError) {
    assert!(
        !env::var("UW_REQUIRE_GPU").is_ok_and(|v| v == "1"),
        "UW_REQUIRE_GPU is set, but {error}"
    );
    let total = SKIPPED.fetch_add(1, Ordering::Relaxed) + 1;
    let thread = thread::current();
    let test = thread.name().unwrap_or("a test");
    let line = format!("\nskipped {test}, {total} GPU tests skipped so far: {error}\n");
    // Where nobody reads it, nobody misses it.
    let _ = io::stderr().write_all(line.as_bytes());
}
