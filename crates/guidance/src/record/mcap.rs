//! MCAP (<https://mcap.dev/spec>), for which robotics has viewers and libraries.
//!
//! Five topics, encoded as JSON with a JSON schema each; `crates/guidance/src/record/schemas` has them. Messages on `/uwguide/request` and
//! `/uwguide/reply` are the very lines of the protocol, byte by byte. `/uwguide/entry` follows them with what a replay needs
//! besides, and all messages of an entry carry its number as their `sequence`.
//!
//! The file is made in memory and what is made is handed to the disk, of which it is always a beginning: what the disk
//! does not take waits and goes on where the disk stopped. Chunks are closed every second, so a file that was cut off
//! holds everything up to the last closed chunk.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use base64::Engine as _;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use serde::de::IgnoredAny;
use serde_json::{Value, json};

use super::{Entry, Lost, RECORD_FORMAT, write_some};

/// A topic, the name of its schema, and the schema.
type Topic = (&'static str, &'static str, &'static str);

/// Model, profile and settings.
pub(super) const LOADED: Topic = (
    "/uwguide/loaded",
    "uwguide.Loaded",
    include_str!("schemas/loaded.json"),
);
/// A request that is a JSON object.
pub(super) const REQUEST: Topic = (
    "/uwguide/request",
    "uwguide.Request",
    include_str!("schemas/request.json"),
);
/// A request line that is none.
pub(super) const UNREADABLE: Topic = (
    "/uwguide/unreadable",
    "uwguide.Unreadable",
    include_str!("schemas/unreadable.json"),
);
/// An answer or a pushed message.
pub(super) const REPLY: Topic = (
    "/uwguide/reply",
    "uwguide.Reply",
    include_str!("schemas/reply.json"),
);
/// What belongs to a request and its reply.
pub(super) const ENTRY: Topic = (
    "/uwguide/entry",
    "uwguide.Entry",
    include_str!("schemas/entry.json"),
);

/// Bytes of messages after which a chunk is closed before its second is over.
const CHUNK_BYTES: usize = 1 << 20;
/// Bytes that may wait for the disk; entries beyond are lost.
const WAITING_BYTES: usize = 16 << 20;

/// Writes entries as MCAP.
pub(super) struct McapWriter<W> {
    out: W,
    writer: Writer<NoSeek<Made>>,
    made: Made,
    channels: Channels,
    /// Number of the next start, reload or entry.
    number: u32,
    /// Bytes of messages in the chunk that is open.
    open_bytes: usize,
    /// Records that are not all with the disk.
    waiting: u64,
}

struct Channels {
    loaded: u16,
    request: u16,
    unreadable: u16,
    reply: u16,
    entry: u16,
}

/// Bytes of the file that the disk does not have yet.
#[derive(Clone, Default)]
struct Made(Arc<Mutex<Vec<u8>>>);

impl Made {
    fn bytes(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Made {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<W: Write> McapWriter<W> {
    /// Begins a file.
    pub(super) fn new(out: W) -> io::Result<Self> {
        let made = Made::default();
        let mut writer = WriteOptions::new()
            .chunk_size(None)
            .disable_seeking(true)
            .library(concat!("uwguide/", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(made.clone()))
            .map_err(failure)?;
        let channels = Channels::add(&mut writer).map_err(failure)?;
        Ok(Self {
            out,
            writer,
            made,
            channels,
            number: 0,
            open_bytes: 0,
            waiting: 0,
        })
    }

    /// Takes model, profile and settings, which go to the disk at once.
    pub(super) fn loaded(&mut self, value: &Value, unix_s: f64) -> Result<(), Lost> {
        let data = value.to_string().into_bytes();
        let messages = [(self.channels.loaded, data, unix_s)];
        self.record(&messages)?;
        self.flush()
    }

    /// Takes an entry.
    pub(super) fn entry(&mut self, entry: &Entry) -> Result<(), Lost> {
        let asked_s = entry.now.unix_s;
        let answered_s = asked_s + 1e-6 * entry.elapsed_us as f64;
        let request = entry.line.as_ref().map(|line| match is_object(line) {
            true => (self.channels.request, line.clone(), asked_s),
            false => (self.channels.unreadable, unreadable(line), asked_s),
        });
        let reply = (
            self.channels.reply,
            entry.reply.clone().into_bytes(),
            answered_s,
        );
        let about = (
            self.channels.entry,
            entry.facts().to_string().into_bytes(),
            answered_s,
        );
        let messages: Vec<_> = request.into_iter().chain([reply, about]).collect();
        self.record(&messages)
    }

    /// Writes the messages of a record: channel, data, and time in s since 1970.
    fn record(&mut self, messages: &[(u16, Vec<u8>, f64)]) -> Result<(), Lost> {
        if self.made.bytes().len() > WAITING_BYTES {
            return self
                .flush()
                .map_err(|Lost { error, .. }| Lost { records: 1, error });
        }
        let number = self.number;
        self.number = number.wrapping_add(1);
        for (channel_id, data, unix_s) in messages {
            let time = nanoseconds(*unix_s);
            let header = MessageHeader {
                channel_id: *channel_id,
                sequence: number,
                log_time: time,
                publish_time: time,
            };
            self.open_bytes += data.len();
            let written = self.writer.write_to_known_channel(&header, data);
            written.map_err(|error| Lost {
                records: 1,
                error: failure(error),
            })?;
        }
        self.waiting += 1;
        match self.open_bytes < CHUNK_BYTES {
            true => Ok(()),
            false => self.flush(),
        }
    }

    /// Closes the chunk and gives the disk what it takes; nothing is lost yet.
    pub(super) fn flush(&mut self) -> Result<(), Lost> {
        let closed = self.writer.flush().map_err(failure);
        self.open_bytes = 0;
        closed
            .and_then(|()| self.push())
            .map_err(|error| Lost { records: 0, error })?;
        self.waiting = 0;
        Ok(())
    }

    /// Ends the file with its summary. What the disk does not take now is lost.
    pub(super) fn finish(&mut self) -> Result<(), Lost> {
        let finished = self.writer.finish().map(|_| ()).map_err(failure);
        finished.and_then(|()| self.push()).map_err(|error| Lost {
            records: self.waiting,
            error,
        })
    }

    fn push(&mut self) -> io::Result<()> {
        let mut bytes = self.made.bytes();
        let mut written = 0;
        let outcome = loop {
            if written == bytes.len() {
                break Ok(());
            }
            match write_some(&mut self.out, &bytes[written..]) {
                Ok(count) => written += count,
                Err(error) => break Err(error),
            }
        };
        bytes.drain(..written);
        outcome
    }
}

impl Channels {
    fn add(writer: &mut Writer<NoSeek<Made>>) -> Result<Self, McapError> {
        let mut add = |(topic, name, schema): Topic| {
            let schema = writer.add_schema(name, "jsonschema", schema.as_bytes())?;
            let format = ("format".to_owned(), RECORD_FORMAT.to_owned());
            writer.add_channel(schema, topic, "json", &BTreeMap::from([format]))
        };
        Ok(Self {
            loaded: add(LOADED)?,
            request: add(REQUEST)?,
            unreadable: add(UNREADABLE)?,
            reply: add(REPLY)?,
            entry: add(ENTRY)?,
        })
    }
}

fn failure(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// Whether a line is a JSON object, whose bytes can be a message of their own.
fn is_object(line: &[u8]) -> bool {
    line.trim_ascii_start().starts_with(b"{")
        && std::str::from_utf8(line).is_ok()
        && serde_json::from_slice::<IgnoredAny>(line).is_ok()
}

fn unreadable(line: &[u8]) -> Vec<u8> {
    let value = match std::str::from_utf8(line) {
        Ok(text) => json!({"line": text}),
        Err(_) => json!({"line_base64": base64::engine::general_purpose::STANDARD.encode(line)}),
    };
    value.to_string().into_bytes()
}

/// Time since 1970, ns; zero before.
fn nanoseconds(unix_s: f64) -> u64 {
    (1e9 * unix_s.max(0.0)) as u64
}
