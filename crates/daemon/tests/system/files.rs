//! Files of the daemon: recordings that tear, permissions, image files and what they tell.

use std::io::BufReader;
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::{Value, json};

use crate::client::{Client, PATIENCE, suggest};
use crate::program::{ANY_PORT, Program, mode, pipe, set_mode, text};

/// Answers a recording again.
pub(crate) fn replay(program: &Program, name: &str) -> (Option<i32>, String, String) {
    replay_with(program, name, &[])
}

/// The same with the configuration that was used.
pub(crate) fn replay_configured(program: &Program, name: &str) -> (Option<i32>, String, String) {
    replay_with(program, name, &["--config", "config.toml"])
}

fn replay_with(program: &Program, name: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_uwguide"))
        .current_dir(program.folder.path())
        .args(["replay", name, "--model", "model.json"])
        .args(more)
        .output()
        .unwrap();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// Asks a daemon that records a few things and ends it; the recording.
fn record_a_session(program: Program) -> (Program, String) {
    let mut program = program.start(&ANY_PORT);
    let mut client = program.client();
    for id in ["ä", "b", "c"] {
        let mut request = suggest();
        request["id"] = json!(id);
        assert_eq!(client.ask(&request)["valid"], true);
    }
    assert_eq!(program.end(), Some(0));
    let recording = std::fs::read_to_string(program.path("session.ndjson")).unwrap();
    (program, recording)
}

#[test]
fn a_torn_record_costs_itself_and_nothing_else() {
    let program = Program::folder().config("[operations]\nrecord = \"session.ndjson\"\n");
    let (program, first) = record_a_session(program);
    assert_eq!(first.lines().count(), 4, "{first}");
    // Cut within a character, as a disk that ran full would.
    let end = first.rfind('ä').unwrap_or(first.len() / 2) + 1;
    std::fs::write(program.path("cut.ndjson"), &first.as_bytes()[..end]).unwrap();
    let (code, said, warned) = replay(&program, "cut.ndjson");
    assert_eq!(code, Some(0), "{said}{warned}");
    assert!(said.contains("1 torn"), "{said}");
    assert!(warned.contains("cut.ndjson: line 2"), "{warned}");
    // The next session goes on behind the torn line, not in it.
    let cut = &first[..first.len() - 30];
    std::fs::write(program.path("session.ndjson"), cut).unwrap();
    let (program, whole) = record_a_session(program);
    assert!(whole.starts_with(&format!("{cut}\n")), "{whole}");
    let torn = |line: &&str| serde_json::from_str::<Value>(line).is_err();
    assert_eq!(whole.lines().filter(torn).count(), 1, "{whole}");
    let (code, said, _) = replay(&program, "session.ndjson");
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.starts_with("5 replies the same, 0 different") && said.contains("1 torn"),
        "{said}"
    );
}

/// The wrong file, or a daemon that never came to its start: nothing was compared, which is no success.
#[test]
fn an_empty_recording_is_refused() {
    let program = Program::folder();
    std::fs::write(program.path("empty.ndjson"), "").unwrap();
    let (code, said, told) = replay(&program, "empty.ndjson");
    assert_ne!(code, Some(0), "{said}");
    assert!(
        told.contains("empty.ndjson") && told.contains("line 1: the recording is empty"),
        "{told}"
    );
}

#[test]
fn a_disk_that_was_full_for_a_while_costs_the_records_of_that_while() {
    // A limit on the size of files does what a full disk does: it takes a part of a write.
    let mut program = Program::folder().config("[operations]\nrecord = \"session.ndjson\"\n");
    let script = format!(
        "trap '' XFSZ; ulimit -f 40; exec {} --model model.json --profile profile.json \
         --config config.toml --listen 127.0.0.1:0",
        env!("CARGO_BIN_EXE_uwguide")
    );
    let mut child = Command::new("sh")
        .current_dir(program.folder.path())
        .args(["-c", &script])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    program.stderr = child.stderr.take().map(BufReader::new);
    program.child = Some(child);
    let mut client = program.client();
    let path = program.path("session.ndjson");
    let deadline = Instant::now() + PATIENCE;
    let full = loop {
        assert_eq!(client.ask(&suggest())["valid"], true);
        let length = std::fs::metadata(&path).unwrap().len();
        if [20_480, 40_960].contains(&length) {
            break length;
        }
        assert!(Instant::now() < deadline, "{length}");
    };
    program.told("the recording cannot be written");
    // Room for what is asked next is made, and a torn line left.
    std::fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .unwrap()
        .set_len(full - 8000)
        .unwrap();
    for _ in 0..2 {
        assert_eq!(client.ask(&suggest())["valid"], true);
    }
    assert_eq!(program.end(), Some(0));
    let whole = std::fs::read_to_string(&path).unwrap();
    let torn: Vec<&str> = whole
        .lines()
        .filter(|line| serde_json::from_str::<Value>(line).is_err())
        .collect();
    assert!(torn.len() <= 1, "{torn:?}");
    assert!(
        torn.iter()
            .all(|line| line.matches("elapsed_us\":").count() <= 2),
        "{torn:?}"
    );
    let (code, said, warned) = replay(&program, "session.ndjson");
    assert_eq!(code, Some(0), "{said}{warned}");
}

