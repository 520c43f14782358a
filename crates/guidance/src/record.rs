//! A recording of requests and replies, for [`crate::replay`] and for looking into later.
//!
//! Newline-delimited JSON: a first line about model, profile and settings, then one line per answer and per
//! pushed message. Writing happens on a thread of its own behind a bounded queue: a slow or full disk costs
//! records, which are counted, and never an answer.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use base64::Engine as _;
use serde_json::{Value, json};

use crate::operations::files::append;
use crate::service::{Loaded, Moment, Service};

/// Format name and version of a recording.
pub const RECORD_FORMAT: &str = "uwguide-record/1";
/// Entries that may wait for the disk.
const QUEUE: usize = 4096;
/// How long written entries may stay in memory.
const FLUSH_TIME: Duration = Duration::from_secs(1);
/// Bytes that wait in memory for one write.
const BUFFER_BYTES: usize = 8192;

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
    /// Begins a recording; entries are appended to a file that exists, behind what may be a torn line. A new
    /// one is for its owner, and for its group where that is wanted.
    pub fn begin(
        path: &Path,
        group_may_read: bool,
        service: Arc<Service>,
    ) -> io::Result<(Self, Recording)> {
        let file = LineWriter::new(append(path, group_may_read)?, ends_a_line(path));
        let (queue, entries) = sync_channel(QUEUE);
        let counting = Arc::clone(&service);
        let thread = std::thread::Builder::new()
            .name("record".to_owned())
            .spawn(move || write_all(file, &entries, &counting))?;
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

fn write_all(mut lines: LineWriter<File>, entries: &Receiver<Message>, service: &Service) {
    let mut failing = false;
    let mut go_on = true;
    while go_on {
        let written = match entries.recv_timeout(FLUSH_TIME) {
            Ok(Message::Entry(entry)) => lines.write(&entry.to_json()),
            Ok(Message::Loaded(value)) => lines.write(&value),
            Err(RecvTimeoutError::Timeout) => lines.flush(),
            Err(RecvTimeoutError::Disconnected) => {
                go_on = false;
                lines.flush()
            }
        };
        if let Err((lost, error)) = &written {
            service.metrics().record_failures.add(*lost);
            if !failing {
                tracing::error!(%error, "the recording cannot be written; going on without");
            }
        }
        failing = written.is_err();
    }
}

/// Writes whole lines behind a buffer. What cannot be written is given up, and the next line begins a new
/// line also where the one before was cut.
struct LineWriter<W> {
    out: W,
    waiting: Vec<u8>,
    /// Whether what was written last ends a line.
    at_start: bool,
}

impl<W: Write> LineWriter<W> {
    fn new(out: W, at_start: bool) -> Self {
        Self {
            out,
            waiting: Vec::new(),
            at_start,
        }
    }

    /// Takes a line; the number of lines that were lost where writing failed, and why.
    fn write(&mut self, line: &Value) -> Result<(), (u64, io::Error)> {
        self.waiting.extend_from_slice(line.to_string().as_bytes());
        self.waiting.push(b'\n');
        match self.waiting.len() < BUFFER_BYTES {
            true => Ok(()),
            false => self.flush(),
        }
    }

    fn flush(&mut self) -> Result<(), (u64, io::Error)> {
        let waiting = std::mem::take(&mut self.waiting);
        if waiting.is_empty() {
            return Ok(());
        }
        let mut written = 0;
        let outcome = self.push(&waiting, &mut written);
        outcome.map_err(|error| (ends(&waiting[written..]), error))
    }

    fn push(&mut self, bytes: &[u8], written: &mut usize) -> io::Result<()> {
        while !self.at_start {
            self.at_start = self.some(b"\n")? == 1;
        }
        while *written < bytes.len() {
            *written += self.some(&bytes[*written..])?;
            self.at_start = bytes[..*written].ends_with(b"\n");
        }
        Ok(())
    }

    /// Writes a part, one byte at least.
    fn some(&mut self, bytes: &[u8]) -> io::Result<usize> {
        loop {
            match self.out.write(bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => return other,
            }
        }
    }
}

/// Ends of lines.
fn ends(bytes: &[u8]) -> u64 {
    bytes.iter().map(|&byte| u64::from(byte == b'\n')).sum()
}

/// Whether a file is empty or ends with a line's end; one that cannot be read is taken for one that does.
fn ends_a_line(path: &Path) -> bool {
    let last = || -> io::Result<u8> {
        let mut file = File::open(path)?;
        let mut last = [b'\n'];
        if file.seek(SeekFrom::End(-1)).is_ok() {
            file.read_exact(&mut last)?;
        }
        Ok(last[0])
    };
    !path.is_file() || last().is_ok_and(|byte| byte == b'\n')
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for so many bytes.
    struct Disk {
        room: usize,
        bytes: Vec<u8>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room);
            if count == 0 {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.room -= count;
            self.bytes.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_never_goes_on_where_another_was_cut() {
        for room in 0..40 {
            let disk = Disk {
                room,
                bytes: Vec::new(),
            };
            let mut lines = LineWriter::new(disk, true);
            for k in 0..3 {
                lines.write(&json!({"early": k})).unwrap();
            }
            let lost = match lines.flush() {
                Ok(()) => 0,
                Err((lost, _)) => lost,
            };
            lines.out.room = 1000;
            lines.write(&json!({"late": 0})).unwrap();
            lines.flush().unwrap();
            let text = String::from_utf8(lines.out.bytes).unwrap();
            let whole = |line: &&str| serde_json::from_str::<Value>(line).is_ok();
            assert!(text.ends_with("{\"late\":0}\n"), "{room}: {text:?}");
            let kept = text.lines().filter(whole).count() - 1;
            let torn = text.lines().count() - 1 - kept;
            assert!(torn <= 1, "{room}: {text:?}");
            // A line that lacks its end only is whole after all.
            let expected = 3 - usize::try_from(lost).unwrap();
            assert!(
                kept == expected || (kept == expected + 1 && torn == 0),
                "{room}: {text:?}"
            );
        }
    }
}
