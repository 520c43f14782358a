//! One connection: lines in, replies out, in order; messages of a subscription between them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt, BufReader};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{sleep, sleep_until, timeout};

use super::limits::{Limits, Pace};
use super::peers::Peer;
use super::tokens::{MAX_TRIES, Tokens};
use crate::operations::throttle::Throttle;
use crate::record::{Entry, Recorder};
use crate::service::{Answered, Moment, Pending, Session};
use crate::wire::frame::{Frame, Lines};
use crate::wire::reply::{self, Code, WireError};

/// How long a peer may take to show its token.
const AUTH_TIME: Duration = Duration::from_secs(10);
/// How long a peer may take to read the last line.
const CLOSING_TIME: Duration = Duration::from_secs(1);
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
    pub peer: Peer,
    pub tokens: Arc<Tokens>,
    /// Warnings of peers that speak other protocols.
    pub foreign_log: Arc<Throttle>,
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

/// What the other side is to be sent.
enum Reply {
    Line(String),
    /// A last line; what the other side has sent behind is not looked at.
    Last(String),
}

/// Answers one connection until it ends.
pub(super) async fn serve<R, W>(reader: R, writer: W, session: Session, mut context: Context)
where
    R: AsyncRead + Unpin,
    W: AsyncWrite + Unpin,
{
    let service = Arc::clone(session.service());
    let _open = service.metrics().open();
    let mut conversation = Conversation {
        lines: Lines::of_client(BufReader::new(reader)),
        writer,
        pace: Pace::new(context.limits.max_requests_per_s),
        session,
        deadline: Instant::now(),
        has_asked: false,
        bad_lines: 0,
        wrong_tokens: 0,
        draining: false,
    };
    conversation.deadline += conversation.patience(&context);
    loop {
        let reply = match conversation.next(&mut context).await {
            Event::Frame(Frame::Line(line)) => {
                if let Some(wait) = conversation.pace.take(Instant::now()) {
                    sleep(wait).await;
                }
                conversation.answer(line, &mut context).await
            }
            Event::Frame(Frame::TooLong) => {
                let answered = conversation.session.line_too_long();
                conversation.heard(true, &context);
                let reply = finish(&conversation.session, answered, 0).1;
                conversation.after_bad_line(reply, &context)
            }
            Event::Frame(Frame::Foreign(protocol)) => conversation.foreign(protocol, &context),
            Event::Push => match conversation.push(&context) {
                Some(message) => Reply::Line(message),
                None => continue,
            },
            Event::Idle => {
                service.metrics().closed_slow.count();
                let message = conversation.farewell_of_idle(&context);
                conversation
                    .write(farewell(Code::Idle, message), &context)
                    .await;
                return;
            }
            Event::Stop => {
                conversation.draining = true;
                continue;
            }
            Event::Frame(Frame::End) | Event::Gone => return,
        };
        let (line, is_last) = match reply {
            Reply::Line(line) => (line, false),
            Reply::Last(line) => (line, true),
        };
        if !conversation.write(line, &context).await {
            service.metrics().closed_slow.count();
            tracing::info!(connection = context.number, "client does not read; closed");
            return;
        }
        if is_last {
            conversation.close().await;
            return;
        }
    }
}

struct Conversation<R, W> {
    lines: Lines<BufReader<R>>,
    writer: W,
    pace: Pace,
    session: Session,
    /// When the connection counts as idle.
    deadline: Instant,
    /// A JSON object has come, from a peer who may ask.
    has_asked: bool,
    /// Lines in a row that were no JSON objects.
    bad_lines: u32,
    wrong_tokens: u32,
    /// Shutting down: what has come is answered, nothing more is waited for.
    draining: bool,
}

impl<R: AsyncRead + Unpin, W: AsyncWrite + Unpin> Conversation<R, W> {
    fn patience(&self, context: &Context) -> Duration {
        let Limits {
            idle_time,
            first_line_time,
            ..
        } = context.limits;
        match (self.has_asked, self.session.is_authorised()) {
            (true, _) => idle_time,
            (false, true) => first_line_time.min(idle_time),
            (false, false) => AUTH_TIME.min(first_line_time).min(idle_time),
        }
    }

    fn farewell_of_idle(&self, context: &Context) -> String {
        let seconds = self.patience(context).as_secs_f64();
        match (self.has_asked, self.session.is_authorised()) {
            (true, _) => format!("no complete line came for {seconds} s; closing"),
            (false, true) => format!("no request came within {seconds} s; closing"),
            (false, false) => format!("no token came within {seconds} s; closing"),
        }
    }

