//! The service on sockets: accepting, limits, shutting down.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

mod connection;
mod limits;
mod listen;
mod peers;
mod running;
mod tokens;

use crate::operations::throttle::Throttle;
use crate::record::Recorder;
use crate::service::{Service, Session};
use crate::wire::reply::Code;
use connection::{Context, farewell, serve};
pub use limits::Limits;
pub use listen::{Address, ListenError};
use listen::{Listener, Stream};
use peers::{Peer, Share, Shares};
pub use running::{Running, spawn};
use tokens::Tokens;

/// How long requests under way may take to end after a shutdown was asked for.
const GRACE: Duration = Duration::from_secs(5);
/// Pause after a failed accept (such as too many open files), so that it does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// How long a TLS handshake may take.
const HANDSHAKE_TIME: Duration = Duration::from_secs(10);
/// How long a refused client is given to read why.
const REFUSAL_TIME: Duration = Duration::from_secs(1);
/// Clients that are told why they are refused at one time; more are closed without a word.
const MAX_REFUSALS: usize = 32;
/// Images decoded at one time; each may take 512 MiB.
const MAX_IMAGES: usize = 2;

/// Bound sockets, ready to serve.
#[derive(Debug)]
pub struct Daemon {
    listeners: Vec<Listener>,
    server: Server,
}

/// What all listeners share.
#[derive(Clone)]
struct Server {
    service: Arc<Service>,
    limits: Limits,
    tls: Option<Arc<dyn Encryption>>,
    client_certificates: bool,
    recorder: Option<Recorder>,
    slots: Arc<Semaphore>,
    shares: Arc<Shares>,
    tokens: Arc<Tokens>,
    /// Warnings of peers that speak other protocols, and of failed accepts.
    foreign_log: Arc<Throttle>,
    accept_log: Arc<Throttle>,
    refusals: Arc<Semaphore>,
    slow: Arc<Semaphore>,
    numbers: Arc<AtomicU64>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Server")
            .field("limits", &self.limits)
            .field("tls", &self.tls.is_some())
            .finish_non_exhaustive()
    }
}

impl Daemon {
    /// Binds an address such as `127.0.0.1:7475`; port 0 takes a free one.
    pub async fn bind(address: &str, service: Service, limits: Limits) -> io::Result<Self> {
        let address: Address = address
            .parse()
            .map_err(|message| io::Error::new(io::ErrorKind::InvalidInput, message))?;
        let mut daemon = Self::new(Arc::new(service), limits);
        daemon.listen(&address).await.map_err(|error| match error {
            ListenError::Bind { source, .. } => source,
            other => io::Error::new(io::ErrorKind::PermissionDenied, other),
        })?;
        Ok(daemon)
    }

    /// A daemon that listens nowhere yet.
    pub fn new(service: Arc<Service>, limits: Limits) -> Self {
        let server = Server {
            service,
            slots: Arc::new(Semaphore::new(limits.max_connections)),
            limits,
            tls: None,
            client_certificates: false,
            recorder: None,
            shares: Arc::default(),
            tokens: Arc::default(),
            foreign_log: Arc::default(),
            accept_log: Arc::default(),
            refusals: Arc::new(Semaphore::new(MAX_REFUSALS)),
            slow: Arc::new(Semaphore::new(MAX_IMAGES)),
            numbers: Arc::new(AtomicU64::new(0)),
        };
        Self {
            listeners: Vec::new(),
            server,
        }
    }

    /// Encrypts TCP connections; `client_certificates` tells whether the acceptor asks clients for theirs.
    pub fn with_tls(mut self, tls: Arc<dyn Encryption>, client_certificates: bool) -> Self {
        self.server.tls = Some(tls);
        self.server.client_certificates = client_certificates;
        self
    }

    /// Records requests and replies.
    pub fn with_recorder(mut self, recorder: Recorder) -> Self {
        self.server.recorder = Some(recorder);
        self
    }

    /// Listens on one more address. Beyond this machine a token is needed, or TLS with client certificates.
    pub async fn listen(&mut self, address: &Address) -> Result<(), ListenError> {
        let listener = Listener::bind(address, self.guarded()).await?;
        self.listeners.push(listener);
        Ok(())
    }

