//! Recordings written and read again, whole, cut, damaged and behind a full disk.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use serde_json::{Value, json};

use super::mcap::McapWriter;
use super::*;
use crate::service::Moment;

/// A disk with room for so many bytes, that others look at.
#[derive(Clone)]
struct Disk(Arc<Mutex<(usize, Vec<u8>)>>);

impl Disk {
    fn with_room(room: usize) -> Self {
        Self(Arc::new(Mutex::new((room, Vec::new()))))
    }

    fn make_room(&self) {
        self.0.lock().unwrap().0 = usize::MAX;
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().1.clone()
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let (room, held) = &mut *self.0.lock().unwrap();
        let count = bytes.len().min(*room);
        if count == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        *room -= count;
        held.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn start() -> Value {
    json!({"format": RECORD_FORMAT, "kind": "start", "sequence": 0, "model": "m"})
}

fn entry(number: u64, line: Option<&[u8]>) -> Entry {
    Entry {
        sequence: number,
        connection: u64::MAX - number,
        now: Moment {
            since_start_s: 0.1 * number as f64,
            unix_s: 1.8e9 + 0.1 * number as f64,
        },
        elapsed_us: 250,
        line: line.map(<[u8]>::to_vec),
        reply: format!("{{\"ok\":true,\"id\":{number},\"why\":\"größer\"}}"),
    }
}

/// Lines as clients send them, and some as they should not.
fn entries() -> Vec<Entry> {
    let lines: [Option<&[u8]>; 9] = [
        Some(b"{\"op\":\"suggest\"}"),
        Some(b"  {\"op\" : \"state\", \"depth_m\":3.0,\"depth_m\":4}\t\r"),
        None,
        Some(b"garbage"),
        Some(b"\xff\xfe{"),
        Some(b"{\"op\":\"\xff\"}"),
        Some(b"[1, 2]"),
        Some(b""),
        Some("{\"id\":\"ä\\ud800\"}".as_bytes()),
    ];
    let numbered = lines.into_iter().zip(1..);
    numbered.map(|(line, number)| entry(number, line)).collect()
}

/// The entries as MCAP, in chunks of three, with the bytes on the disk after each chunk.
fn written(disk: &Disk) -> Vec<usize> {
    let mut mcap = McapWriter::new(disk.clone()).unwrap();
    let _ = mcap.loaded(&start(), 1.8e9);
    let mut ends = vec![disk.bytes().len()];
    for entries in entries().chunks(3) {
        for entry in entries {
            let _ = mcap.entry(entry);
        }
        let _ = mcap.flush();
        ends.push(disk.bytes().len());
    }
    disk.make_room();
    mcap.finish().unwrap();
    ends
}

fn whole() -> (Vec<u8>, Vec<usize>) {
    let disk = Disk::with_room(usize::MAX);
    let ends = written(&disk);
    (disk.bytes(), ends)
}

/// What is read, and how much of it was torn.
fn records(recording: &[u8]) -> (Vec<Value>, usize) {
    let mut torn = 0;
    let mut records = Vec::new();
    for (_, item) in read(recording) {
        match item {
            Item::Record(value) => records.push(value),
            Item::Torn { .. } => torn += 1,
            Item::Wrong(problem) => panic!("{problem}"),
        }
    }
    (records, torn)
}

fn expected() -> Vec<Value> {
    let entries = entries();
    let lines = entries.iter().map(lines::line);
    std::iter::once(start()).chain(lines).collect()
}

#[test]
fn mcap_holds_what_json_holds() {
    let (recording, _) = whole();
    assert_eq!(records(&recording), (expected(), 0));
    let text: String = expected().iter().map(|line| format!("{line}\n")).collect();
    assert_eq!(records(text.as_bytes()), (expected(), 0));
}

#[test]
fn requests_and_replies_are_messages_byte_by_byte() {
    let (recording, _) = whole();
    for (entry, is_object) in entries()
        .iter()
        .zip([true, true, false, false, false, false, false, false, true])
    {
        let holds = |bytes: &[u8]| recording.windows(bytes.len()).any(|window| window == bytes);
        assert!(holds(entry.reply.as_bytes()));
        if is_object {
            assert!(holds(entry.line.as_deref().unwrap()), "{entry:?}");
        }
    }
}

/// A crash leaves a beginning of the file: all chunks that were closed are read, and it says that it is cut.
#[test]
fn a_file_that_is_cut_anywhere_holds_its_closed_chunks() {
    let (recording, ends) = whole();
    let expected = expected();
    let last = *ends.last().unwrap();
    for cut in 8..last {
        let closed = ends.iter().filter(|&&end| end <= cut).count();
        // The first chunk holds the start alone; one whose indices only are cut is whole.
        let least = if closed == 0 { 0 } else { 3 * closed - 2 };
        let (read, torn) = records(&recording[..cut]);
        assert!(read.len() >= least, "{cut}: {} of {least}", read.len());
        assert_eq!(read, expected[..read.len()], "{cut}");
        assert_eq!(torn, 1, "{cut}");
    }
    // What is behind the last chunk is a summary, which no replay needs.
    for cut in last..recording.len() {
        assert_eq!(records(&recording[..cut]).0, expected, "{cut}");
    }
}

#[test]
fn damage_is_found_and_nothing_panics() {
    let (recording, ends) = whole();
    let expected = expected();
    for place in 0..8 {
        let mut other = recording.clone();
        other[place] ^= 1;
        assert!(matches!(read(&other)[0].1, Item::Wrong(_)), "{place}");
    }
    for place in 8..recording.len() {
        for change in [1, 0x80, 0xff] {
            let mut damaged = recording.clone();
            damaged[place] ^= change;
            for (_, item) in read(&damaged) {
                if let Item::Record(value) = item {
                    assert!(expected.contains(&value), "{place}: {value}");
                }
            }
        }
    }
    // Within the second chunk's messages: that chunk is lost, and no other.
    let place = ends[0] + 9 + 8 * 3 + 4 + 4 + 8 + 40;
    let mut damaged = recording;
    damaged[place] ^= 1;
    let (read, torn) = records(&damaged);
    assert_eq!(torn, 1);
    let others: Vec<Value> = [&expected[..1], &expected[4..]].concat();
    assert_eq!(read, others);
}

/// What the disk does not take waits, so that the file is the same in the end.
#[test]
fn a_disk_that_was_full_for_a_while_has_the_same_file_in_the_end() {
    let (recording, _) = whole();
    for room in (0..recording.len()).step_by(97) {
        let disk = Disk::with_room(room);
        written(&disk);
        assert!(disk.bytes() == recording, "{room}");
    }
}

#[test]
fn what_waits_for_the_disk_is_bounded_and_losses_are_counted() {
    let disk = Disk::with_room(3000);
    let mut mcap = McapWriter::new(disk.clone()).unwrap();
    let _ = mcap.loaded(&start(), 1.8e9);
    let large = format!("{{\"image\":\"{}\"}}", "A".repeat(1 << 20));
    let mut lost = 0;
    for number in 0..60 {
        let taken = mcap.entry(&entry(number, Some(large.as_bytes())));
        lost += taken.err().map_or(0, |lost| lost.records);
    }
    assert!((40..=44).contains(&lost), "{lost}");
    disk.make_room();
    mcap.finish().unwrap();
    let (read, torn) = records(&disk.bytes());
    assert_eq!(
        (read.len(), torn),
        (1 + 60 - usize::try_from(lost).unwrap(), 0)
    );
    // A disk that stays full keeps what it had.
    let disk = Disk::with_room(3000);
    let mut mcap = McapWriter::new(disk.clone()).unwrap();
    for entry in entries() {
        mcap.entry(&entry).unwrap();
    }
    assert_eq!(mcap.finish().unwrap_err().records, 9);
    assert_eq!(disk.bytes().len(), 3000);
}

fn problem(recording: &[u8]) -> String {
    match read(recording).into_iter().next_back() {
        Some((_, Item::Wrong(problem))) => problem,
        other => panic!("{other:?}"),
    }
}

#[test]
fn files_that_are_something_else_are_told() {
    let said = problem(b"hello\n");
    assert!(said.contains("neither MCAP nor"), "{said}");
    let other = mcap_file("");
    let said = problem(&other);
    assert!(said.contains("topics: [/camera]"), "{said}");
    let other = mcap_file("zstd");
    let said = problem(&other);
    assert!(said.contains("not be compressed, got \"zstd\""), "{said}");
    assert_eq!(read(b""), []);
}

/// An MCAP file of another program, with a chunk that says it is compressed so.
fn mcap_file(compression: &str) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let record = |opcode: u8, body: &[u8]| {
        [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat()
    };
    let channel = [&[0; 4], &text("/camera")[..], &text("json"), &[0; 4]].concat();
    let channel = record(4, &channel);
    let length = (channel.len() as u64).to_le_bytes();
    let chunk = [
        &[0; 16],
        &length[..],
        &[0; 4],
        &text(compression),
        &length,
        &channel,
    ]
    .concat();
    [
        ::mcap::MAGIC,
        &record(1, &[0; 8]),
        &record(6, &chunk),
        &record(15, &[0; 4]),
    ]
    .concat()
}

/// A file of chunks in chunks takes no more of the stack than one of one chunk.
#[test]
fn chunks_in_chunks_are_torn_however_deep() {
    let mut record = vec![];
    for _ in 0..5_000 {
        let length = (record.len() as u64).to_le_bytes();
        let body = [&[0; 16], &length[..], &[0; 8], &length, &record].concat();
        record = [&[6], &(body.len() as u64).to_le_bytes()[..], &body].concat();
    }
    let items = read(&[::mcap::MAGIC, &record].concat());
    let torn =
        |item: &Item| matches!(item, Item::Torn { problem, .. } if problem.contains("in another"));
    assert!(items.iter().any(|(_, item)| torn(item)), "{items:?}");
}

#[test]
fn mcap_files_get_numbers_where_one_exists() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a dive.v2.MCAP");
    let names: Vec<String> = (0..3)
        .map(|_| {
            let (_, path) = Output::open(&path, false).unwrap();
            path.file_name().unwrap().to_str().unwrap().to_owned()
        })
        .collect();
    let right = ["a dive.v2.MCAP", "a dive.v2-2.MCAP", "a dive.v2-3.MCAP"];
    assert_eq!(names, right);
    let missing = folder.path().join("no folder").join("dive.mcap");
    assert!(Output::open(&missing, false).is_err());
}
