//! Recordings as they are read, whatever their format.

use std::fmt;

use mcap::MAGIC;
use mcap::records::{Record, op};
use serde_json::Value;

use super::RECORD_FORMAT;
use super::mcap::{ENTRY, LOADED, REPLY, REQUEST, UNREADABLE};

/// Where a record stands: the line of a text, or the number of an entry of an MCAP file, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line, from 1.
    Line(usize),
    /// Entry, from 1, in the order in which they were written.
    Entry(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(number) => write!(out, "line {number}"),
            Self::Entry(number) => write!(out, "entry {number}"),
        }
    }
}

/// A piece of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A record as newline-delimited JSON has it.
    Record(Value),
    /// A record that a full disk or a lost process has cut.
    Torn {
        /// Why it is no record.
        problem: String,
        /// Whether it may have been a start.
        may_be_start: bool,
    },
    /// Something else.
    Wrong(String),
}

/// The records of a recording in the order in which they were written.
pub fn read(recording: &[u8]) -> Vec<(Place, Item)> {
    if recording.starts_with(MAGIC) {
        return Messages::default().read(recording);
    }
    // A line may have been cut within a character.
    let text = String::from_utf8_lossy(recording);
    let numbered = text.lines().zip(1..);
    numbered
        .map(|(text, number)| (Place::Line(number), line(text, number == 1)))
        .collect()
}

fn line(line: &str, is_first: bool) -> Item {
    match serde_json::from_str(line) {
        Ok(value) => Item::Record(value),
        Err(error) if is_torn(line) => Item::Torn {
            problem: error.to_string(),
            may_be_start: may_be_start(line),
        },
        Err(_) if is_first => {
            let problem = "neither MCAP nor newline-delimited JSON, which begins with {";
            Item::Wrong(problem.to_owned())
        }
        Err(error) => Item::Wrong(error.to_string()),
    }
}

/// Whether a line that is no JSON was a record once: cut, cut with another glued to it, or the zeros that a
/// file system leaves where it lost power.
pub fn is_torn(line: &str) -> bool {
    let rest = line.trim_start_matches('\0');
    rest.starts_with('{') || (rest.is_empty() && !line.is_empty())
}

/// Whether a torn line may have been a start: its fields are in the order of the alphabet.
fn may_be_start(line: &str) -> bool {
    let line = line.trim_start_matches('\0');
    let start = format!("{{\"format\":\"{RECORD_FORMAT}\",\"kind\":\"start\"");
    line.starts_with(&start) || start.starts_with(line)
}

/// Bytes of a record's opcode and length.
const HEAD_BYTES: usize = 9;

/// Takes an MCAP file apart, with or without its end, in chunks or not.
#[derive(Default)]
struct Messages {
    items: Vec<(Place, Item)>,
    /// Ids and topics of the channels.
    channels: Vec<(u16, String)>,
    /// The request and the reply that wait for their entry, with its number.
    request: Option<(u32, &'static str, Vec<u8>)>,
    reply: Option<(u32, Vec<u8>)>,
    in_chunk: bool,
    ended: bool,
}

impl Messages {
    fn read(mut self, recording: &[u8]) -> Vec<(Place, Item)> {
        let rest = self.records(&recording[MAGIC.len()..]);
        if !self.ended {
            let problem = match rest {
                0 => "the file has no end: its program did not end it".to_owned(),
                cut => format!("the file ends within a record, of which it has {cut} bytes"),
            };
            self.torn(problem);
        }
        if self.items.is_empty() {
            let topics: Vec<&str> = self.channels.iter().map(|(_, topic)| &**topic).collect();
            let topics = topics.join(", ");
            let problem =
                format!("an MCAP file without records of uwguide; its topics: [{topics}]");
            self.push(Item::Wrong(problem));
        }
        self.items
    }

    /// Takes records one by one; the number of bytes of one that is cut.
    fn records(&mut self, mut bytes: &[u8]) -> usize {
        while let Some((head, rest)) = bytes.split_at_checked(HEAD_BYTES) {
            let length = u64::from_le_bytes(std::array::from_fn(|k| head[k + 1]));
            let whole = usize::try_from(length)
                .ok()
                .and_then(|length| rest.split_at_checked(length));
            let Some((body, rest)) = whole else {
                return bytes.len();
            };
            self.record(head[0], body);
            if self.ended {
                return 0;
            }
            bytes = rest;
        }
        bytes.len()
    }

