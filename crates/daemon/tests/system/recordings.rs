//! Recordings as MCAP: written by the program, cut off by its end, and answered again.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use uw_guidance::record::{Item, read};

use crate::client::{Client, PATIENCE, suggest, with};
use crate::files::{replay, replay_configured};
use crate::program::{ANY_PORT, Program, get, mode, text};
use crate::support::Numbers;

const TWICE: &str = "[operations]\nrecord = \"session.ndjson\"\n[max_age]\ndistance_s = 30.0\n";

fn started(program: Program, record: &str) -> Program {
    program.start(&[&ANY_PORT[..], &["--record", record]].concat())
}

/// Asks this and that, with a subscription and lines that are none.
fn ask(client: &mut Client, count: usize) {
    let numbers = &mut Numbers::new(7);
    for k in 0..count {
        let distance_m = numbers.between(0.6, 2.9);
        let state = with(json!({"op": "state", "id": k, "distance_m": distance_m}));
        client.send(format!("  {state}\n{{\"op\":  \"suggest\"}}\n").as_bytes());
        client.send(b"\xff\xfe\n[]\nno JSON\n{\"op\": \"health\", \"id\": \"last\"}\n");
        while client.receive()["id"] != "last" {}
    }
}

fn records(program: &Program, name: &str) -> Vec<Value> {
    let recording = std::fs::read(program.path(name)).unwrap();
    let records = read(&recording).into_iter();
    records
        .filter_map(|(_, item)| match item {
            Item::Record(value) => Some(value),
            _ => None,
        })
        .collect()
}

/// The replies that are the same, from what a replay says.
fn same(said: &str) -> usize {
    said.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn an_mcap_recording_is_answered_again_bit_for_bit() {
    let program = Program::folder().config(TWICE);
    let mut program = started(program, "dive.mcap");
    let mut client = program.client();
    client.ask(&json!({"op": "subscribe", "id": "s", "rate_hz": 50}));
    ask(&mut client, 30);
    program.signal("-HUP");
    let deadline = Instant::now() + PATIENCE;
    let is_reloaded = |client: &mut Client| {
        client.send(b"{\"op\": \"health\", \"id\": \"h\"}\n");
        let reply = std::iter::repeat_with(|| client.receive()).find(|reply| reply["id"] == "h");
        reply.unwrap()["reloads"] == 1
    };
    while !is_reloaded(&mut client) {
        assert!(Instant::now() < deadline, "not read again");
        std::thread::sleep(Duration::from_millis(20));
    }
    ask(&mut client, 5);
    // However fast all that was answered, one message of the subscription is in the recording.
    while client.receive()["push"] != true {}
    assert_eq!(program.end(), Some(0));
    // The option goes before the configuration.
    assert!(!program.path("session.ndjson").exists());
    assert_eq!(mode(&program.path("dive.mcap")), 0o600);
    let kinds = |kind: &str| {
        let records = records(&program, "dive.mcap");
        records
            .iter()
            .filter(|record| record["kind"] == kind)
            .count()
    };
    assert_eq!((kinds("start"), kinds("reload")), (1, 1));
    let counts = (kinds("request"), kinds("push"));
    assert!(counts.0 >= 35 * 6 && counts.1 > 0, "{counts:?}");
    let output = replay_configured(&program, "dive.mcap");
    assert!(output.0 == Some(0), "{output:?}");
    assert!(same(&output.1) >= 35 * 5, "{output:?}");
    assert!(output.1.contains(" 0 different"), "{output:?}");
    assert!(!output.1.contains("torn"), "{output:?}");
}

/// What JSON says of a session, MCAP says as well, reply by reply.
#[test]
fn replies_that_differ_are_told_by_their_entry() {
    let mut program = started(Program::folder(), "session.mcap");
    let mut client = program.client();
    for _ in 0..3 {
        assert_eq!(client.ask(&suggest())["valid"], true);
    }
    assert_eq!(program.end(), Some(0));
    let (code, said, _) = replay(&program, "session.mcap");
    assert_eq!(
        (code, said.as_str()),
        (Some(0), "3 replies the same, 0 different, 0 not compared\n")
    );
    // Another number in the second reply, of the same length; the chunk says that it has no checksum.
    let mut recording = std::fs::read(program.path("session.mcap")).unwrap();
    let word = b"\"evaluations\":";
    let places: Vec<usize> = (0..recording.len() - word.len())
        .filter(|&k| recording[k..].starts_with(word))
        .collect();
    let digit = &mut recording[places[1] + word.len()];
    *digit = if *digit == b'9' { b'8' } else { *digit + 1 };
    std::fs::write(program.path("damaged.mcap"), &recording).unwrap();
    let (code, said, warned) = replay(&program, "damaged.mcap");
    assert!(
        said.contains("1 torn") && warned.contains("checksum"),
        "{code:?} {said}{warned}"
    );
    let chunk = last_chunk_before(&recording, places[1]);
    recording[chunk + 9 + 24..][..4].fill(0);
    std::fs::write(program.path("other.mcap"), &recording).unwrap();
    let (code, said, _) = replay(&program, "other.mcap");
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.starts_with("entry 3\n- ") && said.contains(" 1 different"),
        "{said}"
    );
}

