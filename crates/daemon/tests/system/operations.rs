//! The program around the daemon: configuration, reloading, recordings, sockets, metrics, supervision.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::client::{Client, MODEL, PATIENCE, suggest, with};
use crate::files::replay_configured;
use crate::program::{ANY_PORT, Program, TOKEN, get, text};
use crate::support::Numbers;

#[test]
fn a_configuration_is_printed_and_checked_without_serving() {
    let program = Program::folder();
    let printed = Command::new(env!("CARGO_BIN_EXE_uwguide"))
        .arg("--print-default-config")
        .output()
        .unwrap();
    assert!(printed.status.success());
    let program = program.write("config.toml", &text(&printed.stdout));
    let checked = program.output(&["--check-config"]);
    assert!(checked.status.success(), "{}", text(&checked.stderr));
    let cases = [
        (
            "[limits]\nmax_conections = 3\n",
            "did you mean max_connections?",
        ),
        (
            "[security]\ntoken_file = \"gone\"\n",
            "gone: cannot be read",
        ),
        (
            "[tls]\ncertificate = \"gone.pem\"\nkey = \"gone.key\"\n",
            "gone.key",
        ),
    ];
    let mut program = program;
    for (lines, expected) in cases {
        program = program.config(lines);
        let checked = program.output(&["--check-config"]);
        assert_eq!(checked.status.code(), Some(2), "{lines}");
        assert!(
            text(&checked.stderr).contains(expected),
            "{}",
            text(&checked.stderr)
        );
    }
}

#[test]
fn it_listens_to_strangers_only_with_a_guard() {
    let open = ["--listen", "0.0.0.0:0"];
    let refused = Program::folder().output(&open);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        text(&refused.stderr).contains("token_file"),
        "{}",
        text(&refused.stderr)
    );
    let mut guarded = Program::folder()
        .write("token", TOKEN)
        .config("[security]\ntoken_file = \"token\"\n")
        .start(&open);
    let address = guarded.told("uwguide listening on ");
    let address = address.replace("0.0.0.0", "127.0.0.1");
    let mut client = Client::to(address.parse().unwrap());
    assert_eq!(client.refused(&suggest())["code"], "unauthorised");
    assert_eq!(
        client.ask(&json!({"op": "auth", "token": TOKEN}))["ok"],
        true
    );
    assert_eq!(client.ask(&suggest())["valid"], true);
    let image = json!({"op": "suggest_image", "depth_m": 1.0, "distance_m": 1.0,
                       "light_pct": 1.0, "image": {"path": "/etc/hostname"}});
    let error = client.refused(&image);
    assert!(
        error["message"]
            .as_str()
            .unwrap()
            .contains("no image directory"),
        "{error}"
    );
    let encrypted = Program::folder().config(&tls_config(false)).output(&open);
    assert_eq!(
        encrypted.status.code(),
        Some(2),
        "TLS alone knows no strangers"
    );
}

fn tls_file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../guidance/tests/data/tls")
        .join(name)
}

fn tls_config(client_ca: bool) -> String {
    let mut config = format!(
        "[tls]\ncertificate = {:?}\nkey = {:?}\n",
        tls_file("server.pem"),
        tls_file("server.key")
    );
    if client_ca {
        config += &format!("client_ca = {:?}\n", tls_file("ca.pem"));
    }
    config
}

/// Asks over TLS, with or without a certificate of its own.
async fn ask_encrypted(address: &str, certificate: bool) -> std::io::Result<String> {
    use tokio::io::{AsyncBufReadExt, AsyncWriteExt};
    use tokio_rustls::rustls::pki_types::pem::PemObject;
    use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
    use tokio_rustls::rustls::{ClientConfig, RootCertStore, crypto::ring};
    let mut roots = RootCertStore::empty();
    roots
        .add(CertificateDer::from_pem_file(tls_file("ca.pem")).unwrap())
        .unwrap();
    let builder = ClientConfig::builder_with_provider(ring::default_provider().into())
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots);
    let config = if certificate {
        let chain = vec![CertificateDer::from_pem_file(tls_file("client.pem")).unwrap()];
        let key = PrivateKeyDer::from_pem_file(tls_file("client.key")).unwrap();
        builder.with_client_auth_cert(chain, key).unwrap()
    } else {
        builder.with_no_client_auth()
    };
    let connector = tokio_rustls::TlsConnector::from(std::sync::Arc::new(config));
    let stream = tokio::net::TcpStream::connect(address).await?;
    let mut stream = connector
        .connect("localhost".try_into().unwrap(), stream)
        .await?;
    stream
        .write_all(format!("{}\n", suggest()).as_bytes())
        .await?;
    let mut reply = String::new();
    tokio::io::BufReader::new(stream)
        .read_line(&mut reply)
        .await?;
    Ok(reply)
}

