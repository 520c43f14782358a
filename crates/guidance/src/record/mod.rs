//! A recording of requests and replies, for [`crate::replay`] and for looking into later.
//!
//! A file whose name ends in `.mcap` is written as MCAP ([`mcap`]), any other as newline-delimited JSON ([`lines`]): model,
//! profile and settings first, then every answer and every pushed message. Writing happens on a thread of its own
//! behind a bounded queue: a slow or full disk costs records, which are counted, and never an answer.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::operations::files::{append, create};
use crate::service::{Loaded, Moment, Service};

mod lines;
mod mcap;
mod read;
#[cfg(test)]
mod tests;

pub use read::{Item, Place, is_torn, read};

/// Format name and version of a recording.
pub const RECORD_FORMAT: &str = "uwguide-record/1";
/// Entries that may wait for the disk,
const QUEUE: usize = 4096;
/// and the bytes of their lines: many of the largest pictures, and less than a small computer has.
const QUEUE_BYTES: usize = 64 << 20;
/// How long written entries may stay in memory.
const FLUSH_TIME: Duration = Duration::from_secs(1);
/// Most recordings of one name.
const MAX_NUMBER: u32 = 100_000;

/// One answer.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Place among all uses of the shared state.
    pub sequence: u64,
    /// Number of the connection.
    pub connection: u64,
    /// When the request was answered.
    pub now: Moment,
    /// Time the answer took, µs.
    pub elapsed_us: u64,
    /// The request line; `None` for a pushed message.
    pub line: Option<Vec<u8>>,
    /// The reply line.
    pub reply: String,
}

impl Entry {
    /// What both formats say beside the lines.
    fn facts(&self) -> Value {
        json!({
            "kind": if self.line.is_some() { "request" } else { "push" },
            "sequence": self.sequence,
            "connection": self.connection,
            "since_start_s": self.now.since_start_s,
            "unix_s": self.now.unix_s,
            "elapsed_us": self.elapsed_us,
        })
    }
}

enum Message {
    Entry(Entry),
    /// Model, profile and settings, and when they came, s since 1970.
    Loaded(Value, f64),
}

impl Message {
    /// Bytes that may be many.
    fn bytes(&self) -> usize {
        match self {
            Self::Entry(entry) => entry.line.as_ref().map_or(0, Vec::len) + entry.reply.len(),
            Self::Loaded(..) => 0,
        }
    }
}

/// What a disk did not take.
#[derive(Debug)]
struct Lost {
    records: u64,
    error: io::Error,
}

/// Where entries go; clones write to the same file.
#[derive(Clone, Debug)]
pub struct Recorder {
    queue: SyncSender<Message>,
    /// Bytes of what is in the queue.
    waiting: Arc<AtomicUsize>,
    service: Arc<Service>,
}

/// Waits for the last entries when dropped, after all recorders are.
#[derive(Debug)]
pub struct Recording {
    thread: Option<JoinHandle<()>>,
    path: PathBuf,
}

impl Recording {
    /// The file that is written.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has been printed by then.
            let _ = thread.join();
        }
    }
}

impl Recorder {
    /// Begins a recording. JSON is appended to a file that exists, behind what may be a torn line. An MCAP file is finished
    /// once and for all, so where one exists the next free name is taken: `dive.mcap`, `dive-2.mcap`, `dive-3.mcap`. A new file
    /// is for its owner, and for its group where that is wanted.
    pub fn begin(
        path: &Path,
        group_may_read: bool,
        service: Arc<Service>,
    ) -> io::Result<(Self, Recording)> {
        let (mut output, path) = Output::open(path, group_may_read)?;
        let (queue, entries) = sync_channel(QUEUE);
        let waiting = Arc::new(AtomicUsize::new(0));
        let (taken, counting) = (Arc::clone(&waiting), Arc::clone(&service));
        let thread = std::thread::Builder::new()
            .name("record".to_owned())
            .spawn(move || write_all(&mut output, &entries, &taken, &counting))?;
        let recorder = Self {
            queue,
            waiting,
            service,
        };
        let loaded = recorder.service.loaded();
        recorder.loaded("start", 0, &loaded);
        let recording = Recording {
            thread: Some(thread),
            path,
        };
        Ok((recorder, recording))
    }

    /// Takes an entry, or counts it as lost when the disk is too slow.
    pub fn write(&self, entry: Entry) {
        self.send(Message::Entry(entry));
    }

    /// Notes a change of model and profile.
    pub fn reloaded(&self, sequence: u64, loaded: &Loaded) {
        self.loaded("reload", sequence, loaded);
    }