    /// A complete line came. It buys time for those who have asked something; before that, time runs from
    /// the connection's beginning.
    fn heard(&mut self, is_bad: bool, context: &Context) {
        self.bad_lines = if is_bad { self.bad_lines + 1 } else { 0 };
        self.has_asked |= !is_bad && self.session.is_authorised();
        if self.has_asked {
            self.deadline = Instant::now() + self.patience(context);
        }
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

    async fn answer(&mut self, line: Vec<u8>, context: &mut Context) -> Reply {
        let pending = self.session.read(&line);
        let is_try = pending.op() == "auth" && !self.session.is_authorised();
        let turn = match is_try {
            true => match context.tokens.turn(context.peer.origin).await {
                Some(turn) => Some(turn),
                None => return Reply::Last(too_many_tries()),
            },
            false => None,
        };
        let (now, started) = (self.session.service().now(), Instant::now());
        let Some(answered) = self.answered(pending, now, context).await else {
            let message = "the image could not be processed".to_owned();
            return Reply::Line(farewell(Code::Internal, message));
        };
        let (sequence, is_bad) = (answered.sequence, answered.is_no_object());
        let shown = if answered.op == "auth" {
            b"{\"op\": \"auth\"}".to_vec()
        } else {
            line
        };
        let (elapsed_us, reply) = finish(&self.session, answered, elapsed_us(started));
        context.record(sequence, now, elapsed_us, Some(shown), &reply);
        if let Some(turn) = turn.filter(|_| !self.session.is_authorised()) {
            return self.wrong_token(turn, reply, context).await;
        }
        self.heard(is_bad, context);
        match is_bad {
            true => self.after_bad_line(reply, context),
            false => Reply::Line(reply),
        }
    }

    /// The answer; `None` where making it has failed.
    async fn answered(
        &mut self,
        pending: Pending,
        now: Moment,
        context: &Context,
    ) -> Option<Answered> {
        if !pending.is_slow() {
            return Some(self.session.answer(pending, now));
        }
        // The semaphore is never closed.
        let _slot = context.slow.acquire().await;
        let mut own = self.session.clone();
        let answering = tokio::task::spawn_blocking(move || own.answer(pending, now));
        answering.await.ok()
    }

    /// The answer to a wrong token comes late, and the last one ends the connection.
    async fn wrong_token(
        &mut self,
        turn: OwnedSemaphorePermit,
        reply: String,
        context: &mut Context,
    ) -> Reply {
        self.session.service().metrics().wrong_tokens.count();
        let delay = context.tokens.wrong(&context.peer);
        tokio::select! {
            () = super::stopped(&mut context.stopping) => {}
            () = sleep(delay) => {}
        }
        drop(turn);
        self.wrong_tokens += 1;
        match self.wrong_tokens < MAX_TRIES {
            true => Reply::Line(reply),
            false => Reply::Last(reply),
        }
    }

    /// The reply to a line that is no JSON object, or the end after too many of them.
    fn after_bad_line(&mut self, reply: String, context: &Context) -> Reply {
        let most = context.limits.max_bad_lines;
        if self.bad_lines <= most {
            return Reply::Line(reply);
        }
        context.warn_of("lines that are no JSON", &self.session);
        let message = format!("more than {most} lines in a row were no JSON objects; closing");
        Reply::Last(farewell(Code::BadJson, message))
    }

    /// The end of a peer who speaks another protocol.
    fn foreign(&mut self, protocol: &str, context: &Context) -> Reply {
        context.warn_of(protocol, &self.session);
        let message = format!(
            "this port speaks newline-delimited JSON, got what begins as {protocol} does; closing"
        );
        Reply::Last(farewell(Code::ForeignProtocol, message))
    }

    /// Closes so that the last line arrives: closing with bytes unread would reset the connection.
    async fn close(&mut self) {
        let ended = async {
            self.writer.shutdown().await?;
            self.lines.discard().await
        };
        // A peer that goes on sending is cut.
        let _ = timeout(CLOSING_TIME, ended).await;
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
    /// Counts and logs a peer that is closed for what it spoke.
    fn warn_of(&self, spoke: &str, session: &Session) {
        session.service().metrics().closed_foreign.count();
        if let Some(more) = self.foreign_log.take(Instant::now()) {
            let peer = self.peer.name.as_str();
            tracing::warn!(peer, spoke, not_logged = more, "another protocol; closed");
        }
    }

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

fn too_many_tries() -> String {
    let message = "too many wrong tokens came from this address; try again later; closing";
    farewell(Code::Unauthorised, message.to_owned())
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
