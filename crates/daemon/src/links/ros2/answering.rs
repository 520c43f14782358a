//! What is done with what comes: state is told, the newest picture is answered.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use futures_util::{FutureExt, Stream, StreamExt};
use ros2_client::{Publisher, ReadError};
use serde_json::{Value, json};
use tokio::task::block_in_place;
use tokio::time::{Instant, timeout_at};

use super::messages::{Header, Suggestion, Time};
use super::picture::Picture;
use super::types::Types;
use super::{Ros2Config, requests};
use crate::links::Feeder;

/// What may wait while a picture is answered, and is looked through for a newer one.
const WAITING: usize = 1000;
/// Warnings of one kind come this far apart.
const QUIET: Duration = Duration::from_secs(10);
/// Types of topics are compared as often.
const BETWEEN_TYPES: Duration = Duration::from_secs(5);

/// What has come.
pub(super) enum Event {
    /// A request that tells of the state.
    State(Value),
    Picture(Picture),
    /// A message that is none of its type.
    Unreadable(ReadError),
}

/// Asks for what has come, and publishes the answers.
pub(super) struct Answering<'a> {
    config: &'a Ros2Config,
    feeder: Feeder,
    suggestions: &'a Publisher<Suggestion>,
    /// Frame of the latest picture.
    frame_id: String,
    types: Types,
    /// When the types of topics are compared next.
    compare_at: Instant,
    /// When the last warning was.
    warned: Option<Instant>,
}

impl<'a> Answering<'a> {
    pub(super) fn new(
        config: &'a Ros2Config,
        feeder: Feeder,
        suggestions: &'a Publisher<Suggestion>,
        types: Types,
    ) -> Self {
        Self {
            config,
            feeder,
            suggestions,
            frame_id: String::new(),
            types,
            compare_at: Instant::now() + BETWEEN_TYPES,
            warned: None,
        }
    }

    /// Answers as long as something may come.
    pub(super) async fn answer(&mut self, mut events: impl Stream<Item = Event> + Unpin) {
        let silence = Duration::from_secs_f64(self.config.silence_s);
        let between = Duration::from_secs_f64(1.0 / self.config.rate_hz);
        let mut next = Instant::now() + silence;
        loop {
            self.compare_types();
            match timeout_at(next, events.next()).await {
                Ok(Some(event)) => {
                    if let Some(image) = self.take(event) {
                        let newest = self.newest(image, &mut events);
                        self.look(newest).await;
                        next = Instant::now() + silence;
                    }
                }
                Ok(None) => return,
                Err(_) => {
                    let reply = self.ask(&json!({"op": "suggest"}));
                    self.publish(&reply, now()).await;
                    next = Instant::now() + between;
                }
            }
        }
    }

    /// Tells what has come; a picture is given back.
    fn take(&mut self, event: Event) -> Option<Picture> {
        match event {
            Event::State(request) => self.tell(&request),
            Event::Picture(image) => return Some(image),
            Event::Unreadable(error) => self.warn(&format!("a message cannot be read: {error}")),
        }
        None
    }

    /// The newest picture that has come: advice on one that waited is late.
    fn newest(
        &mut self,
        mut image: Picture,
        mut events: impl Stream<Item = Event> + Unpin,
    ) -> Picture {
        let mut skipped = 0;
        for _ in 0..WAITING {
            let Some(Some(event)) = events.next().now_or_never() else {
                break;
            };
            if let Some(newer) = self.take(event) {
                image = newer;
                skipped += 1;
            }
        }
        if skipped > 0 {
            self.warn(&format!(
                "pictures come faster than they are answered: {skipped} left out for a newer one"
            ));
        }
        image
    }

    fn tell(&mut self, request: &Value) {
        let reply = self.ask(request);
        if reply["ok"] == false {
            let message = reply["error"]["message"].as_str().unwrap_or_default();
            self.warn(message);
        }
    }

    /// Tells once what has another type elsewhere.
    fn compare_types(&mut self) {
        let now = Instant::now();
        if now < self.compare_at {
            return;
        }
        self.compare_at = now + BETWEEN_TYPES;
        for message in self.types.news() {
            tracing::warn!(link = "ros2", "{message}");
        }
    }

    async fn look(&mut self, picture: Picture) {
        let time_s = requests::time_s(picture.header(), self.config);
        let reply = match picture.file() {
            Ok(file) => self.ask(&requests::picture(&file, time_s)),
            Err(problem) => {
                let message = format!("{}: {problem}", self.config.image_topic);
                self.warn(&message);
                json!({"ok": false, "error": {"code": "bad_image", "message": message}})
            }
        };
        let Header { stamp, frame_id } = picture.header().clone();
        self.frame_id = frame_id;
        self.publish(&reply, stamp).await;
    }

    /// Pictures take their time, for which other tasks go on elsewhere.
    fn ask(&mut self, request: &Value) -> Value {
        block_in_place(|| self.feeder.ask(request))
    }

    async fn publish(&mut self, reply: &Value, stamp: Time) {
        let header = Header {
            stamp,
            frame_id: self.frame_id.clone(),
        };
        let message = super::suggestion::suggestion(reply, header, self.config.camera_axis);
        if let Err(error) = self.suggestions.async_publish(message).await {
            self.warn(&format!("a suggestion was not published: {error}"));
        }
    }

    fn warn(&mut self, message: &str) {
        let now = Instant::now();
        if self.warned.is_none_or(|before| now - before > QUIET) {
            tracing::warn!(link = "ros2", "{message}");
            self.warned = Some(now);
        }
    }
}

/// The time of this machine's clock.
fn now() -> Time {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Time {
        sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX),
        nanosec: since.subsec_nanos(),
    }
}
