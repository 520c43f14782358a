//! The program under strange circumstances: files that block, descriptors that run out, neighbours that look
//! on.

use std::io::{BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::client::{Client, MODEL, PATIENCE, suggest};
use crate::program::{ANY_PORT, Program, TOKEN, get, pipe, set_mode, text};

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

#[test]
fn a_program_that_starts_the_daemon_may_take_its_time() {
    let program = Program::folder().config("[limits]\nfirst_line_time_s = 0.2\n");
    let mut child = program
        .command(&["--stdio"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let mut stdin = child.stdin.take().unwrap();
    // Standard streams hold no place that somebody else could want.
    let asked = stdin.write_all(b"{\"op\": \"health\"}\n");
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    let said = text(&output.stdout);
    assert!(asked.is_ok() && said.contains("\"ok\":true"), "{said}");
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
