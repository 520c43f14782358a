//! The program under strange circumstances: files that block or tear, descriptors that run out, neighbours
//! that look on.

use std::io::{BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::client::{Client, MODEL, PATIENCE, suggest};
use crate::program::{ANY_PORT, Program, TOKEN, get, text};

fn mode(path: &Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}

fn set_mode(path: &Path, mode: u32) {
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

fn pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success());
}

/// What the metrics port answers to a head as it stands.
fn answered(address: &str, head: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(head.as_bytes()).unwrap();
    let mut reply = String::new();
    stream.read_to_string(&mut reply).unwrap();
    reply.lines().next().unwrap_or_default().to_owned()
}

/// A page whose name was made to point at this machine sends that name.
fn assert_refuses_strangers(port: &str) {
    for host in [
        "evil.example",
        "evil.example:9475",
        "127.0.0.1.evil.example",
        "10.0.0.1",
        "[::2]",
        "",
    ] {
        let head = format!("GET /metrics HTTP/1.1\r\nHost: {host}\r\n\r\n");
        assert_eq!(
            answered(port, &head),
            "HTTP/1.1 421 Misdirected Request",
            "{host:?}"
        );
    }
}

#[test]
fn the_metrics_port_answers_to_names_of_its_own_only() {
    let mut program = Program::folder()
        .config("[operations]\nmetrics = \"127.0.0.1:0\"\n")
        .start(&ANY_PORT);
    assert_refuses_strangers(&program.told("uwguide metrics on "));
    let mut program = Program::folder()
        .config("[operations]\nmetrics = \"127.0.0.1:0\"\nmetrics_hosts = [\"Vehicle.local\"]\n")
        .start(&ANY_PORT);
    let port = program.told("uwguide metrics on ");
    let number = port.rsplit_once(':').unwrap().1;
    assert_refuses_strangers(&port);
    for host in [
        "localhost",
        "LOCALHOST.",
        "127.0.0.1",
        "127.9.9.9:1",
        "[::1]",
        "vehicle.LOCAL",
        &format!("localhost:{number}"),
    ] {
        let head = format!("GET /metrics HTTP/1.1\r\nhOST:  {host} \r\n\r\n");
        assert_eq!(answered(&port, &head), "HTTP/1.1 200 OK", "{host}");
    }
    let cases = [
        ("GET /metrics HTTP/1.1\r\n\r\n", "HTTP/1.1 400 Bad Request"),
        (
            "GET /metrics HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n",
            "HTTP/1.1 400 Bad Request",
        ),
        ("GET /healthz HTTP/1.0\r\n\r\n", "HTTP/1.1 200 OK"),
        (
            "GET http://evil.example/metrics HTTP/1.1\r\nHost: localhost\r\n\r\n",
            "HTTP/1.1 404 Not Found",
        ),
    ];
    for (head, expected) in cases {
        assert_eq!(answered(&port, head), expected, "{head}");
    }
}

#[test]
fn health_is_told_beside_requests_that_are_never_finished() {
    let mut program = Program::folder()
        .config("[operations]\nmetrics = \"127.0.0.1:0\"\n")
        .start(&ANY_PORT);
    let port = program.told("uwguide metrics on ");
    let half: Vec<TcpStream> = (0..300)
        .map(|_| {
            let mut stream = TcpStream::connect(&port).unwrap();
            stream.write_all(b"GET /healthz HTTP/1.1\r\nHos").unwrap();
            stream
        })
        .collect();
    assert_eq!(get(&port, "/healthz").0, "HTTP/1.1 200 OK");
    assert_eq!(get(&port, "/metrics").0, "HTTP/1.1 200 OK");
    drop(half);
}

#[test]
fn tokens_that_others_can_read_or_hear_are_warned_about() {
    let program = Program::folder()
        .write("token", TOKEN)
        .config("[security]\ntoken_file = \"token\"\n");
    set_mode(&program.path("token"), 0o644);
    let said = text(&program.output(&["--check-config"]).stderr);
    assert!(
        said.contains("token: can be read by others than its owner (mode 0644)"),
        "{said}"
    );
    set_mode(&program.path("token"), 0o600);
    assert_eq!(text(&program.output(&["--check-config"]).stderr), "");
    set_mode(&program.path("token"), 0o640);
    let mut program = program.start(&["--listen", "0.0.0.0:0"]);
    let line = program.told("WARN ");
    assert!(
        line.contains("token: can be read by others than its owner (mode 0640)"),
        "{line}"
    );
    let line = program.told("WARN ");
    assert!(
        line.contains("without TLS") && line.contains("0.0.0.0:"),
        "{line}"
    );
}

#[test]
fn wrong_tokens_are_logged() {
    let mut program = Program::folder()
        .write("token", TOKEN)
        .config("[security]\ntoken_file = \"token\"\n");
    set_mode(&program.path("token"), 0o600);
    program = program.start(&ANY_PORT);
    let mut client = program.client();
    client.refused(&json!({"op": "auth", "token": "wrong"}));
    let line = program.told("WARN ");
    assert!(
        line.contains("wrong token") && line.contains("127.0.0.1:"),
        "{line}"
    );
    assert!(!line.contains("\"wrong\""), "{line}");
}