#[test]
fn recordings_and_logs_are_for_their_owner() {
    let files = "[operations]\nrecord = \"session.ndjson\"\nlog_file = \"log.txt\"\n";
    let ask = |program: Program| {
        let mut program = program.start(&ANY_PORT);
        assert_eq!(program.client().ask(&suggest())["valid"], true);
        assert_eq!(program.end(), Some(0));
        program
    };
    let program = ask(Program::folder().config(files));
    for name in ["session.ndjson", "log.txt"] {
        assert_eq!(mode(&program.path(name)), 0o600, "{name}");
    }
    let shared = ask(Program::folder().config(&format!("{files}group_may_read = true\n")));
    for name in ["session.ndjson", "log.txt"] {
        assert_eq!(mode(&shared.path(name)), 0o640, "{name}");
    }
    // What was there before keeps what its owner gave it, and is told.
    let program = program.write("session.ndjson", "");
    set_mode(&program.path("session.ndjson"), 0o644);
    let program = ask(program);
    assert_eq!(mode(&program.path("session.ndjson")), 0o644);
    let log = std::fs::read_to_string(program.path("log.txt")).unwrap();
    assert!(
        log.contains("session.ndjson: can be read by others than its owner (mode 0644)"),
        "{log}"
    );
}

/// The message of the error that naming this image file gets.
fn image_error(client: &mut Client, path: &str) -> String {
    let request = json!({"op": "suggest_image", "depth_m": 1.0, "distance_m": 1.0, "light_pct": 1.0,
                         "image": {"path": path}});
    let error = client.refused(&request);
    assert_eq!(
        (&error["code"], &error["field"]),
        (&json!("bad_image"), &json!("image.path"))
    );
    error["message"].as_str().unwrap().to_owned()
}

#[test]
fn image_files_tell_nothing_of_what_else_there_is() {
    let mut program = Program::folder().start(&ANY_PORT);
    let mut client = program.client();
    let there = image_error(&mut client, "/etc/hostname");
    assert_eq!(there, image_error(&mut client, "/no/such/file"));
    assert!(there.contains("images.directory"), "{there}");
    assert_eq!(program.end(), Some(0));

    let program = Program::folder().write("secret.png", "x");
    let images = program.path("images");
    std::fs::create_dir(&images).unwrap();
    std::fs::create_dir(program.path("images-2")).unwrap();
    std::fs::write(program.path("images-2/x.png"), "x").unwrap();
    symlink("../secret.png", images.join("there.png")).unwrap();
    symlink("../nothing.png", images.join("nothing.png")).unwrap();
    symlink("/", images.join("root")).unwrap();
    pipe(&images.join("pipe.png"));
    let picture = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../calib/tests/data/s2_turbid.png"
    );
    std::fs::copy(picture, images.join("a.png")).unwrap();
    symlink("a.png", images.join("inside.png")).unwrap();
    let mut program = program
        .config(&format!("[images]\ndirectory = {images:?}\n"))
        .start(&ANY_PORT);
    let mut client = program.client();
    let outside = image_error(&mut client, "/no/such/file");
    for path in [
        "/etc/hostname",
        "/etc/hostname/x",
        "/root/x",
        "../secret.png",
        "../nothing.png",
        "../images-2/x.png",
        "there.png",
        "nothing.png",
        "root/etc/hostname",
        "root/no/such/file",
        "missing.png",
        "",
        "a\u{0}b",
    ] {
        assert_eq!(image_error(&mut client, path), outside, "{path:?}");
    }
    image_error(&mut client, "pipe.png");
    image_error(&mut client, ".");
    for path in [
        "a.png",
        "inside.png",
        images.join("a.png").to_str().unwrap(),
    ] {
        let request = json!({"op": "suggest_image", "depth_m": 1.0, "distance_m": 1.0,
                             "light_pct": 1.0, "image": {"path": path}});
        assert_eq!(client.ask(&request)["ok"], true, "{path}");
    }
}
