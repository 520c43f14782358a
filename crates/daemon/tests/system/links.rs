//! Links against fake peers: a Doppler log, MAVLink2REST and rosbridge.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio_tungstenite::{WebSocketStream, tungstenite::Message};
use uw_daemon::links::dvl::{DvlConfig, DvlDistance};
use uw_daemon::links::mavlink::{Lamps, MavlinkConfig};
use uw_daemon::links::rosbridge::RosbridgeConfig;
use uw_daemon::links::{Feeder, Pauses, dvl, mavlink, rosbridge};
use uw_guidance::Service;
use uw_guidance::service::Session;

use crate::client::{PATIENCE, service, suggest, with};

const SOON: Pauses = Pauses {
    first: Duration::from_millis(20),
    last: Duration::from_millis(100),
};

/// The next text that a peer hears.
async fn next_text(socket: &mut WebSocketStream<tokio::net::TcpStream>) -> String {
    let message = socket.next().await.unwrap().unwrap();
    message.into_text().unwrap().to_string()
}

/// A service and the runtime that its link runs on.
struct Linked {
    service: Arc<Service>,
    runtime: tokio::runtime::Runtime,
}

impl Linked {
    fn new() -> Self {
        Self {
            service: Arc::new(service()),
            runtime: tokio::runtime::Runtime::new().unwrap(),
        }
    }

    fn feeder(&self) -> Feeder {
        Feeder::new(Arc::clone(&self.service), None, 1)
    }

    fn tell(&self, request: &Value) -> Value {
        let mut session = Session::new(Arc::clone(&self.service));
        serde_json::from_str(&session.reply(request.to_string().as_bytes())).unwrap()
    }

