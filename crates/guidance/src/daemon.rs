//! The service over TCP: accepting, limits, shutting down.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::Value;
use tokio::io::{AsyncWriteExt, BufReader};
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{oneshot, watch};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use crate::service::{Answered, Service, Session};
use crate::wire::frame::{Frame, Lines};
use crate::wire::reply::{self, Code, WireError};

/// How long a client may take to accept a reply, so that one that never reads cannot hold a place for good.
const WRITE_TIME: Duration = Duration::from_secs(10);
/// How long requests under way may take to end after a shutdown was asked for.
const GRACE: Duration = Duration::from_secs(2);
/// Pause after a failed accept (such as too many open files), so that it does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// What connections may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Connections at one time; a vehicle has a handful of clients, each may hold a line of 1 MiB.
    pub max_connections: usize,
    /// A connection that sends no complete line for this long is closed; guidance is asked once a second
    /// or more often, and a dead link should not hold its place for hours.
    pub idle_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_connections: 64,
            idle_time: Duration::from_secs(300),
        }
    }
}

/// A bound socket, ready to serve.
#[derive(Debug)]
pub struct Daemon {
    listener: TcpListener,
    service: Arc<Service>,
    limits: Limits,
}

impl Daemon {
    /// Binds an address such as `127.0.0.1:7475`; port 0 takes a free one.
    pub async fn bind(address: &str, service: Service, limits: Limits) -> io::Result<Self> {
        let listener = TcpListener::bind(address).await?;
        Ok(Self {
            listener,
            service: Arc::new(service),
            limits,
        })
    }

    /// The address bound.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Serves until `shutdown` is done; then requests under way are answered and connections closed.
    pub async fn run(self, shutdown: impl Future<Output = ()>) {
        let (stop, stopping) = watch::channel(false);
        let mut connections = JoinSet::new();
        tokio::pin!(shutdown);
        loop {
            tokio::select! {
                () = &mut shutdown => break,
                Some(_) = connections.join_next() => {}
                accepted = self.listener.accept() => match accepted {
                    Ok((stream, _)) if connections.len() < self.limits.max_connections => {
                        let session = Session::new(Arc::clone(&self.service));
                        connections.spawn(serve(stream, session, self.limits, stopping.clone()));
                    }
                    Ok((stream, _)) => {
                        tokio::spawn(refuse(stream, self.limits.max_connections));
                    }
                    Err(_) => sleep(ACCEPT_PAUSE).await,
                },
            }
        }
        stop.send_replace(true);
        let all_ended = async { while connections.join_next().await.is_some() {} };
        if timeout(GRACE, all_ended).await.is_err() {
            connections.abort_all();
        }
    }
}

/// A daemon that runs on threads of its own.
#[derive(Debug)]
pub struct Running {
    local_addr: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// The address bound.
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Stops serving and waits until the daemon has ended; dropping does the same.
    pub fn shutdown(self) {}
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // An error means that the daemon has ended already.
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has been printed by then.
            let _ = thread.join();
        }
    }
}

/// Starts a daemon on a thread of its own, for programs without an asynchronous runtime.
pub fn spawn(address: &str, service: Service, limits: Limits) -> io::Result<Running> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let daemon = runtime.block_on(Daemon::bind(address, service, limits))?;
    let local_addr = daemon.local_addr()?;
    let (stop, stopped) = oneshot::channel::<()>();
    let thread = std::thread::Builder::new()
        .name("uwguide".to_owned())
        .spawn(move || {
            runtime.block_on(daemon.run(async {
                // A dropped handle stops the daemon as well.
                let _ = stopped.await;
            }));
        })?;
    Ok(Running {
        local_addr,
        stop: Some(stop),
        thread: Some(thread),
    })
}

/// Answers one connection, line by line and in order.
async fn serve(
    stream: TcpStream,
    mut session: Session,
    limits: Limits,
    mut stopping: watch::Receiver<bool>,
) {
    // Without this a small reply may wait for the acknowledgement of the one before.
    let _ = stream.set_nodelay(true);
    let (reader, mut writer) = stream.into_split();
    let mut lines = Lines::new(BufReader::new(reader));
    loop {
        let frame = tokio::select! {
            _ = stopping.wait_for(|stop| *stop) => return,
            frame = timeout(limits.idle_time, lines.next()) => frame,
        };
        let reply = match frame {
            Ok(Ok(Frame::Line(line))) => answer(&mut session, line).await,
            Ok(Ok(Frame::TooLong)) => finish(&session, session.line_too_long(), 0),
            Ok(Ok(Frame::End) | Err(_)) => return,
            Err(_) => {
                let seconds = limits.idle_time.as_secs_f64();
                let message = format!("no complete line came for {seconds} s; closing");
                write(&mut writer, farewell(Code::Idle, message)).await;
                return;
            }
        };
        if !write(&mut writer, reply).await {
            return;
        }
    }
}

async fn answer(session: &mut Session, line: Vec<u8>) -> String {
    let pending = session.read(&line);
    let (now, started) = (session.service().now(), std::time::Instant::now());
    let answered = if pending.is_slow() {
        let mut own = session.clone();
        match tokio::task::spawn_blocking(move || own.answer(pending, now)).await {
            Ok(answered) => answered,
            Err(_) => {
                let message = "the image could not be processed".to_owned();
                return farewell(Code::Internal, message);
            }
        }
    } else {
        session.answer(pending, now)
    };
    let elapsed_us = u64::try_from(started.elapsed().as_micros()).unwrap_or(u64::MAX);
    finish(session, answered, elapsed_us)
}

/// Counts the answer and makes it a line.
fn finish(session: &Session, answered: Answered, elapsed_us: u64) -> String {
    let metrics = session.service().metrics();
    metrics.answered(
        answered.op,
        answered.fault(),
        answered.is_error(),
        elapsed_us,
    );
    answered.line(elapsed_us)
}

/// Whether the client took the line.
async fn write(writer: &mut OwnedWriteHalf, mut line: String) -> bool {
    line.push('\n');
    matches!(
        timeout(WRITE_TIME, writer.write_all(line.as_bytes())).await,
        Ok(Ok(()))
    )
}

async fn refuse(stream: TcpStream, max_connections: usize) {
    let (mut reader, mut writer) = stream.into_split();
    let message = format!("all {max_connections} connections are taken; closing");
    if write(&mut writer, farewell(Code::Busy, message)).await && writer.shutdown().await.is_ok() {
        // Closing with bytes unread would reset the connection and could lose the message on its way.
        let _ = timeout(GRACE, tokio::io::copy(&mut reader, &mut tokio::io::sink())).await;
    }
}

fn farewell(code: Code, message: String) -> String {
    reply::line(&Value::Null, Err(WireError::new(code, message)))
}
