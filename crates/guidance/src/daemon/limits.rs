//! What connections may take.

use std::time::{Duration, Instant};

/// Bounds on connections. Line length, nesting, image size and decoding memory are part of the protocol
/// and fixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Connections at one time; a vehicle has a handful of clients, each may hold a line of 1 MiB.
    pub max_connections: usize,
    /// Connections at one time from one address: what is left is for others. All clients on this machine are
    /// one address over TCP, and one per user over a Unix socket, so a vehicle's own may have most slots.
    pub max_connections_per_address: usize,
    /// A connection that sends no request for this long from its beginning is closed, > 0: a slot is for
    /// those who ask.
    pub first_line_time: Duration,
    /// A connection that sends no complete line for this long is closed; guidance is asked once a second
    /// or more often, and a dead link should not hold its slot for hours. Subscribers are exempt.
    pub idle_time: Duration,
    /// Lines in a row that are no JSON object and are answered all the same; one more closes the connection.
    pub max_bad_lines: u32,
    /// Lines of one connection that are answered per second on the long run, > 0; beyond that its lines
    /// wait, and with them the client.
    pub max_requests_per_s: f64,
    /// How long a client may take to accept a reply, so that one that never reads cannot hold a slot.
    pub write_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_connections: 128,
            max_connections_per_address: 96,
            first_line_time: Duration::from_secs(10),
            max_bad_lines: 8,
            idle_time: Duration::from_secs(300),
            max_requests_per_s: 20_000.0,
            write_time: Duration::from_secs(10),
        }
    }
}

/// A token bucket: how long the next line of a connection has to wait.
#[derive(Debug)]
pub(super) struct Pace {
    per_s: f64,
    tokens: f64,
    filled: Instant,
}

impl Pace {
    /// Starts full: a burst of a tenth of a second is never delayed.
    pub fn new(per_s: f64) -> Self {
        Self {
            per_s,
            tokens: Self::most(per_s),
            filled: Instant::now(),
        }
    }

    fn most(per_s: f64) -> f64 {
        (0.1 * per_s).max(1.0)
    }

    /// Takes a token for a line that came at `now`; how long to wait before answering it.
    pub fn take(&mut self, now: Instant) -> Option<Duration> {
        let elapsed_s = now.saturating_duration_since(self.filled).as_secs_f64();
        self.filled = now;
        self.tokens = (self.tokens + elapsed_s * self.per_s).min(Self::most(self.per_s)) - 1.0;
        (self.tokens < 0.0).then(|| Duration::from_secs_f64(-self.tokens / self.per_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_the_rest_waits_its_turn() {
        let mut pace = Pace::new(100.0);
        let start = Instant::now();
        for _ in 0..10 {
            assert_eq!(pace.take(start), None);
        }
        let wait = pace.take(start).unwrap();
        assert!((wait.as_secs_f64() - 0.01).abs() < 1e-3, "{wait:?}");
        assert_eq!(pace.take(start + Duration::from_millis(50)), None);
    }
}