    fn wait_for(&self, what: &str, mut done: impl FnMut(&Service) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !done(&self.service) {
            assert!(Instant::now() < deadline, "{what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn listener() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, address)
}

fn report(distances_m: [f64; 4], valid: bool) -> String {
    let beams: Vec<Value> = (0..4)
        .map(|k| {
            json!({"id": k, "velocity": 0.01, "distance": distances_m[k], "rssi": -30, "nsd": -90,
                   "beam_valid": valid})
        })
        .collect();
    let report = json!({"time": 64.0, "vx": 0.0, "vy": 0.0, "vz": 0.0, "fom": 0.001,
        "altitude": if valid { distances_m[0] } else { -1.0 }, "velocity_valid": valid,
        "transducers": beams, "status": 0, "format": "json_v1", "type": "velocity"});
    format!("{report}\r\n")
}

#[test]
fn a_doppler_log_feeds_the_distance_through_cuts_and_rubbish() {
    let linked = Linked::new();
    let (log, address) = listener();
    let config = DvlConfig {
        address,
        distance: DvlDistance::Beams,
        pauses: SOON,
    };
    linked.runtime.spawn(dvl::run(config, linked.feeder()));
    let (mut stream, _) = log.accept().unwrap();
    let range_m = |distance_m: f64| distance_m / 22.5f64.to_radians().cos();
    stream
        .write_all(b"{\"response_to\": \"x\"}\r\nrubbish\r\n")
        .unwrap();
    stream
        .write_all(report([range_m(1.25); 4], true).as_bytes())
        .unwrap();
    let fed = |service: &Service| service.feed().range.map(|reading| reading.value);
    linked.wait_for("the distance is fed", |service| {
        fed(service).is_some_and(|range| (range.distance_m - 1.25).abs() < 1e-9)
    });
    assert_eq!(fed(&linked.service).unwrap().plane.unwrap().beams, 4);
    // Duplicates and reports without bottom lock change nothing, not even the time.
    let taken_s = linked.service.feed().range.unwrap().taken_s;
    stream
        .write_all(report([range_m(1.25); 4], true).as_bytes())
        .unwrap();
    stream
        .write_all(report([range_m(1.5); 4], false).as_bytes())
        .unwrap();
    // The log restarts in the middle of a report.
    let half = report([range_m(2.0); 4], true);
    stream
        .write_all(&half.as_bytes()[..half.len() / 2])
        .unwrap();
    drop(stream);
    let (mut stream, _) = log.accept().unwrap();
    assert_eq!(linked.service.feed().range.unwrap().taken_s, taken_s);
    stream
        .write_all(report([range_m(0.75); 4], true).as_bytes())
        .unwrap();
    linked.wait_for("the distance is fed again", |service| {
        fed(service).is_some_and(|range| (range.distance_m - 0.75).abs() < 1e-9)
    });
}

/// What the fake MAVLink2REST has and got.
#[derive(Default)]
struct Autopilot {
    counter: u64,
    light: f64,
    commands: Vec<Value>,
}

/// Answers one exchange as MAVLink2REST does.
fn answer(mut stream: TcpStream, autopilot: &Mutex<Autopilot>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let (mut first, mut length) = (String::new(), 0);
    reader.read_line(&mut first)?;
    loop {
        let mut line = String::new();
        reader.read_line(&mut line)?;
        let lower = line.to_ascii_lowercase();
        if let Some(value) = lower.strip_prefix("content-length:") {
            length = value.trim().parse().unwrap_or(0);
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let mut autopilot = autopilot.lock().unwrap();
    let message = if first.starts_with("POST /v1/mavlink ") {
        autopilot.commands.push(serde_json::from_slice(&body)?);
        None
    } else if first.contains("/vehicles/1/components/1/messages/DISTANCE_SENSOR") {
        Some(
            json!({"current_distance": 140, "min_distance": 10, "max_distance": 5000,
                    "signal_quality": 90, "orientation": {"type": "MAV_SENSOR_ROTATION_NONE"}}),
        )
    } else if first.contains("VFR_HUD") {
        Some(json!({"alt": -2.5, "type": "VFR_HUD"}))
    } else {
        let name = ["L", "i", "g", "h", "t", "s", "1", "\u{0}", "\u{0}", "\u{0}"];
        Some(json!({"name": name, "value": autopilot.light, "type": "NAMED_VALUE_FLOAT"}))
    };
    let text = message.map_or_else(String::new, |message| {
        let status = json!({"time": {"counter": autopilot.counter, "frequency": 10.0}});
        json!({"message": message, "status": status}).to_string()
    });
    let length = text.len();
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{text}"
    )
}

fn fake_autopilot() -> (String, Arc<Mutex<Autopilot>>) {
    let (listener, address) = listener();
    let autopilot = Arc::new(Mutex::new(Autopilot {
        light: 0.2,
        ..Autopilot::default()
    }));
    let shared = Arc::clone(&autopilot);
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let _ = answer(stream.unwrap(), &shared);
        }
    });
    (address, autopilot)
}

#[test]
fn an_autopilot_feeds_what_is_new_and_is_left_alone_by_default() {
    let linked = Linked::new();
    let (address, autopilot) = fake_autopilot();
    let config = MavlinkConfig {
        address,
        rate_hz: 50.0,
        ..MavlinkConfig::default()
    };
    linked.runtime.spawn(mavlink::run(config, linked.feeder()));
    // A message whose counter stands still may be from yesterday.
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(linked.service.feed().depth_m, None);
    autopilot.lock().unwrap().counter += 1;
    linked.wait_for("all is fed", |service| {
        let feed = service.feed();
        feed.depth_m.is_some_and(|reading| reading.value == 2.5)
            && feed
                .range
                .is_some_and(|reading| reading.value.distance_m == 1.4)
            && feed.light_pct.is_some_and(|reading| reading.value == 20.0)
    });
    linked.tell(&json!({"op": "state", "mean": [41.0, 88.0, 79.0], "std": [4.1, 7.7, 6.2]}));
    std::thread::sleep(Duration::from_millis(200));
    assert!(autopilot.lock().unwrap().commands.is_empty());
}

#[test]
fn an_autopilots_lamps_are_set_step_by_step_when_configured() {
    let linked = Linked::new();
    let (address, autopilot) = fake_autopilot();
    let config = MavlinkConfig {
        address,
        rate_hz: 20.0,
        lamps: Lamps::Servo(9),
        ..MavlinkConfig::default()
    };
    linked.runtime.spawn(mavlink::run(config, linked.feeder()));
    linked.tell(&with(json!({"op": "state"})));
    linked.wait_for("the lamps are set", |_| {
        let mut autopilot = autopilot.lock().unwrap();
        autopilot.counter += 1;
        autopilot.commands.len() > 5
    });
    let commands = autopilot.lock().unwrap().commands.clone();
    let mut before = None;
    for command in &commands {
        let message = &command["message"];
        assert_eq!(message["command"]["type"], "MAV_CMD_DO_SET_SERVO");
        assert_eq!(
            (&message["param1"], &message["target_system"]),
            (&json!(9.0), &json!(1))
        );
        let pulse_us = message["param2"].as_f64().unwrap();
        assert!((1100.0..=1900.0).contains(&pulse_us));
        // At 10 % a second a step of a few hundredths of a second is some 10 us; a loaded machine is slower.
        let step = pulse_us - before.unwrap_or(pulse_us);
        assert!(step.abs() < 80.0, "{step} us in one step");
        before = Some(pulse_us);
    }
}

#[test]
fn ros_calls_the_service_and_gets_the_reply() {
    let linked = Linked::new();
    let (bridge, address) = listener();
    bridge.set_nonblocking(true).unwrap();
    let config = RosbridgeConfig {
        address,
        service: "/uwguide/suggest".to_owned(),
        service_type: "example/srv/Json".to_owned(),
        pauses: SOON,
    };
    linked
        .runtime
        .spawn(rosbridge::run(config, linked.feeder()));
    let mut question = suggest();
    question.as_object_mut().unwrap().remove("op");
    let calls = [
        json!({"op": "call_service", "id": "c1", "service": "/uwguide/suggest",
               "args": {"data": question.to_string()}}),
        json!({"op": "call_service", "id": "c0", "service": "/other", "args": {}}),
        json!({"op": "call_service", "id": "c2", "service": "/uwguide/suggest", "args": {}}),
        json!({"op": "call_service", "id": "c3", "service": "/uwguide/suggest", "args": {"data": "x"}}),
    ];
    let exchange = async {
        let bridge = tokio::net::TcpListener::from_std(bridge).unwrap();
        // The bridge is restarted once.
        drop(bridge.accept().await.unwrap());
        let (stream, _): (_, SocketAddr) = bridge.accept().await.unwrap();
        let mut socket = tokio_tungstenite::accept_async(stream).await.unwrap();
        let mut heard = vec![next_text(&mut socket).await];
        socket.send(Message::text("rubbish")).await.unwrap();
        for call in &calls {
            socket.send(Message::text(call.to_string())).await.unwrap();
        }
        for _ in 0..3 {
            heard.push(next_text(&mut socket).await);
        }
        heard
    };
    let heard = linked
        .runtime
        .block_on(async { tokio::time::timeout(PATIENCE, exchange).await.unwrap() });
    let heard: Vec<Value> = heard
        .iter()
        .map(|text| serde_json::from_str(text).unwrap())
        .collect();
    assert_eq!(
        heard[0],
        json!({"op": "advertise_service", "service": "/uwguide/suggest",
                                "type": "example/srv/Json"})
    );
    let reply = |k: usize| -> Value {
        serde_json::from_str(heard[k]["values"]["message"].as_str().unwrap()).unwrap()
    };
    assert_eq!(
        (&heard[1]["id"], &heard[1]["values"]["success"]),
        (&json!("c1"), &json!(true))
    );
    assert_eq!(reply(1)["valid"], true);
    assert_eq!(
        (&heard[2]["id"], &heard[2]["values"]["success"]),
        (&json!("c2"), &json!(false))
    );
    assert_eq!(reply(2)["reason"], "missing_input");
    assert_eq!(reply(3)["error"]["code"], "unknown_field", "{}", reply(3));
}
