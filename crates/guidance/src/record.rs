//! A recording of requests and replies, for [`crate::replay`] and for looking into later.
//!
//! Newline-delimited JSON: a first line about model, profile and settings, then one line per answer and per
//! pushed message. Writing happens on a thread of its own behind a bounded queue: a slow or full disk costs
//! records, which are counted, and never an answer.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use base64::Engine as _;
use serde_json::{Value, json};

use crate::service::{Loaded, Moment, Service};

/// Format name and version of a recording.
pub const RECORD_FORMAT: &str = "uwguide-record/1";
/// Entries that may wait for the disk.
const QUEUE: usize = 4096;
/// How long written entries may stay in memory.
const FLUSH_TIME: Duration = Duration::from_secs(1);

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
    fn to_json(&self) -> Value {
        let mut value = json!({
            "kind": if self.line.is_some() { "request" } else { "push" },
            "sequence": self.sequence,
            "connection": self.connection,
            "since_start_s": self.now.since_start_s,
            "unix_s": self.now.unix_s,
            "elapsed_us": self.elapsed_us,
            "reply": self.reply,
        });
        match self.line.as_deref().map(std::str::from_utf8) {
            Some(Ok(text)) => value["line"] = text.into(),
            Some(Err(_)) => {
                let bytes = self.line.as_deref().unwrap_or_default();
                let text = base64::engine::general_purpose::STANDARD.encode(bytes);
                value["line_base64"] = text.into();
            }
            None => {}
        }
        value
    }
}

enum Message {
    Entry(Entry),
    Loaded(Value),
}

/// Where entries go; clones write to the same file.
#[derive(Clone, Debug)]
pub struct Recorder {
    queue: SyncSender<Message>,
    service: Arc<Service>,
}

/// Waits for the last entries when dropped, after all recorders are.
#[derive(Debug)]
pub struct Recording(Option<JoinHandle<()>>);

impl Drop for Recording {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A panic in the thread has been printed by then.
            let _ = thread.join();
        }
    }
}

impl Recorder {
    /// Begins a recording; entries are appended to a file that exists.
    pub fn begin(path: &Path, service: Arc<Service>) -> io::Result<(Self, Recording)> {
        let file = File::options().create(true).append(true).open(path)?;
        let (queue, entries) = sync_channel(QUEUE);
        let counting = Arc::clone(&service);
        let thread = std::thread::Builder::new()
            .name("record".to_owned())
            .spawn(move || write_all(BufWriter::new(file), &entries, &counting))?;
        let recorder = Self { queue, service };
        let loaded = recorder.service.loaded();
        recorder.loaded("start", 0, &loaded);
        Ok((recorder, Recording(Some(thread))))
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
        self.send(Message::Loaded(value));
    }

    fn send(&self, message: Message) {
        if self.queue.try_send(message).is_err() {
            self.service.metrics().record_failures.count();
        }
    }
}

fn write_all(mut file: BufWriter<File>, entries: &Receiver<Message>, service: &Service) {
    let mut failing = false;
    loop {
        let written = match entries.recv_timeout(FLUSH_TIME) {
            Ok(Message::Entry(entry)) => writeln!(file, "{}", entry.to_json()),
            Ok(Message::Loaded(value)) => writeln!(file, "{value}"),
            Err(RecvTimeoutError::Timeout) => file.flush(),
            Err(RecvTimeoutError::Disconnected) => break,
        };
        if let Err(error) = &written {
            service.metrics().record_failures.count();
            if !failing {
                tracing::error!(%error, "the recording cannot be written; going on without");
            }
            // What could not be written stays in the buffer and would be tried again for ever.
            let (inner, _) = file.into_parts();
            file = BufWriter::new(inner);
        }
        failing = written.is_err();
    }
    if file.flush().is_err() {
        service.metrics().record_failures.count();
    }
}
