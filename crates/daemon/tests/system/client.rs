//! A client that speaks raw bytes, and the daemon it speaks to.

use std::io::Write;
use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde_json::{Value, json};
use uw_guidance::service::{Loaded, Settings};
use uw_guidance::{Limits, Model, Objective, Running, Service, spawn};

use crate::support::{Numbers, profile};

/// How long a reply may take before a test fails.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);
/// The model of the tests.
pub(crate) const MODEL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../guidance/tests/data/mlp_a.json"
);

/// The service of the tests, all by default.
pub(crate) fn service() -> Service {
    let model = Model::read(MODEL.as_ref()).unwrap();
    Service::new(
        model,
        "mlp_a",
        profile(&mut Numbers::new(3)),
        Objective::default(),
    )
}

/// The same with settings of its own, with or without a profile.
pub(crate) fn service_with(settings: Settings, with_profile: bool) -> Service {
    let loaded = Loaded {
        basis: Model::read(MODEL.as_ref()).unwrap().into(),
        model_name: "mlp_a".to_owned(),
        model_digest: String::new(),
        profile: with_profile.then(|| profile(&mut Numbers::new(3)).into()),
    };
    Service::with_settings(loaded, settings)
}

pub(crate) fn start(limits: Limits) -> Running {
    spawn("127.0.0.1:0", service(), limits).unwrap()
}

pub(crate) struct Client {
    pub(crate) stream: TcpStream,
    pub(crate) reader: BufReader<TcpStream>,
}

impl Client {
    pub(crate) fn connect(daemon: &Running) -> Self {
        Self::to(daemon.local_addr())
    }

    pub(crate) fn to(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self {
            reader: BufReader::new(stream.try_clone().unwrap()),
            stream,
        }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).unwrap();
    }

    pub(crate) fn receive(&mut self) -> Value {
        let mut line = String::new();
        assert_ne!(
            self.reader.read_line(&mut line).unwrap(),
            0,
            "the connection was closed"
        );
        serde_json::from_str(&line).unwrap()
    }

    pub(crate) fn ask(&mut self, request: &Value) -> Value {
        self.send(format!("{request}\n").as_bytes());
        self.receive()
    }

    /// The error object of the reply, which has to be one.
    pub(crate) fn refused(&mut self, request: &Value) -> Value {
        let reply = self.ask(request);
        assert_eq!(reply["ok"], false, "{request} -> {reply}");
        reply["error"].clone()
    }
}

/// A request with everything in it.
pub(crate) fn suggest() -> Value {
    json!({"op": "suggest", "id": 7, "depth_m": 3.0, "distance_m": 1.0, "light_pct": 20.0,
           "mean": [41.0, 88.0, 79.0], "std": [4.1, 7.7, 6.2]})
}

/// The same with other fields over it.
pub(crate) fn with(fields: Value) -> Value {
    let mut request = suggest();
    for (name, value) in fields.as_object().unwrap() {
        request[name] = value.clone();
    }
    request
}

/// The same without some fields.
pub(crate) fn without(names: &[&str]) -> Value {
    let mut request = suggest();
    request
        .as_object_mut()
        .unwrap()
        .retain(|name, _| !names.contains(&name.as_str()));
    request
}