/// Where the chunk begins that holds this place: records have an opcode and a length, and chunks are not within others.
fn last_chunk_before(recording: &[u8], place: usize) -> usize {
    let mut at = 8;
    loop {
        let length: [u8; 8] = recording[at + 1..at + 9].try_into().unwrap();
        let end = at + 9 + usize::try_from(u64::from_le_bytes(length)).unwrap();
        if end > place {
            assert_eq!(recording[at], 6);
            return at;
        }
        at = end;
    }
}

/// A program that is killed leaves all but what came within the last second or so.
#[test]
fn a_killed_program_leaves_a_recording_that_is_answered_again() {
    let mut program = started(Program::folder(), "dive.mcap");
    let mut client = program.client();
    for _ in 0..4 {
        assert_eq!(client.ask(&suggest())["valid"], true);
    }
    let deadline = Instant::now() + PATIENCE;
    while records(&program, "dive.mcap").len() < 5 {
        assert!(Instant::now() < deadline, "the chunk is not closed");
        std::thread::sleep(Duration::from_millis(50));
    }
    program.signal("-KILL");
    program.child.as_mut().unwrap().wait().unwrap();
    let killed = std::fs::read(program.path("dive.mcap")).unwrap();
    let (code, said, warned) = replay(&program, "dive.mcap");
    assert_eq!(code, Some(0), "{said}{warned}");
    assert!(
        said.starts_with("4 replies the same, 0 different"),
        "{said}"
    );
    assert!(warned.contains("dive.mcap: entry 6"), "{warned}");
    // The next start leaves it as it is.
    let mut program = started(program, "dive.mcap");
    let [file, address] = program.told_both(["recording ", "uwguide listening on "]);
    assert!(file.contains("dive-2.mcap"), "{file}");
    let mut client = Client::to(address.parse().unwrap());
    assert_eq!(client.ask(&suggest())["valid"], true);
    assert_eq!(program.end(), Some(0));
    assert!(std::fs::read(program.path("dive.mcap")).unwrap() == killed);
    let (code, said, _) = replay(&program, "dive-2.mcap");
    assert_eq!(
        (code, said.as_str()),
        (Some(0), "1 replies the same, 0 different, 0 not compared\n")
    );
}

#[test]
fn files_that_are_no_recordings_are_told() {
    let program = Program::folder()
        .write("text.mcap", "hello\n")
        .write("empty.mcap", "");
    for (name, expected) in [
        (
            "text.mcap",
            "text.mcap: line 1: neither MCAP nor newline-delimited JSON",
        ),
        ("empty.mcap", "empty.mcap: line 1: the recording is empty"),
        ("none.mcap", "none.mcap: cannot be read"),
    ] {
        let (code, said, told) = replay(&program, name);
        assert_eq!(code, Some(2), "{said}");
        assert!(told.contains(expected), "{told}");
    }
    // A folder that is not there is told at the start.
    let missing = ["--stdio", "--record", "no/folder/dive.mcap"];
    let output = program.output(&missing);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("no/folder/dive.mcap"));
}

/// A disk that takes nothing for a while: a pipe that nobody reads.
#[cfg(unix)]
#[test]
fn a_disk_that_hangs_costs_neither_answers_nor_all_memory() {
    const PICTURES: usize = 100;
    let program =
        Program::folder().config("[operations]\nrecord = \"slow\"\nmetrics = \"127.0.0.1:0\"\n");
    let pipe = program.path("slow");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    // Both ends are held, so that the program need not wait for a reader.
    let held = File::options().read(true).write(true).open(&pipe).unwrap();
    let mut program = program.start(&ANY_PORT);
    let metrics = program.told("uwguide metrics on ");
    let mut client = program.client();
    let picture = "A".repeat(1_000_000);
    for k in 0..PICTURES {
        let reply = client.ask(&with(
            json!({"op": "suggest_image", "id": k, "image": {"base64_png": picture}}),
        ));
        assert_eq!((&reply["id"], &reply["ok"]), (&json!(k), &json!(false)));
    }
    let (_, body) = get(&metrics, "/metrics");
    let lost = body
        .lines()
        .find_map(|line| line.strip_prefix("uwguide_record_failures_total "))
        .and_then(|count| count.parse::<usize>().ok())
        .unwrap();
    // 64 MiB wait, and what is being written.
    assert!((30..=36).contains(&lost), "{lost} of {PICTURES} lost");
    // The disk goes on: what has waited is whole.
    let lines = std::thread::spawn(move || {
        let lines = BufReader::new(held).lines().map_while(Result::ok);
        lines
            .map(|line| serde_json::from_str::<Value>(&line).unwrap())
            .take(1 + PICTURES - lost)
            .count()
    });
    assert_eq!(lines.join().unwrap(), 1 + PICTURES - lost);
    assert_eq!(program.end(), Some(0));
}