    fn loaded(&self, kind: &str, sequence: u64, loaded: &Loaded) {
        let mut value = self.service.describe(loaded);
        value["format"] = RECORD_FORMAT.into();
        value["kind"] = kind.into();
        value["sequence"] = sequence.into();
        self.send(Message::Loaded(value, self.service.now().unix_s));
    }

    fn send(&self, message: Message) {
        let bytes = message.bytes();
        let waiting = self.waiting.fetch_add(bytes, Ordering::Relaxed);
        let has_room = waiting == 0 || waiting + bytes <= QUEUE_BYTES;
        if !has_room || self.queue.try_send(message).is_err() {
            self.waiting.fetch_sub(bytes, Ordering::Relaxed);
            self.service.metrics().record_failures.count();
        }
    }
}

/// The file of a recording, in one of its formats.
enum Output {
    Lines(lines::LineWriter<File>),
    Mcap(Box<mcap::McapWriter<File>>),
}

impl Output {
    fn open(path: &Path, group_may_read: bool) -> io::Result<(Self, PathBuf)> {
        if !is_mcap(path) {
            let file = append(path, group_may_read)?;
            let lines = lines::LineWriter::new(file, lines::ends_a_line(path));
            return Ok((Self::Lines(lines), path.to_owned()));
        }
        let (file, path) = free(path, group_may_read)?;
        let mcap = mcap::McapWriter::new(file)?;
        Ok((Self::Mcap(Box::new(mcap)), path))
    }

    fn write(&mut self, message: &Message) -> Result<(), Lost> {
        match (self, message) {
            (Self::Lines(out), Message::Entry(entry)) => out.write(&lines::line(entry)),
            (Self::Lines(out), Message::Loaded(value, _)) => out.write(value),
            (Self::Mcap(out), Message::Entry(entry)) => out.entry(entry),
            (Self::Mcap(out), Message::Loaded(value, unix_s)) => out.loaded(value, *unix_s),
        }
    }

    fn flush(&mut self) -> Result<(), Lost> {
        match self {
            Self::Lines(out) => out.flush(),
            Self::Mcap(out) => out.flush(),
        }
    }

    fn finish(&mut self) -> Result<(), Lost> {
        match self {
            Self::Lines(out) => out.flush(),
            Self::Mcap(out) => out.finish(),
        }
    }
}

/// Writes a part of `bytes`, one at least.
fn write_some(out: &mut impl Write, bytes: &[u8]) -> io::Result<usize> {
    loop {
        match out.write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

/// Whether a recording of this name is written as MCAP.
fn is_mcap(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
}

/// A new file of this name, or with the first number behind it that is free.
fn free(path: &Path, group_may_read: bool) -> io::Result<(File, PathBuf)> {
    let taken = |error: &io::Error| error.kind() == io::ErrorKind::AlreadyExists;
    for number in 1..MAX_NUMBER {
        let numbered = numbered(path, number);
        match create(&numbered, group_may_read) {
            Err(error) if taken(&error) => {}
            other => return other.map(|file| (file, numbered)),
        }
    }
    let message = format!("{MAX_NUMBER} recordings of this name exist");
    Err(io::Error::new(io::ErrorKind::AlreadyExists, message))
}

fn numbered(path: &Path, number: u32) -> PathBuf {
    match (number, path.file_stem(), path.extension()) {
        (2.., Some(stem), Some(ending)) => {
            let mut name = stem.to_owned();
            name.push(format!("-{number}."));
            name.push(ending);
            path.with_file_name(name)
        }
        _ => path.to_owned(),
    }
}

fn write_all(
    output: &mut Output,
    entries: &Receiver<Message>,
    waiting: &AtomicUsize,
    service: &Service,
) {
    let mut failing = false;
    let mut note = |written: Result<(), Lost>| {
        if let Err(Lost { records, error }) = &written {
            service.metrics().record_failures.add(*records);
            if !failing {
                tracing::error!(%error, "the recording cannot be written; going on without");
            }
        }
        failing = written.is_err();
    };
    let mut flush_at = Instant::now();
    loop {
        match entries.recv_timeout(flush_at.saturating_duration_since(Instant::now())) {
            Ok(message) => {
                note(output.write(&message));
                waiting.fetch_sub(message.bytes(), Ordering::Relaxed);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if Instant::now() >= flush_at {
            note(output.flush());
            flush_at = Instant::now() + FLUSH_TIME;
        }
    }
    note(output.finish());
}
