//! `/metrics`, `/healthz` and `/readyz` over HTTP on a port of their own.
//!
//! Just enough of HTTP/1.1 for Prometheus and for health checks: GET, one answer a connection.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

use crate::service::Service;

/// Longest head of a request, bytes.
const MAX_HEAD_BYTES: usize = 8192;
/// How long one exchange may take.
const EXCHANGE_TIME: Duration = Duration::from_secs(5);
/// Exchanges at one time.
const MAX_EXCHANGES: usize = 16;
/// Pause after a failed accept.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// A bound port for health checks.
#[derive(Debug)]
pub struct HealthPort {
    listener: TcpListener,
    service: Arc<Service>,
}

impl HealthPort {
    /// Binds a loopback address; the answers are for this machine only.
    pub async fn bind(address: &str, service: Arc<Service>) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        if !listener.local_addr()?.ip().is_loopback() {
            let message = "metrics are served on loopback addresses only";
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
        }
        Ok(Self { listener, service })
    }

    /// The address bound.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until the task is dropped; not ready while `stopping` holds true.
    pub async fn run(self, stopping: watch::Receiver<bool>) {
        let places = Arc::new(Semaphore::new(MAX_EXCHANGES));
        loop {
            let Ok((stream, _)) = self.listener.accept().await else {
                sleep(ACCEPT_PAUSE).await;
                continue;
            };
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                continue;
            };
            let (service, stopping) = (Arc::clone(&self.service), stopping.clone());
            tokio::spawn(async move {
                let _place = place;
                // A peer that is gone or too slow gets no answer.
                let _ = timeout(EXCHANGE_TIME, exchange(stream, &service, &stopping)).await;
            });
        }
    }
}

async fn exchange(
    mut stream: TcpStream,
    service: &Service,
    stopping: &watch::Receiver<bool>,
) -> io::Result<()> {
    let mut head = Vec::new();
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let mut part = [0; 1024];
        let count = stream.read(&mut part).await?;
        if count == 0 || head.len() + count > MAX_HEAD_BYTES {
            break;
        }
        head.extend_from_slice(&part[..count]);
    }
    let (status, body) = answer(&head, service, *stopping.borrow());
    let length = body.len();
    let reply = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n\
         Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    );
    stream.write_all(reply.as_bytes()).await?;
    stream.shutdown().await
}

/// Status line and body for the head of a request.
fn answer(head: &[u8], service: &Service, stopping: bool) -> (&'static str, String) {
    let first = head.split(|&byte| byte == b'\r').next().unwrap_or_default();
    let mut words = first.split(|&byte| byte == b' ');
    let (method, target) = (words.next(), words.next().unwrap_or_default());
    if method != Some(b"GET") {
        return ("405 Method Not Allowed", "only GET\n".to_owned());
    }
    let path = target.split(|&byte| byte == b'?').next();
    match path.unwrap_or_default() {
        b"/metrics" => (
            "200 OK",
            service.metrics().text(service.now().since_start_s),
        ),
        b"/healthz" => ("200 OK", "ok\n".to_owned()),
        b"/readyz" if stopping => ("503 Service Unavailable", "stopping\n".to_owned()),
        b"/readyz" if service.loaded().profile.is_none() => {
            ("503 Service Unavailable", "no profile\n".to_owned())
        }
        b"/readyz" => ("200 OK", "ready\n".to_owned()),
        _ => (
            "404 Not Found",
            "there are /metrics, /healthz and /readyz\n".to_owned(),
        ),
    }
}
