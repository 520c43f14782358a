//! How far a long run is: a bar on a terminal, a plain line every few seconds elsewhere.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::error::note;

/// Time between two plain lines.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Steps of a bar from start to end.
const STEPS: u64 = 1000;
const BAR: &str = "{bar:40} {percent:>3} %  {elapsed} gone, {eta} left  {msg}";
const SPINNER: &str = "{spinner} {elapsed} gone  {msg}";

/// Shows how far a run is; can be told from any thread.
pub(crate) struct ProgressDisplay {
    kind: Kind,
    start: Instant,
}

enum Kind {
    Silent,
    Lines { next_ms: AtomicU64 },
    Bar(ProgressBar),
}

impl ProgressDisplay {
    /// A bar when standard error is a terminal, lines otherwise, nothing when `silent`. `known_end` says whether
    /// the share that is done will be known.
    pub(crate) fn start(silent: bool, known_end: bool) -> Self {
        let kind = if silent {
            Kind::Silent
        } else if io::stderr().is_terminal() {
            Kind::Bar(bar(known_end))
        } else {
            let next_ms = AtomicU64::new(milliseconds(LINE_EVERY));
            Kind::Lines { next_ms }
        };
        Self {
            kind,
            start: Instant::now(),
        }
    }

    /// Tells that `share` in [0, 1] of the run is done, where that is known; `message` may add to it.
    pub(crate) fn update(&self, share: Option<f64>, message: impl FnOnce() -> String) {
        match &self.kind {
            Kind::Silent => {}
            Kind::Lines { next_ms } => {
                let elapsed = self.start.elapsed();
                if is_due(next_ms, elapsed) {
                    note(line(share, elapsed, &message()));
                }
            }
            Kind::Bar(bar) => {
                match share {
                    Some(share) => bar.set_position((share * STEPS as f64) as u64),
                    None => bar.tick(),
                }
                bar.set_message(message());
            }
        }
    }

    /// Does something that writes to standard error, with the bar out of its way.
    pub(crate) fn suspended(&self, write: impl FnOnce()) {
        match &self.kind {
            Kind::Bar(bar) => bar.suspend(write),
            _ => write(),
        }
    }

    /// Takes the bar off the terminal.
    pub(crate) fn finish(self) {
        if let Kind::Bar(bar) = self.kind {
            bar.finish_and_clear();
        }
    }
}

fn bar(known_end: bool) -> ProgressBar {
    let (bar, template) = if known_end {
        (ProgressBar::new(STEPS), BAR)
    } else {
        (ProgressBar::new_spinner(), SPINNER)
    };
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// Whether a line is due; true for one of the threads that ask at the same time.
fn is_due(next_ms: &AtomicU64, elapsed: Duration) -> bool {
    let (next, now) = (next_ms.load(Ordering::Relaxed), milliseconds(elapsed));
    now >= next
        && next_ms
            .compare_exchange(
                next,
                now + milliseconds(LINE_EVERY),
                Ordering::Relaxed,
                Ordering::Relaxed,
            )
            .is_ok()
}

fn milliseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

fn line(share: Option<f64>, elapsed: Duration, message: &str) -> String {
    let seconds = elapsed.as_secs();
    match share {
        Some(share) => format!("{:3.0} % after {seconds} s  {message}", 100.0 * share),
        None => format!("{seconds} s  {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_once_per_interval() {
        let next_ms = AtomicU64::new(5000);
        let due = |seconds| is_due(&next_ms, Duration::from_secs(seconds));
        assert_eq!(
            [4, 5, 6, 9, 10, 31, 32].map(due),
            [false, true, false, false, true, true, false]
        );
    }
}
