//! Messages that could come thousands of times a second: one is told at once, the next after a pause, with
//! the number of those in between.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Pause between two messages of a kind.
const PAUSE: Duration = Duration::from_secs(10);

/// Decides which messages of one kind are told.
#[derive(Debug, Default)]
pub struct Throttle(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    told: Option<Instant>,
    held_back: u64,
}

impl Throttle {
    /// For a message at `now`: how many were held back since the last that was told, or `None` to hold this
    /// one back too.
    pub fn take(&self, now: Instant) -> Option<u64> {
        // Nothing panics while holding this lock.
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let early = state
            .told
            .is_some_and(|told| now.saturating_duration_since(told) < PAUSE);
        if early {
            state.held_back += 1;
            return None;
        }
        state.told = Some(now);
        Some(std::mem::take(&mut state.held_back))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_told_once_in_a_while_and_counted() {
        let throttle = Throttle::default();
        let start = Instant::now();
        assert_eq!(throttle.take(start), Some(0));
        for k in 1..100 {
            assert_eq!(throttle.take(start + PAUSE * k / 100), None);
        }
        assert_eq!(throttle.take(start + PAUSE), Some(99));
        assert_eq!(throttle.take(start + 3 * PAUSE), Some(0));
    }
}