#[test]
fn certificates_on_both_sides_open_an_encrypted_connection() {
    let mut program = Program::folder()
        .config(&tls_config(true))
        .start(&["--listen", "0.0.0.0:0"]);
    let address = program
        .told("uwguide listening on ")
        .replace("0.0.0.0", "127.0.0.1");
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let reply = runtime.block_on(ask_encrypted(&address, true)).unwrap();
    assert!(reply.contains("\"valid\":true"), "{reply}");
    let stranger = runtime.block_on(ask_encrypted(&address, false));
    assert!(
        !stranger.is_ok_and(|reply| reply.contains("valid")),
        "a stranger was answered"
    );
    // Somebody who does not speak TLS at all is not answered and does no harm.
    let mut plain = TcpStream::connect(&address).unwrap();
    plain.write_all(b"{\"op\": \"health\"}\n").unwrap();
    plain.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut bytes = Vec::new();
    let _ = plain.read_to_end(&mut bytes);
    assert!(!text(&bytes).contains("status"));
    let reply = runtime.block_on(ask_encrypted(&address, true)).unwrap();
    assert!(reply.contains("\"valid\":true"), "{reply}");
}

#[test]
fn a_hangup_takes_the_new_model_and_refuses_a_truncated_one() {
    let mut program = Program::folder().start(&ANY_PORT);
    let mut client = program.client();
    let health =
        |client: &mut Client, field: &str| client.ask(&json!({"op": "health"}))[field].clone();
    let before = client.ask(&suggest());
    let whole = std::fs::read(MODEL).unwrap();
    std::fs::write(program.path("model.json"), &whole[..whole.len() / 2]).unwrap();
    program.signal("-HUP");
    let deadline = Instant::now() + PATIENCE;
    while health(&mut client, "reload_error").is_null() {
        assert!(Instant::now() < deadline);
    }
    let message = health(&mut client, "reload_error");
    assert!(
        message
            .as_str()
            .unwrap()
            .contains("model.json: not valid JSON"),
        "{message}"
    );
    assert_eq!(
        client.ask(&suggest())["score"],
        before["score"],
        "the old model stays"
    );
    let mut model: Value = serde_json::from_slice(&whole).unwrap();
    model["outputs"][0]["scale"] = json!(9.0);
    std::fs::write(program.path("model.json"), model.to_string()).unwrap();
    program.signal("-HUP");
    while health(&mut client, "reloads") != 1 {
        assert!(Instant::now() < deadline);
    }
    assert_eq!(health(&mut client, "reload_error"), Value::Null);
    assert_ne!(client.ask(&suggest())["score"], before["score"]);
    assert_eq!(program.end(), Some(0));
}

#[test]
fn a_full_disk_for_logs_and_recordings_costs_no_answer() {
    let mut program = Program::folder()
        .config(
            "[operations]\nlog_file = \"/dev/full\"\nlog_level = \"debug\"\n\
             record = \"/dev/full\"\nmetrics = \"127.0.0.1:0\"\n",
        )
        .start(&ANY_PORT);
    let metrics = program.told("uwguide metrics on ");
    let mut client = program.client();
    for k in 0..2000 {
        assert_eq!(client.ask(&with(json!({"id": k})))["id"], k);
    }
    let deadline = Instant::now() + PATIENCE;
    loop {
        let (_, body) = get(&metrics, "/metrics");
        let line = body
            .lines()
            .find(|l| l.starts_with("uwguide_record_failures_total "))
            .unwrap();
        if line != "uwguide_record_failures_total 0" {
            break;
        }
        assert!(Instant::now() < deadline, "lost records are counted");
    }
    assert_eq!(program.end(), Some(0));
}