    fn record(&mut self, opcode: u8, body: &[u8]) {
        if opcode == op::DATA_END {
            self.ended = true;
        }
        if ![op::CHANNEL, op::MESSAGE, op::CHUNK].contains(&opcode) {
            return;
        }
        match mcap::parse_record(opcode, body) {
            Ok(Record::Channel(channel)) => self.channels.push((channel.id, channel.topic)),
            Ok(Record::Message { header, data }) => {
                self.message(header.channel_id, header.sequence, &data);
            }
            Ok(Record::Chunk { header, data }) if header.compression.is_empty() => {
                self.chunk(header.uncompressed_crc, &data);
            }
            Ok(Record::Chunk { header, .. }) => self.push(Item::Wrong(format!(
                "chunks must not be compressed, got {:?}; `mcap compress --compression none` takes it off",
                header.compression
            ))),
            Ok(_) => {}
            Err(error) => self.torn(format!("no record of an MCAP file: {error}")),
        }
    }

    fn chunk(&mut self, crc: u32, records: &[u8]) {
        if crc != 0 && crc32fast::hash(records) != crc {
            self.torn("a chunk is damaged: its checksum is another".to_owned());
            return;
        }
        if self.in_chunk {
            self.torn("a chunk must not be in another".to_owned());
            return;
        }
        self.in_chunk = true;
        let cut = self.records(records);
        self.in_chunk = false;
        if cut > 0 {
            self.torn(format!(
                "a chunk ends within a record, of which it has {cut} bytes"
            ));
        }
    }

    fn message(&mut self, channel: u16, number: u32, data: &[u8]) {
        let topic = self.channels.iter().find(|(id, _)| *id == channel);
        let Some((_, topic)) = topic else {
            return;
        };
        match topic.as_str() {
            topic if topic == LOADED.0 => {
                let item = serde_json::from_slice(data).map_or_else(
                    |error| Item::Wrong(format!("{}: {error}", LOADED.0)),
                    Item::Record,
                );
                self.push(item);
            }
            topic if topic == REQUEST.0 => self.request = Some((number, REQUEST.0, data.to_vec())),
            topic if topic == UNREADABLE.0 => {
                self.request = Some((number, UNREADABLE.0, data.to_vec()));
            }
            topic if topic == REPLY.0 => self.reply = Some((number, data.to_vec())),
            topic if topic == ENTRY.0 => {
                let item = self
                    .entry(number, data)
                    .map_or_else(Item::Wrong, Item::Record);
                self.push(item);
            }
            _ => {}
        }
    }

    /// The record of an entry and of the messages before it that belong to it.
    fn entry(&mut self, number: u32, data: &[u8]) -> Result<Value, String> {
        let wrong = |topic: &str, problem: &dyn fmt::Display| format!("{topic}: {problem}");
        let mut value: Value =
            serde_json::from_slice(data).map_err(|error| wrong(ENTRY.0, &error))?;
        if !value.is_object() {
            return Err(wrong(ENTRY.0, &"must be an object"));
        }
        let missing = |topic: &str| format!("the message on {topic} that belongs to it is missing");
        let reply = self.reply.take().filter(|&(of, _)| of == number);
        let (_, reply) = reply.ok_or_else(|| missing(REPLY.0))?;
        let reply = String::from_utf8(reply).map_err(|error| wrong(REPLY.0, &error))?;
        value["reply"] = reply.into();
        let request = self.request.take().filter(|&(of, ..)| of == number);
        match request {
            Some((_, topic, line)) if topic == REQUEST.0 => {
                let line = String::from_utf8(line).map_err(|error| wrong(topic, &error))?;
                value["line"] = line.into();
            }
            Some((_, topic, line)) => {
                let line: Value =
                    serde_json::from_slice(&line).map_err(|error| wrong(topic, &error))?;
                for name in ["line", "line_base64"] {
                    if let Some(text) = line.get(name) {
                        value[name] = text.clone();
                    }
                }
            }
            None if value["kind"] == "request" => return Err(missing(REQUEST.0)),
            None => {}
        }
        Ok(value)
    }

    fn torn(&mut self, problem: String) {
        let may_be_start = self.items.is_empty();
        self.push(Item::Torn {
            problem,
            may_be_start,
        });
    }

    fn push(&mut self, item: Item) {
        self.items.push((Place::Entry(self.items.len() + 1), item));
    }
}
