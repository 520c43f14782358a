//! Connections to what vehicles have already: a Doppler log, an autopilot, ROS. All off by default.
//!
//! Each link feeds and asks the service as a client would, by requests of the protocol, so that what it
//! does is in recordings too.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tokio::time::sleep;

use uw_guidance::record::{Entry, Recorder};
use uw_guidance::service::{Answered, Moment, Service, Session};

pub mod dvl;
mod http_client;
pub mod mavlink;
pub mod ros2;
pub mod rosbridge;

/// Pauses before connecting again: the first, doubled each time up to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pauses {
    /// After the first failure.
    pub first: Duration,
    /// After many.
    pub last: Duration,
}

impl Default for Pauses {
    fn default() -> Self {
        Self {
            first: Duration::from_millis(500),
            last: Duration::from_secs(30),
        }
    }
}

/// A link's own connection to the service.
#[derive(Debug)]
pub struct Feeder {
    session: Session,
    recorder: Option<Recorder>,
    number: u64,
}

impl Feeder {
    /// A connection with a number of its own in recordings.
    pub fn new(service: Arc<Service>, recorder: Option<Recorder>, number: u64) -> Self {
        Self {
            session: Session::trusted(service),
            recorder,
            number,
        }
    }

    /// Subscribes to suggestions, which [`Feeder::commanded_level_pct`] then takes.
    fn subscribe(&mut self, rate_hz: f64) {
        self.ask(&json!({"op": "subscribe", "id": "lamps", "rate_hz": rate_hz}));
    }

    /// What the lamps are to be set to by the message that is due, percent, if it says to move.
    fn commanded_level_pct(&mut self) -> Option<f64> {
        let (now, started) = (self.session.service().now(), Instant::now());
        let answered = self.session.push(now)?;
        let reply = self.finish(answered, now, None, started);
        let moves = reply["valid"] == true && reply["action"] == "move";
        let level = [&reply["level_pct"], &reply["light_pct"]];
        level.iter().find_map(|v| v.as_f64()).filter(|_| moves)
    }

    /// Sends a request and takes the reply.
    pub fn ask(&mut self, request: &Value) -> Value {
        let line = request.to_string().into_bytes();
        let pending = self.session.read(&line);
        let (now, started) = (self.session.service().now(), Instant::now());
        let answered = self.session.answer(pending, now);
        self.finish(answered, now, Some(line), started)
    }

    /// Counts and records an answer and reads it.
    fn finish(
        &self,
        answered: Answered,
        now: Moment,
        line: Option<Vec<u8>>,
        started: Instant,
    ) -> Value {
        let elapsed_us = u64::try_from(started.elapsed().as_micros()).unwrap_or(u64::MAX);
        let (metrics, sequence) = (self.session.service().metrics(), answered.sequence);
        metrics.answered(
            answered.op,
            answered.fault(),
            answered.is_error(),
            elapsed_us,
        );
        let reply = answered.line(elapsed_us);
        let read = serde_json::from_str(&reply).unwrap_or(Value::Null);
        if let Some(recorder) = &self.recorder {
            recorder.write(Entry {
                sequence,
                connection: self.number,
                now,
                elapsed_us,
                line,
                reply,
            });
        }
        read
    }
}

/// The pauses of one link.
struct Backoff {
    name: &'static str,
    pauses: Pauses,
    pause: Duration,
}

impl Backoff {
    fn new(name: &'static str, pauses: Pauses) -> Self {
        Self {
            name,
            pauses,
            pause: pauses.first,
        }
    }

    /// Waits after a connection has ended; `useful` tells whether it had worked.
    async fn wait(&mut self, ended: std::io::Result<()>, useful: bool) {
        let link = self.name;
        match ended {
            Ok(()) => tracing::warn!(link, "the peer closed; connecting again"),
            Err(error) => tracing::warn!(link, %error, "connecting again"),
        }
        if useful {
            self.pause = self.pauses.first;
        }
        sleep(self.pause).await;
        self.pause = (2 * self.pause).min(self.pauses.last);
    }
}