#[test]
fn metrics_and_health_are_served_on_their_own_port() {
    let mut program = Program::folder()
        .config("[operations]\nmetrics = \"127.0.0.1:0\"\n")
        .start(&ANY_PORT);
    let port = program.told("uwguide metrics on ");
    let mut client = program.client();
    client.ask(&suggest());
    client.refused(&json!({"op": "dance"}));
    let (status, body) = get(&port, "/metrics");
    assert_eq!(status, "HTTP/1.1 200 OK");
    for line in [
        "uwguide_requests_total{op=\"suggest\"} 1",
        "uwguide_faults_total{fault=\"unknown_op\"} 1",
        "uwguide_connections 1",
    ] {
        assert!(body.lines().any(|l| l == line), "{line} is not in\n{body}");
    }
    assert_eq!(get(&port, "/healthz").1, "ok\n");
    assert_eq!(get(&port, "/readyz?verbose").0, "HTTP/1.1 200 OK");
    assert_eq!(get(&port, "/else").0, "HTTP/1.1 404 Not Found");
    // An exchange that never ends keeps neither others nor the daemon waiting.
    let _half = TcpStream::connect(&port).unwrap().write_all(b"GET /met");
    assert_eq!(get(&port, "/healthz").0, "HTTP/1.1 200 OK");
    let public = Program::folder()
        .config("[operations]\nmetrics = \"0.0.0.0:0\"\n")
        .output(&ANY_PORT);
    assert_eq!(public.status.code(), Some(1), "{}", text(&public.stderr));
}

#[test]
fn a_recorded_session_is_answered_again_bit_for_bit() {
    let mut program = Program::folder()
        .config("[operations]\nrecord = \"session.ndjson\"\n[max_age]\ndistance_s = 0.4\n")
        .start(&ANY_PORT);
    let mut client = program.client();
    client.ask(&json!({"op": "subscribe", "id": "s", "rate_hz": 20}));
    let numbers = &mut Numbers::new(11);
    for k in 0..60 {
        let distance_m = numbers.between(0.6, 2.9);
        client.send(format!("{}\n", with(json!({"id": k, "distance_m": distance_m}))).as_bytes());
        let state = with(json!({"op": "state", "id": k, "distance_m": distance_m}));
        if k % 4 == 0 {
            client.send(format!("{state}\n").as_bytes());
        }
        client.send(b"{\"op\": \"suggest\"}\n\xff\xfe\n{\"op\": \"info\"}\n");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(700));
    program.signal("-HUP");
    client.send(b"{\"op\": \"health\", \"id\": \"last\"}\n");
    let mut pushes = 0;
    loop {
        let reply = client.receive();
        pushes += usize::from(reply["push"] == true);
        if reply["id"] == "last" {
            break;
        }
    }
    assert!(pushes > 10, "{pushes}");
    assert_eq!(program.end(), Some(0));
    let replay = |name: &str| replay_configured(&program, name);
    let (code, said, warned) = replay("session.ndjson");
    assert_eq!(code, Some(0), "{said}\n{warned}");
    let same: usize = said.split(' ').next().unwrap().parse().unwrap();
    assert!(same > 240 && said.contains(" 0 different"), "{said}");
    assert!(
        std::fs::read_to_string(program.path("session.ndjson"))
            .unwrap()
            .contains("stale_input")
    );
    // A recording of other answers is told from this one.
    let recording = std::fs::read_to_string(program.path("session.ndjson")).unwrap();
    std::fs::write(
        program.path("other.ndjson"),
        recording.replacen("\\\"evaluations\\\":", "\\\"evaluations\\\":1", 1),
    )
    .unwrap();
    let (code, said, _) = replay("other.ndjson");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains(" 1 different"));
    std::fs::write(
        program.path("cut.ndjson"),
        &recording[..recording.len() - 30],
    )
    .unwrap();
    let (code, said, _) = replay("cut.ndjson");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains(", 1 torn"));
    std::fs::write(program.path("none.ndjson"), "no recording\n").unwrap();
    assert_eq!(replay("none.ndjson").0, Some(2));
}

