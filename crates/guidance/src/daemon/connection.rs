//! One connection: lines in, replies out, in order; messages of a subscription between them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt, BufReader};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, sleep_until, timeout};

use super::limits::{Limits, Pace};
use crate::record::{Entry, Recorder};
use crate::service::{Answered, Moment, Session};
use crate::wire::frame::{Frame, Lines};
use crate::wire::reply::{self, Code, WireError};

/// How long a peer may take to show its token.
const AUTH_TIME: Duration = Duration::from_secs(10);
/// How long a connection waits for lines that are on their way when the daemon shuts down.
const DRAIN_TIME: Duration = Duration::from_millis(100);
/// Subscriptions look for their next message at least this often, so that a suspended clock does no harm.
const LONGEST_SLEEP_S: f64 = 60.0;

/// What all connections of a daemon share.
#[derive(Clone, Debug)]
pub(super) struct Context {
    pub limits: Limits,
    pub stopping: watch::Receiver<bool>,
    /// Places for work that takes long: reading and decoding images.
    pub slow: Arc<Semaphore>,
    pub recorder: Option<Recorder>,
    /// Number of the connection in recordings.
    pub number: u64,
}

enum Event {
    Frame(Frame),
    Push,
    Idle,
    Stop,
    Gone,
}

/// Answers one connection until it ends.
pub(super) async fn serve<R, W>(reader: R, writer: W, session: Session, mut context: Context)
where
    R: AsyncRead + Unpin,
    W: AsyncWrite + Unpin,
{
    let service = Arc::clone(session.service());
    let _open = service.metrics().open();
    let mut peer = Peer {
        lines: Lines::new(BufReader::new(reader)),
        writer,
        pace: Pace::new(context.limits.max_requests_per_s),
        session,
        deadline: Instant::now(),
        draining: false,
    };
    peer.heard(&context);
    loop {
        let reply = match peer.next(&mut context).await {
            Event::Frame(Frame::Line(line)) => {
                if let Some(wait) = peer.pace.take(Instant::now()) {
                    sleep(wait).await;
                }
                let reply = peer.answer(line, &context).await;
                peer.heard(&context);
                reply
            }
            Event::Frame(Frame::TooLong) => {
                peer.heard(&context);
                let answered = peer.session.line_too_long();
                finish(&peer.session, answered, 0).1
            }
            Event::Push => match peer.push(&context) {
                Some(message) => message,
                None => continue,
            },
            Event::Idle => {
                service.metrics().closed_slow.count();
                let seconds = peer.patience(&context).as_secs_f64();
                let message = format!("no complete line came for {seconds} s; closing");
                peer.write(farewell(Code::Idle, message), &context).await;
                return;
            }
            Event::Stop => {
                peer.draining = true;
                continue;
            }
            Event::Frame(Frame::End) | Event::Gone => return,
        };
        if !peer.write(reply, &context).await {
            service.metrics().closed_slow.count();
            tracing::info!(connection = context.number, "client does not read; closed");
            return;
        }
    }
}

struct Peer<R, W> {
    lines: Lines<BufReader<R>>,
    writer: W,
    pace: Pace,
    session: Session,
    /// When the connection counts as idle.
    deadline: Instant,
    /// Shutting down: what has come is answered, nothing more is waited for.
    draining: bool,
}

impl<R: AsyncRead + Unpin, W: AsyncWrite + Unpin> Peer<R, W> {
    fn patience(&self, context: &Context) -> Duration {
        if self.session.is_authorised() {
            context.limits.idle_time
        } else {
            AUTH_TIME.min(context.limits.idle_time)
        }
    }

    /// A complete line came.
    fn heard(&mut self, context: &Context) {
        self.deadline = Instant::now() + self.patience(context);
    }

    async fn next(&mut self, context: &mut Context) -> Event {
        if self.draining {
            return match timeout(DRAIN_TIME, self.lines.next()).await {
                Ok(Ok(frame)) => Event::Frame(frame),
                Ok(Err(_)) | Err(_) => Event::Gone,
            };
        }
        let push_in_s = self.session.next_push_s().map(|next_s| {
            let now_s = self.session.service().now().since_start_s;
            (next_s - now_s).clamp(0.0, LONGEST_SLEEP_S)
        });
        let subscribed = push_in_s.is_some();
        let push = sleep(Duration::from_secs_f64(
            push_in_s.unwrap_or(LONGEST_SLEEP_S),
        ));
        tokio::select! {
            biased;
            () = super::stopped(&mut context.stopping) => Event::Stop,
            () = push, if subscribed => Event::Push,
            frame = self.lines.next() => frame.map_or(Event::Gone, Event::Frame),
            () = sleep_until(self.deadline.into()), if !subscribed => Event::Idle,
        }
    }

    fn push(&mut self, context: &Context) -> Option<String> {
        let (now, started) = (self.session.service().now(), Instant::now());
        let answered = self.session.push(now)?;
        let sequence = answered.sequence;
        let (elapsed_us, reply) = finish(&self.session, answered, elapsed_us(started));
        context.record(sequence, now, elapsed_us, None, &reply);
        Some(reply)
    }

    async fn answer(&mut self, line: Vec<u8>, context: &Context) -> String {
        let pending = self.session.read(&line);
        let (now, started) = (self.session.service().now(), Instant::now());
        let answered = if pending.is_slow() {
            // The semaphore is never closed.
            let _place = context.slow.acquire().await;
            let mut own = self.session.clone();
            match tokio::task::spawn_blocking(move || own.answer(pending, now)).await {
                Ok(answered) => answered,
                Err(_) => {
                    let message = "the image could not be processed".to_owned();
                    return farewell(Code::Internal, message);
                }
            }
        } else {
            self.session.answer(pending, now)
        };
        let sequence = answered.sequence;
        let shown = if answered.op == "auth" {
            b"{\"op\": \"auth\"}".to_vec()
        } else {
            line
        };
        let (elapsed_us, reply) = finish(&self.session, answered, elapsed_us(started));
        context.record(sequence, now, elapsed_us, Some(shown), &reply);
        reply
    }

    /// Whether the client took the line.
    async fn write(&mut self, mut line: String, context: &Context) -> bool {
        line.push('\n');
        let written = async {
            self.writer.write_all(line.as_bytes()).await?;
            self.writer.flush().await
        };
        matches!(
            timeout(context.limits.write_time, written).await,
            Ok(Ok(()))
        )
    }
}

impl Context {
    fn record(
        &self,
        sequence: u64,
        now: Moment,
        elapsed_us: u64,
        line: Option<Vec<u8>>,
        reply: &str,
    ) {
        if let Some(recorder) = &self.recorder {
            recorder.write(Entry {
                sequence,
                connection: self.number,
                now,
                elapsed_us,
                line,
                reply: reply.to_owned(),
            });
        }
    }
}

fn elapsed_us(since: Instant) -> u64 {
    u64::try_from(since.elapsed().as_micros()).unwrap_or(u64::MAX)
}

/// Counts the answer and makes it a line.
fn finish(session: &Session, answered: Answered, elapsed_us: u64) -> (u64, String) {
    let metrics = session.service().metrics();
    metrics.answered(
        answered.op,
        answered.fault(),
        answered.is_error(),
        elapsed_us,
    );
    tracing::debug!(
        op = answered.op,
        fault = answered.fault().unwrap_or(""),
        elapsed_us,
        "answered"
    );
    (elapsed_us, answered.line(elapsed_us))
}

/// A line that is no answer to a request.
pub(super) fn farewell(code: Code, message: String) -> String {
    reply::line(&Value::Null, Err(WireError::new(code, message)))
}
