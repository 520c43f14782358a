//! What clients, disks and files do wrong: the daemon goes on answering the others.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use serde_json::json;
use uw_guidance::{Limits, Running};

use crate::client::{Client, PATIENCE, start, suggest, with};

fn assert_answers(daemon: &Running) {
    assert_eq!(Client::connect(daemon).ask(&suggest())["valid"], true);
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < deadline, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Whether a new connection has a place; one without may be closed with or without a word.
fn gets_an_answer(daemon: &Running) -> bool {
    let mut stream = TcpStream::connect(daemon.local_addr()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut reply = String::new();
    stream.write_all(b"{\"op\": \"health\"}\n").is_ok()
        && BufReader::new(stream).read_line(&mut reply).is_ok()
        && reply.contains("\"ok\":true")
}

#[test]
fn clients_that_are_killed_give_their_places_back() {
    let daemon = start(Limits {
        max_connections: 4,
        ..Limits::default()
    });
    for round in 0..40 {
        let mut client = Client::connect(&daemon);
        match round % 3 {
            // Killed in the middle of a line, with a question unanswered, and with answers unread.
            0 => client.send(b"{\"op\": \"sugg"),
            1 => client.send(format!("{}\n", suggest()).as_bytes()),
            _ => {
                for _ in 0..50 {
                    client.send(format!("{}\n", suggest()).as_bytes());
                }
            }
        }
        drop(client);
        let mut busy = Client::connect(&daemon);
        busy.send(b"{\"op\": \"health\"}\n");
        if round % 8 == 7 {
            wait_for("places are given back", || gets_an_answer(&daemon));
        }
    }
}

#[test]
fn a_gigabyte_of_garbage_harms_nobody_else() {
    let daemon = start(Limits::default());
    let mut other = Client::connect(&daemon);
    let address = daemon.local_addr();
    let flood = std::thread::spawn(move || {
        let mut stream = TcpStream::connect(address).unwrap();
        let garbage = vec![b'\xa7'; 1 << 20];
        for _ in 0..1024 {
            stream.write_all(&garbage).unwrap();
        }
        stream
            .write_all(b"\n{\"op\": \"health\", \"id\": 1}\n")
            .unwrap();
        stream.shutdown(Shutdown::Write).unwrap();
        let mut replies = String::new();
        stream.read_to_string(&mut replies).unwrap();
        replies
    });
    let mut asked = 0;
    while !flood.is_finished() {
        assert_eq!(other.ask(&suggest())["valid"], true);
        asked += 1;
    }
    let replies = flood.join().unwrap();
    let lines: Vec<&str> = replies.lines().collect();
    assert_eq!(lines.len(), 2, "{replies:.400}");
    assert!(lines[0].contains("line_too_long") && lines[1].contains("\"status\":\"ok\""));
    assert!(asked > 10, "{asked} questions were answered meanwhile");
}

#[test]
fn garbage_lines_are_answered_one_by_one_and_in_order() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    for k in 0..200 {
        client.send(b"\x00\xff{]}\n");
        client.send(format!("{}\n", with(json!({"id": k}))).as_bytes());
    }
    for k in 0..200 {
        assert_eq!(client.receive()["ok"], false);
        assert_eq!(client.receive()["id"], k);
    }
}

#[test]
fn ten_thousand_connections_meet_the_limit_and_leave_the_others_alone() {
    let limits = Limits {
        max_connections: 8,
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut client = Client::connect(&daemon);
    assert_eq!(client.ask(&suggest())["valid"], true);
    // As many as a process may have open by default are held at a time.
    let mut held = std::collections::VecDeque::new();
    for k in 0..10_000 {
        held.push_back(TcpStream::connect(daemon.local_addr()).unwrap());
        if held.len() > 200 {
            held.pop_front();
        }
        // Often enough that the queue of connections never fills up, which costs a second each time.
        if k % 25 == 0 {
            assert_eq!(client.ask(&suggest())["valid"], true, "connection {k}");
        }
    }
    drop(held);
    wait_for("places are free again", || gets_an_answer(&daemon));
}

#[test]
fn a_client_that_never_reads_is_held_back_and_then_closed() {
    let limits = Limits {
        write_time: Duration::from_millis(300),
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut greedy = TcpStream::connect(daemon.local_addr()).unwrap();
    greedy
        .set_write_timeout(Some(Duration::from_secs(5)))
        .unwrap();
    let line = format!(
        "{}\n",
        with(json!({"op": "predict",
        "candidates": vec![[1.0, 50.0]; 4000]}))
    );
    let mut sent = 0;
    // Its questions are not taken either while its answers wait: nothing piles up in the daemon.
    let failed = (0..2000).any(|_| {
        sent += line.len();
        greedy.write_all(line.as_bytes()).is_err()
    });
    assert!(
        failed,
        "{sent} bytes of questions were taken without an answer being read"
    );
    assert!(sent < 64 << 20, "{sent} bytes were taken");
    assert_answers(&daemon);
}

#[test]
fn a_line_that_comes_in_drips_is_idle_all_the_same() {
    let limits = Limits {
        idle_time: Duration::from_millis(400),
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut client = Client::connect(&daemon);
    let started = Instant::now();
    let closed = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        client.stream.write_all(b" ").is_err() || started.elapsed() > Duration::from_secs(4)
    });
    assert!(closed);
    assert_eq!(client.receive()["error"]["code"], "idle");
}

#[test]
fn too_many_requests_wait_their_turn_and_none_is_lost() {
    let limits = Limits {
        max_requests_per_s: 100.0,
        ..Limits::default()
    };
    let daemon = start(limits);
    let mut client = Client::connect(&daemon);
    let started = Instant::now();
    for k in 0..60 {
        client.send(format!("{{\"op\": \"info\", \"id\": {k}}}\n").as_bytes());
    }
    for k in 0..60 {
        assert_eq!(client.receive()["id"], k);
    }
    // 10 at once, then 100 a second.
    assert!(
        started.elapsed() > Duration::from_millis(400),
        "{:?}",
        started.elapsed()
    );
}

#[test]
fn what_is_on_its_way_at_shutdown_is_answered() {
    let daemon = start(Limits::default());
    let mut client = Client::connect(&daemon);
    assert_eq!(client.ask(&suggest())["ok"], true);
    for k in 0..100 {
        client.send(format!("{}\n", with(json!({"id": k}))).as_bytes());
    }
    daemon.shutdown();
    for k in 0..100 {
        assert_eq!(client.receive()["id"], k);
    }
    assert_eq!(client.reader.read(&mut [0]).unwrap(), 0);
}

#[test]
fn a_subscriber_gets_its_messages_without_asking() {
    let daemon = start(Limits {
        idle_time: Duration::from_millis(200),
        ..Limits::default()
    });
    let mut driver = Client::connect(&daemon);
    assert_eq!(driver.ask(&with(json!({"op": "state"})))["ok"], true);
    let mut client = Client::connect(&daemon);
    let begun = client.ask(&json!({"op": "subscribe", "id": "s", "rate_hz": 20}));
    assert_eq!(begun["ok"], true);
    for sequence in 1..=10 {
        let push = client.receive();
        assert_eq!(
            (&push["sequence"], &push["valid"]),
            (&json!(sequence), &json!(true))
        );
    }
    // Questions are answered between the messages.
    client.send(b"{\"op\": \"health\", \"id\": \"h\"}\n");
    wait_for("the question is answered", || client.receive()["id"] == "h");
}
