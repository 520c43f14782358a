//! How far a run is: a line on standard error every few seconds.

use std::fmt::Display;
use std::io::Write;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between two lines.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Tells how far a run is; from any thread.
pub(super) struct Lines {
    start: Instant,
    next: Mutex<Duration>,
}

impl Lines {
    /// Nothing told yet.
    pub(super) fn new() -> Self {
        Self {
            start: Instant::now(),
            next: Mutex::new(Duration::ZERO),
        }
    }

    /// Tells the share done in [0, 1] and what is being done, unless a line has just been written.
    pub(super) fn tell(&self, share: f64, doing: &str) {
        let elapsed = self.start.elapsed();
        // A thread that panicked while telling leaves nothing half done.
        let mut next = self.next.lock().unwrap_or_else(|e| e.into_inner());
        if elapsed >= *next {
            *next = elapsed + LINE_EVERY;
            let (percent, seconds) = (100.0 * share, elapsed.as_secs());
            note(format_args!("{percent:5.1} % after {seconds} s  {doing}"));
        }
    }
}

/// Writes a line to standard error. When that is closed there is nobody to tell.
pub(super) fn note(line: impl Display) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}
