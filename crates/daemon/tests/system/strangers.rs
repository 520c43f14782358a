//! Who speaks something else, knows no token, says nothing or takes too many places.

use std::io::{BufRead, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use uw_guidance::service::Settings;
use uw_guidance::{Limits, Running, spawn};

use crate::client::{Client, PATIENCE, service_with, start, suggest};

/// What an attacker would have the daemon do.
const COMMANDS: &str = "{\"op\": \"state\", \"depth_m\": 5.5}\n{\"op\": \"health\"}\n";
/// A token as they should be.
const TOKEN: &str = "a-token-of-some-length";

/// Sends bytes in pieces of a size and takes all that comes back until the daemon closes.
fn converse(daemon: &Running, bytes: &[u8], piece: usize) -> String {
    let mut stream = TcpStream::connect(daemon.local_addr()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.set_nodelay(true).unwrap();
    for part in bytes.chunks(piece) {
        // The daemon may have closed before the last of it.
        if stream.write_all(part).is_err() {
            break;
        }
    }
    let mut replies = Vec::new();
    let mut part = [0; 4096];
    loop {
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(count) => replies.extend_from_slice(&part[..count]),
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => break,
            Err(error) => panic!("the connection is not closed: {error}"),
        }
    }
    String::from_utf8_lossy(&replies).into_owned()
}

/// Asserts that nothing has told the daemon anything or asked it a thing.
fn assert_untouched(daemon: &Running, what: &str) {
    let health = Client::connect(daemon).ask(&json!({"op": "health"}));
    assert_eq!(health["state_age_s"]["depth"], Value::Null, "{what}");
}

fn assert_refused(daemon: &Running, what: &str, bytes: &[u8], piece: usize) {
    let replies = converse(daemon, bytes, piece);
    assert!(!replies.contains("\"ok\":true"), "{what}: {replies}");
    assert!(replies.lines().count() <= 1, "{what}: {replies}");
    assert_untouched(daemon, what);
}

/// A request as browsers and tools send it, with commands as its body.
fn http(method: &str, target: &str) -> Vec<u8> {
    format!(
        "{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:7475\r\nContent-Type: text/plain\r\n\
         Content-Length: {}\r\n\r\n{COMMANDS}",
        COMMANDS.len()
    )
    .into_bytes()
}

#[test]
fn a_web_page_commands_nothing() {
    let daemon = start(Limits::default());
    for method in [
        "GET", "HEAD", "POST", "PUT", "DELETE", "CONNECT", "OPTIONS", "TRACE", "PATCH", "patch",
        "PROPFIND", "M-SEARCH", "Anything",
    ] {
        assert_refused(&daemon, method, &http(method, "/"), usize::MAX);
    }
    for piece in [1, 7] {
        assert_refused(&daemon, "in pieces", &http("POST", "/"), piece);
    }
    // A first line that is longer than any line of the protocol is judged by its beginning.
    let long = format!("/{}", "x".repeat((1 << 20) + 100));
    assert_refused(&daemon, "a long target", &http("POST", &long), usize::MAX);
    let preface = [b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", COMMANDS.as_bytes()].concat();
    assert_refused(&daemon, "HTTP/2", &preface, usize::MAX);
    let blank = [b"\r\n\r\n", &http("POST", "/")[..]].concat();
    let replies = converse(&daemon, &blank, usize::MAX);
    assert!(!replies.contains("\"ok\":true"), "{replies}");
    assert_untouched(&daemon, "blank lines before");
    assert_eq!(Client::connect(&daemon).ask(&suggest())["valid"], true);
}

#[test]
fn other_protocols_are_closed_at_their_greeting() {
    let daemon = start(Limits::default());
    let hello: &[u8] = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 a session ticket may hold\n";
    let stun: &[u8] = b"\x00\x03\x00\x1c\x21\x12\xa4\x42 a user name may hold\n";
    let greetings: [(&str, &[u8]); 12] = [
        ("TLS", hello),
        ("TURN", stun),
        ("SSH", b"SSH-2.0-OpenSSH_9.2p1\r\n"),
        ("SMTP", b"EHLO localhost\r\n"),
        ("FTP", b"USER anonymous\r\n"),
        ("SIP", b"INVITE sip:a@b SIP/2.0\r\n"),
        ("RTSP", b"DESCRIBE rtsp://127.0.0.1/ RTSP/1.0\r\n"),
        ("Redis", b"*1\r\n$4\r\nPING\r\n"),
        ("MQTT", b"\x10\x0e\x00\x04MQTT\x04\x02\x00\x3c\x00\x02\n\n"),
        ("AMQP", b"AMQP\x00\x00\x09\x01\n"),
        ("SOCKS", b"\x05\x01\x00\n"),
        ("HTTP header", b"Host: 127.0.0.1\r\n"),
    ];
    for (what, greeting) in greetings {
        let bytes = [greeting, COMMANDS.as_bytes()].concat();
        assert_refused(&daemon, what, &bytes, usize::MAX);
        assert_refused(&daemon, what, &bytes, 1);
    }
}

#[test]
fn a_few_lines_that_are_no_json_are_answered_and_more_close_the_connection() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    for _ in 0..3 {
        for _ in 0..8 {
            client.send(b"rubbish\n");
            assert_eq!(client.receive()["error"]["code"], "bad_json");
        }
        assert_eq!(
            client.ask(&suggest())["valid"],
            true,
            "a request between them forgives"
        );
    }
    client.send(
        [b"rubbish\n".repeat(9), COMMANDS.into()]
            .concat()
            .as_slice(),
    );
    let mut rest = String::new();
    // What was sent behind the last line read may reset the connection.
    let _ = client.reader.read_to_string(&mut rest);
    assert!(!rest.contains("\"ok\":true"), "{rest}");
    assert_untouched(&daemon, "lines that are no JSON");
}

fn guarded(limits: Limits) -> Running {
    let settings = Settings {
        token: Some(TOKEN.to_owned()),
        ..Settings::default()
    };
    spawn("127.0.0.1:0", service_with(settings, true), limits).unwrap()
}

#[test]
fn a_connection_has_three_tries_at_the_token() {
    let daemon = guarded(Limits::default());
    let mut client = Client::connect(&daemon);
    for k in 0..3 {
        let reply = client.ask(&json!({"op": "auth", "token": format!("guess {k}")}));
        assert_eq!(reply["error"]["code"], "unauthorised");
    }
    let _ = client
        .stream
        .write_all(format!("{{\"op\": \"auth\", \"token\": \"{TOKEN}\"}}\n").as_bytes());
    let mut rest = String::new();
    let _ = client.reader.read_to_string(&mut rest);
    assert_eq!(rest, "", "nothing is answered any more");
}

#[test]
fn connecting_again_does_not_buy_tries_at_the_token() {
    let daemon = guarded(Limits::default());
    let address = daemon.local_addr();
    let end = Instant::now() + Duration::from_secs(3);
    let guessing: Vec<_> = (0..8)
        .map(|_| {
            std::thread::spawn(move || {
                let mut told = 0_u64;
                while Instant::now() < end {
                    let mut client = Client::to(address);
                    let _ = client
                        .stream
                        .set_read_timeout(Some(Duration::from_millis(200)));
                    client.send(b"{\"op\": \"auth\", \"token\": \"a wrong guess\"}\n");
                    let mut reply = String::new();
                    let _ = client.reader.read_line(&mut reply);
                    told += u64::from(reply.contains("the token is wrong"));
                }
                told
            })
        })
        .collect();
    let told: u64 = guessing
        .into_iter()
        .map(|thread| thread.join().unwrap())
        .sum();
    assert!(told < 40, "{told} guesses were answered within 3 s");
    // Whoever knows it gets in, once the flood has left.
    let deadline = Instant::now() + PATIENCE;
    loop {
        let mut friend = Client::connect(&daemon);
        let asked = friend
            .stream
            .write_all(format!("{}\n", json!({"op": "auth", "token": TOKEN})).as_bytes());
        let mut reply = String::new();
        if asked.is_ok()
            && friend.reader.read_line(&mut reply).is_ok()
            && reply.contains("\"ok\":true")
        {
            assert_eq!(friend.ask(&suggest())["valid"], true);
            break;
        }
        assert!(Instant::now() < deadline, "{reply}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn whoever_shows_no_token_is_closed_whatever_else_it_says() {
    let daemon = guarded(Limits {
        idle_time: Duration::from_millis(500),
        ..Limits::default()
    });
    let mut client = Client::connect(&daemon);
    let started = Instant::now();
    let closed = loop {
        if client.stream.write_all(b"{\"op\": \"health\"}\n").is_err() {
            break true;
        }
        if started.elapsed() > PATIENCE {
            break false;
        }
        std::thread::sleep(Duration::from_millis(100));
    };
    assert!(closed, "requests without a token keep a place for ever");
}

#[test]
fn silent_connections_give_their_places_back() {
    let limits = Limits {
        max_connections: 8,
        first_line_time: Duration::from_millis(300),
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut silent: Vec<TcpStream> = (0..8)
        .map(|_| TcpStream::connect(daemon.local_addr()).unwrap())
        .collect();
    silent[1].write_all(b"{\"op\": \"heal").unwrap();
    silent[2].write_all(b"rubbish\n").unwrap();
    let deadline = Instant::now() + PATIENCE;
    let mut client = loop {
        let mut client = Client::connect(&daemon);
        let reply = client.ask(&suggest());
        if reply["ok"] == true {
            break client;
        }
        assert!(Instant::now() < deadline, "{reply}");
    };
    // Whoever has asked something may then be silent for longer.
    std::thread::sleep(Duration::from_millis(900));
    assert_eq!(client.ask(&suggest())["ok"], true);
}

/// A connection from one of this machine's own addresses.
#[cfg(target_os = "linux")]
fn from(own: &str, daemon: &Running) -> Client {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let stream = runtime.block_on(async {
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind(format!("{own}:0").parse().unwrap()).unwrap();
        let stream = socket.connect(daemon.local_addr()).await.unwrap();
        stream.into_std().unwrap()
    });
    stream.set_nonblocking(false).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    Client {
        reader: std::io::BufReader::new(stream.try_clone().unwrap()),
        stream,
    }
}

#[cfg(target_os = "linux")]
#[test]
fn one_address_cannot_hold_every_place() {
    let limits = Limits {
        max_connections: 4,
        max_connections_per_address: 2,
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut held: Vec<Client> = (0..2).map(|_| from("127.0.0.1", &daemon)).collect();
    for client in &mut held {
        assert_eq!(client.ask(&suggest())["ok"], true);
    }
    let mut third = from("127.0.0.1", &daemon);
    let reply = third.receive();
    assert_eq!(reply["error"]["code"], "busy");
    let message = reply["error"]["message"].as_str().unwrap();
    assert!(message.contains("127.0.0.1"), "{message}");
    assert_eq!(from("127.0.0.2", &daemon).ask(&suggest())["ok"], true);
    held.pop().unwrap().stream.shutdown(Shutdown::Both).unwrap();
    let deadline = Instant::now() + PATIENCE;
    while from("127.0.0.1", &daemon).ask(&suggest())["ok"] != true {
        assert!(
            Instant::now() < deadline,
            "a place given back is not given again"
        );
    }
}