    /// Listens on the sockets that the service manager hands over; how many there are.
    pub fn listen_activated(&mut self) -> Result<usize, ListenError> {
        let handed = Listener::activated(self.guarded())?;
        let count = handed.len();
        self.listeners.extend(handed);
        Ok(count)
    }

    fn guarded(&self) -> bool {
        self.server.client_certificates || self.server.service.settings().token.is_some()
    }

    /// The first TCP address bound.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listeners
            .iter()
            .find_map(Listener::local_addr)
            .ok_or_else(|| io::Error::from(io::ErrorKind::AddrNotAvailable))
    }

    /// TCP addresses bound that other machines reach and at which nothing is encrypted.
    pub fn unencrypted(&self) -> Vec<SocketAddr> {
        let bound = self.listeners.iter().filter_map(Listener::local_addr);
        bound
            .filter(|address| self.server.tls.is_none() && !address.ip().is_loopback())
            .collect()
    }

    /// Where it listens, for people.
    pub fn addresses(&self) -> Vec<String> {
        self.listeners.iter().map(Listener::to_string).collect()
    }

    /// Serves until `shutdown` is done; then requests under way are answered and connections closed.
    pub async fn run(self, shutdown: impl Future<Output = ()>) {
        let (stop, stopping) = watch::channel(false);
        let mut accepting = JoinSet::new();
        for listener in self.listeners {
            accepting.spawn(self.server.clone().accept(listener, stopping.clone()));
        }
        shutdown.await;
        stop.send_replace(true);
        while accepting.join_next().await.is_some() {}
    }

    /// Serves one peer on streams such as standard input and output, until it ends or `shutdown` is done.
    pub async fn serve_streams<R, W>(self, reader: R, writer: W, shutdown: impl Future<Output = ()>)
    where
        R: AsyncRead + Unpin,
        W: AsyncWrite + Unpin,
    {
        let (stop, stopping) = watch::channel(false);
        let session = Session::trusted(Arc::clone(&self.server.service));
        let mut context = self
            .server
            .context(stopping, Peer::unknown("standard streams"));
        // There is no place here that somebody else could want.
        context.limits.first_line_time = context.limits.idle_time;
        let served = serve(reader, writer, session, context);
        tokio::pin!(served);
        tokio::select! {
            () = &mut served => {}
            () = shutdown => {
                stop.send_replace(true);
                // A read that never ends keeps nobody waiting.
                let _ = timeout(GRACE, served).await;
            }
        }
    }
}

impl Server {
    fn context(&self, stopping: watch::Receiver<bool>, peer: Peer) -> Context {
        Context {
            limits: self.limits,
            stopping,
            peer,
            tokens: Arc::clone(&self.tokens),
            foreign_log: Arc::clone(&self.foreign_log),
            slow: Arc::clone(&self.slow),
            recorder: self.recorder.clone(),
            number: self.numbers.fetch_add(1, Ordering::Relaxed) + 1,
        }
    }

    async fn accept(self, listener: Listener, mut stopping: watch::Receiver<bool>) {
        let mut connections = JoinSet::new();
        let for_connections = stopping.clone();
        loop {
            tokio::select! {
                () = stopped(&mut stopping) => break,
                Some(_) = connections.join_next() => {}
                accepted = listener.accept() => match accepted {
                    Ok((stream, peer)) => match self.slot(&peer) {
                        Ok(slot) => {
                            let context = self.context(for_connections.clone(), peer);
                            connections.spawn(self.clone().connection(stream, slot, context));
                        }
                        Err(message) => self.turn_away(stream, message),
                    },
                    Err(error) => {
                        if let Some(more) = self.accept_log.take(Instant::now()) {
                            tracing::warn!(%error, not_logged = more, "accepting failed");
                        }
                        sleep(ACCEPT_PAUSE).await;
                    }
                },
            }
        }
        drop(listener);
        let all_ended = async { while connections.join_next().await.is_some() {} };
        if timeout(GRACE, all_ended).await.is_err() {
            tracing::warn!("connections did not end in time and are cut");
            connections.abort_all();
        }
    }