#[test]
fn another_protocol_is_logged_with_its_peer() {
    let mut program = Program::folder().start(&ANY_PORT);
    let mut client = program.client();
    client.send(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    let line = program.told("WARN ");
    let peer = client.stream.local_addr().unwrap().to_string();
    assert!(line.contains("HTTP") && line.contains(&peer), "{line}");
}

#[test]
fn a_reload_opens_regular_files_only_and_degrades_the_health() {
    let mut program = Program::folder()
        .config("[operations]\nmetrics = \"127.0.0.1:0\"\n")
        .start(&ANY_PORT);
    let metrics = program.told("uwguide metrics on ");
    let mut client = program.client();
    let health = |client: &mut Client| client.ask(&json!({"op": "health"}));
    assert_eq!(health(&mut client)["status"], "ok");
    std::fs::remove_file(program.path("model.json")).unwrap();
    pipe(&program.path("model.json"));
    program.signal("-HUP");
    let deadline = Instant::now() + PATIENCE;
    let told = loop {
        let told = health(&mut client);
        if !told["reload_error"].is_null() {
            break told;
        }
        assert!(
            Instant::now() < deadline,
            "the reload waits for the pipe: {told}"
        );
    };
    let message = told["reload_error"].as_str().unwrap();
    assert!(
        message.contains("model.json: must be a regular file"),
        "{message}"
    );
    assert_eq!(told["status"], "degraded");
    assert_eq!(client.ask(&suggest())["valid"], true);
    assert_eq!(get(&metrics, "/healthz").0, "HTTP/1.1 200 OK");
    // What is usable again is well again.
    std::fs::remove_file(program.path("model.json")).unwrap();
    std::fs::copy(MODEL, program.path("model.json")).unwrap();
    program.signal("-HUP");
    while health(&mut client)["status"] != "ok" {
        assert!(Instant::now() < deadline);
    }
    assert_eq!(program.end(), Some(0));
    for name in ["model.json", "profile.json"] {
        let program = Program::folder();
        std::fs::remove_file(program.path(name)).unwrap();
        pipe(&program.path(name));
        let output = program.output(&ANY_PORT);
        assert_eq!(output.status.code(), Some(2));
        let said = text(&output.stderr);
        assert!(
            said.contains(&format!("{name}: must be a regular file")),
            "{said}"
        );
    }
}

#[test]
fn descriptors_that_run_out_are_logged_once() {
    let mut program = Program::folder();
    let script = format!(
        "ulimit -n 40; exec {} --model model.json --profile profile.json --listen 127.0.0.1:0",
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
    let address = program.told("uwguide listening on ");
    let held: Vec<TcpStream> = (0..60)
        .map(|_| TcpStream::connect(&address).unwrap())
        .collect();
    program.told("accepting failed");
    std::thread::sleep(Duration::from_secs(2));
    drop(held);
    // Places are free again, so this is answered, and the rest of what was said is told.
    let mut client = Client::to(address.parse().unwrap());
    assert_eq!(client.ask(&suggest())["valid"], true);
    assert_eq!(program.end(), Some(0));
    let mut rest = String::new();
    program
        .stderr
        .as_mut()
        .unwrap()
        .read_to_string(&mut rest)
        .unwrap();
    let more = rest
        .lines()
        .filter(|line| line.contains("accepting failed"))
        .count();
    assert!(more <= 1, "{rest}");
}

/// Answers a recording again.
fn replay(program: &Program, name: &str) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_uwguide"))
        .current_dir(program.folder.path())
        .args(["replay", name, "--model", "model.json"])
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
        if length > 0 && length % 512 == 0 && length >= 20_000 {
            break length;
        }
        assert!(Instant::now() < deadline, "{length}");
    };
    program.told("the recording cannot be written");
    // Room is made, and a torn line left.
    std::fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .unwrap()
        .set_len(full - 2000)
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

#[test]
fn the_unit_file_leaves_little_to_take() {
    let unit = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy/uwguide.service");
    let text_of_unit = std::fs::read_to_string(unit).unwrap();
    for directive in [
        "CapabilityBoundingSet=",
        "AmbientCapabilities=",
        "UMask=0077",
        "ProtectProc=invisible",
        "ProcSubset=pid",
        "ProtectClock=yes",
        "ProtectKernelLogs=yes",
        "ProtectHostname=yes",
        "RestrictRealtime=yes",
        "RestrictSUIDSGID=yes",
        "PrivateUsers=yes",
        "IPAddressDeny=any",
        "SystemCallFilter=@system-service",
        "SystemCallFilter=~@privileged @resources",
    ] {
        assert!(
            text_of_unit.lines().any(|line| line == directive),
            "{directive}"
        );
    }
    let analysed = Command::new("systemd-analyze")
        .args(["security", "--offline=true", "--threshold=20", unit])
        .output();
    match analysed {
        Ok(output) => {
            let said = format!("{}{}", text(&output.stdout), text(&output.stderr));
            // The threshold is in tenths: 20 is an exposure of 2.0.
            assert!(output.status.success(), "{said}");
        }
        Err(error) => assert_eq!(error.kind(), std::io::ErrorKind::NotFound, "{error}"),
    }
}
