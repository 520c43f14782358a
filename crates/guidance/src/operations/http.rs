//! `/metrics`, `/healthz` and `/readyz` over HTTP on a port of their own.
//!
//! Just enough of HTTP/1.1 for Prometheus and for health checks: GET, one answer a connection. A web page
//! whose name was made to point at this machine is told from them by the name in `Host`.

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

use crate::service::Service;

/// Longest head of a request, bytes.
const MAX_HEAD_BYTES: usize = 8192;
/// How long one exchange may take.
const EXCHANGE_TIME: Duration = Duration::from_secs(2);
/// Exchanges at one time; the oldest makes room for one more, as those that are answered end at once.
const MAX_EXCHANGES: usize = 64;
/// Pause after a failed accept.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What the port answers from.
#[derive(Debug)]
pub struct Answers {
    service: Arc<Service>,
    /// Names for which it answers beside those of this machine, in small letters.
    hosts: Vec<String>,
    stopping: watch::Receiver<bool>,
}

/// A bound port for health checks.
#[derive(Debug)]
pub struct HealthPort {
    listener: TcpListener,
}

impl HealthPort {
    /// Binds a loopback address; the answers are for this machine only.
    pub async fn bind(address: &str) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        if !listener.local_addr()?.ip().is_loopback() {
            let message = "metrics are served on loopback addresses only";
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        }
        Ok(Self { listener })
    }

    /// The address bound.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until the task is dropped.
    pub async fn run(self, answers: Answers) {
        let answers = Arc::new(answers);
        let mut exchanges: VecDeque<AbortHandle> = VecDeque::new();
        loop {
            let Ok((stream, _)) = self.listener.accept().await else {
                sleep(ACCEPT_PAUSE).await;
                continue;
            };
            exchanges.retain(|exchange| !exchange.is_finished());
            if exchanges.len() >= MAX_EXCHANGES
                && let Some(oldest) = exchanges.pop_front()
            {
                oldest.abort();
            }
            let answers = Arc::clone(&answers);
            let exchange = tokio::spawn(async move {
                // A peer that is gone or too slow gets no answer.
                let _ = timeout(EXCHANGE_TIME, exchange(stream, &answers)).await;
            });
            exchanges.push_back(exchange.abort_handle());
        }
    }
}

async fn exchange(mut stream: TcpStream, answers: &Answers) -> io::Result<()> {
    let mut head = Vec::new();
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let mut part = [0; 1024];
        let count = stream.read(&mut part).await?;
        if count == 0 || head.len() + count > MAX_HEAD_BYTES {
            break;
        }
        head.extend_from_slice(&part[..count]);
    }
    stream.write_all(answers.reply(&head).as_bytes()).await?;
    stream.shutdown().await
}

impl Answers {
    /// Answers from a service, for the names of this machine and for `hosts`; not ready while `stopping`
    /// holds true.
    pub fn new(service: Arc<Service>, hosts: &[String], stopping: watch::Receiver<bool>) -> Self {
        Self {
            service,
            hosts: hosts.iter().map(|host| bare(host)).collect(),
            stopping,
        }
    }

    /// The whole reply to the head of a request, whatever it is.
    pub fn reply(&self, head: &[u8]) -> String {
        let (status, body) = self.answer(&String::from_utf8_lossy(head));
        let length = body.len();
        format!(
            "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n\
             Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        )
    }

    /// Status and body.
    fn answer(&self, head: &str) -> (&'static str, String) {
        let mut lines = head.split("\r\n");
        let mut words = lines.next().unwrap_or_default().split(' ');
        let (method, target, version) = (words.next(), words.next(), words.next());
        if method != Some("GET") {
            return ("405 Method Not Allowed", "only GET\n".to_owned());
        }
        let named: Vec<&str> = lines
            .take_while(|line| !line.is_empty())
            .filter_map(host)
            .collect();
        match named[..] {
            [host] if self.is_own(host) => {}
            [_] => {
                let message = "this name is not served; operations.metrics_hosts adds names\n";
                return ("421 Misdirected Request", message.to_owned());
            }
            // Browsers always send it, some health checks do not.
            [] if version == Some("HTTP/1.0") => {}
            _ => return ("400 Bad Request", "Host must be given once\n".to_owned()),
        }
        let path = target.unwrap_or_default().split('?').next();
        self.page(path.unwrap_or_default())
    }

    fn page(&self, path: &str) -> (&'static str, String) {
        let service = &self.service;
        let metrics = || service.metrics().text(service.now().since_start_s);
        let (status, body) = match path {
            "/metrics" => return ("200 OK", metrics()),
            "/healthz" if service.is_well() => ("200 OK", "ok\n"),
            // The old model answers: starting again would be worse.
            "/healthz" => ("200 OK", "degraded: the last reload was refused\n"),
            "/readyz" if *self.stopping.borrow() => ("503 Service Unavailable", "stopping\n"),
            "/readyz" if service.lacks_profile() => ("503 Service Unavailable", "no profile\n"),
            "/readyz" => ("200 OK", "ready\n"),
            _ => (
                "404 Not Found",
                "there are /metrics, /healthz and /readyz\n",
            ),
        };
        (status, body.to_owned())
    }

    /// Whether a name is one of this machine, with or without a port.
    fn is_own(&self, host: &str) -> bool {
        let name = bare(host);
        let address = name.trim_start_matches('[').trim_end_matches(']');
        let is_loopback = address.parse().is_ok_and(|ip: IpAddr| ip.is_loopback());
        is_loopback || name == "localhost" || self.hosts.contains(&name)
    }
}

/// The value of a `Host` line.
fn host(line: &str) -> Option<&str> {
    let (name, value) = line.split_once(':')?;
    name.eq_ignore_ascii_case("host").then_some(value.trim())
}

/// A name in small letters, without port and without the dot at its end.
fn bare(host: &str) -> String {
    let is_port = |port: &str| port.bytes().all(|byte| byte.is_ascii_digit());
    let name = match host.rsplit_once(':') {
        Some((name, port)) if is_port(port) && (!name.contains(':') || name.ends_with(']')) => name,
        _ => host,
    };
    name.strip_suffix('.').unwrap_or(name).to_ascii_lowercase()
}