    /// A slot for a peer, or why there is none.
    fn slot(&self, peer: &Peer) -> Result<ConnectionPermit, String> {
        let Limits {
            max_connections,
            max_connections_per_address: most,
            ..
        } = self.limits;
        let share = self.shares.take(peer.origin, most).ok_or_else(|| {
            format!(
                "all {most} connections of {} are taken; closing",
                peer.origin
            )
        })?;
        match Arc::clone(&self.slots).try_acquire_owned() {
            Ok(permit) => Ok(ConnectionPermit(permit, share)),
            Err(_) => Err(format!(
                "all {max_connections} connections are taken; closing"
            )),
        }
    }

    async fn connection(self, stream: Stream, _slot: ConnectionPermit, context: Context) {
        tracing::debug!(connection = context.number, "accepted");
        let service = Arc::clone(&self.service);
        match (stream, &self.tls) {
            (Stream::Tcp(stream), None) => {
                let (reader, writer) = stream.into_split();
                serve(reader, writer, Session::new(service), context).await;
            }
            (Stream::Tcp(stream), Some(tls)) => {
                match timeout(HANDSHAKE_TIME, tls.accept(stream)).await {
                    Ok(Ok(stream)) => {
                        let (reader, writer) = tokio::io::split(stream);
                        serve(reader, writer, Session::new(service), context).await;
                    }
                    Ok(Err(error)) => tracing::info!(%error, "TLS handshake failed"),
                    Err(_) => tracing::info!("TLS handshake took too long"),
                }
            }
            #[cfg(unix)]
            (Stream::Unix(stream), _) => {
                let (reader, writer) = stream.into_split();
                serve(reader, writer, Session::trusted(service), context).await;
            }
        }
    }

    fn turn_away(&self, stream: Stream, message: String) {
        self.service.metrics().refused.count();
        let Ok(slot) = Arc::clone(&self.refusals).try_acquire_owned() else {
            return;
        };
        // Whoever speaks TLS would not understand a plain line.
        if self.tls.is_some() {
            return;
        }
        tokio::spawn(async move {
            let _slot = slot;
            match stream {
                Stream::Tcp(stream) => {
                    let (reader, writer) = stream.into_split();
                    refuse(reader, writer, message).await;
                }
                #[cfg(unix)]
                Stream::Unix(stream) => {
                    let (reader, writer) = stream.into_split();
                    refuse(reader, writer, message).await;
                }
            }
        });
    }
}

/// A connection that is read from and written to.
pub trait Duplex: AsyncRead + AsyncWrite + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Unpin> Duplex for T {}

/// An encrypted connection to be, or why there is none.
pub type Handshake = Pin<Box<dyn Future<Output = io::Result<Box<dyn Duplex>>> + Send>>;

/// What makes an encrypted connection of a plain one, by a handshake (TLS in `crates/daemon`).
pub trait Encryption: Send + Sync {
    /// The connection once the client has shown itself.
    fn accept(&self, plain: TcpStream) -> Handshake;
}

/// A slot among all connections and among those of one address, until it is dropped.
struct ConnectionPermit(
    #[expect(dead_code, reason = "held to be dropped")] OwnedSemaphorePermit,
    #[expect(dead_code, reason = "held to be dropped")] Share,
);

/// Done when the daemon is to stop.
async fn stopped(stopping: &mut watch::Receiver<bool>) {
    // An error means that the sender is gone, which is a stop as well.
    let _ = stopping.wait_for(|stop| *stop).await;
}

async fn refuse<R, W>(mut reader: R, mut writer: W, message: String)
where
    R: AsyncRead + Unpin,
    W: AsyncWrite + Unpin,
{
    let mut line = farewell(Code::Busy, message);
    line.push('\n');
    let told = async {
        writer.write_all(line.as_bytes()).await?;
        writer.shutdown().await?;
        // Closing with bytes unread would reset the connection and could lose the message on its way.
        tokio::io::copy(&mut reader, &mut tokio::io::sink()).await
    };
    let _ = timeout(REFUSAL_TIME, told).await;
}