#[test]
fn a_unix_socket_and_standard_streams_serve_as_well() {
    let mut program = Program::folder().start(&["--listen", "unix:guide.sock"]);
    program.told("uwguide listening on unix:guide.sock");
    let path = program.path("guide.sock");
    let mut stream = UnixStream::connect(&path).unwrap();
    stream.write_all(b"{\"op\": \"health\"}\n").unwrap();
    let mut reply = String::new();
    BufReader::new(&stream).read_line(&mut reply).unwrap();
    assert!(reply.contains("\"status\":\"ok\""), "{reply}");
    assert_eq!(
        program
            .output(&["--listen", "unix:guide.sock"])
            .status
            .code(),
        Some(1)
    );
    assert_eq!(program.end(), Some(0));
    assert!(!path.exists(), "the socket file goes with the daemon");

    let mut child = Program::folder();
    let mut process = child
        .command(&["--stdio"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = process.stdin.take().unwrap();
    stdin
        .write_all(format!("{}\nrubbish\n", suggest()).as_bytes())
        .unwrap();
    drop(stdin);
    let mut replies = String::new();
    process
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut replies)
        .unwrap();
    child.child = Some(process);
    assert_eq!(replies.lines().count(), 2, "{replies}");
    assert!(replies.contains("\"valid\":true") && replies.contains("bad_json"));
    assert_eq!(
        child.child.as_mut().unwrap().wait().unwrap().code(),
        Some(0)
    );
}

#[test]
fn the_service_manager_is_told_and_hands_sockets_over() {
    let folder = tempfile::tempdir().unwrap();
    let notify = folder.path().join("notify");
    let manager = UnixDatagram::bind(&notify).unwrap();
    manager.set_read_timeout(Some(PATIENCE)).unwrap();
    let heard = || {
        let mut bytes = [0; 4096];
        let count = manager.recv(&mut bytes).unwrap();
        text(&bytes[..count])
    };
    let socket = folder.path().join("handed.sock");
    let listener = UnixListener::bind(&socket).unwrap();
    let mut program = Program::folder();
    // A shell gives the socket the number that socket activation prescribes.
    let script = format!(
        "exec env LISTEN_PID=$$ LISTEN_FDS=1 NOTIFY_SOCKET={} WATCHDOG_USEC=100000 {} \
         --model model.json --profile profile.json 3<&0",
        notify.display(),
        env!("CARGO_BIN_EXE_uwguide")
    );
    let child = Command::new("sh")
        .current_dir(program.folder.path())
        .args(["-c", &script])
        .stdin(std::os::fd::OwnedFd::from(listener))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    program.child = Some(child);
    while !heard().contains("READY=1") {}
    while !heard().contains("WATCHDOG=1") {}
    let mut stream = UnixStream::connect(&socket).unwrap();
    stream.write_all(b"{\"op\": \"health\"}\n").unwrap();
    let mut reply = String::new();
    BufReader::new(&stream).read_line(&mut reply).unwrap();
    assert!(reply.contains("\"status\":\"ok\""), "{reply}");
    program.signal("-HUP");
    while !heard().contains("RELOADING=1") {}
    while !heard().contains("READY=1") {}
    program.signal("-TERM");
    while !heard().contains("STOPPING=1") {}
    assert_eq!(
        program.child.as_mut().unwrap().wait().unwrap().code(),
        Some(0)
    );
}

#[test]
fn logs_are_json_when_wanted() {
    let mut program = Program::folder()
        .config("[operations]\nlog_format = \"json\"\nlog_file = \"log.ndjson\"\n")
        .start(&ANY_PORT);
    let mut client = program.client();
    client.ask(&suggest());
    assert_eq!(program.end(), Some(0));
    let log = std::fs::read_to_string(program.path("log.ndjson")).unwrap();
    let last: Value = serde_json::from_str(log.lines().last().unwrap()).unwrap();
    assert_eq!(
        (&last["level"], &last["fields"]["message"]),
        (&json!("INFO"), &json!("shutting down"))
    );
}
