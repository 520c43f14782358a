//! The program `uwguide`: start, answer, end, exit codes.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Output};

use crate::program::Program;
use crate::support::{Numbers, profile};

const MODEL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../guidance/tests/data/mlp_a.json"
);

fn uwguide(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_uwguide"));
    command.current_dir(folder).args(arguments);
    command
}

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    profile(&mut Numbers::new(3))
        .write(&dir.path().join("profile.json"))
        .unwrap();
    dir
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn it_tells_its_port_answers_and_ends_on_sigterm() {
    // Its model gives nothing to warn of, so the address is in the first line.
    let mut program = Program::folder().start(&["--listen", "127.0.0.1:0"]);
    let mut line = String::new();
    let stderr = program.stderr.as_mut().unwrap();
    stderr.read_line(&mut line).unwrap();
    let address = line
        .strip_prefix("uwguide listening on ")
        .expect(&line)
        .trim();
    let mut stream = TcpStream::connect(address).unwrap();
    stream
        .write_all(b"{\"op\": \"health\", \"id\": 1}\n")
        .unwrap();
    let mut reply = String::new();
    BufReader::new(&stream).read_line(&mut reply).unwrap();
    assert!(reply.contains("\"status\":\"ok\""), "{reply}");
    assert_eq!(program.end(), Some(0));
}

#[test]
fn unusable_input_exits_with_2_and_says_why() {
    let dir = folder();
    std::fs::write(
        dir.path().join("bad.json"),
        "{\"format\": \"uw-mlp\", \"version\": 1}",
    )
    .unwrap();
    std::fs::write(
        dir.path().join("bad.toml"),
        "format = \"uwguide-config/1\"\n[limit]\n",
    )
    .unwrap();
    let cases: [(&[&str], &str); 9] = [
        (
            &["--model", "bad.json", "--profile", "profile.json"],
            "bad.json: inputs is missing",
        ),
        (
            &["--model", MODEL, "--profile", "gone.json"],
            "gone.json: cannot be read",
        ),
        (
            &["--model", MODEL, "--profile", "bad.json"],
            "bad.json: this is a model; give it as --model",
        ),
        (
            &[
                "--model",
                MODEL,
                "--profile",
                "profile.json",
                "--config",
                "bad.toml",
            ],
            "did you mean limits?",
        ),
        (&["--model", MODEL], "--profile"),
        (
            &["--model", "profile.json", "--profile", "profile.json"],
            "profile.json: this is a calibration profile; give it as --profile",
        ),
        (
            &[
                "--model",
                MODEL,
                "--no-profile",
                "--listen",
                "127.0.0.1:99999",
            ],
            "the port must be a whole number from 0 to 65535, got 99999",
        ),
        (
            &["--model", MODEL, "--no-profile", "--listen", "7475"],
            "for this machine 127.0.0.1:7475",
        ),
        (
            &["replay", "profile.json", "--model", "profile.json"],
            "this is a calibration profile; give it as --profile",
        ),
    ];
    for (arguments, expected) in cases {
        let output = uwguide(dir.path(), arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(message(&output).contains(expected), "{}", message(&output));
    }
}

#[test]
fn an_address_in_use_exits_with_1() {
    let dir = folder();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let arguments = [
        "--model",
        MODEL,
        "--profile",
        "profile.json",
        "--listen",
        &address,
    ];
    let output = uwguide(dir.path(), &arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        message(&output).contains("cannot listen on 127.0.0.1:")
            && message(&output).contains("choose another address with --listen"),
        "{}",
        message(&output)
    );
}
