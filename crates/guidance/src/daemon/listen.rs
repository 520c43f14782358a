//! Where the daemon listens, and who may be there.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;
use tokio::net::{TcpListener, TcpStream};
#[cfg(unix)]
use tokio::net::{UnixListener, UnixStream};

use super::peers::Peer;

/// An address to listen on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// Host and port.
    Tcp(String),
    /// A Unix socket; written `unix:/run/uwguide/uwguide.sock`.
    Unix(PathBuf),
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(path) = text.strip_prefix("unix:") {
            return match path {
                "" => Err("the address must be unix:PATH, got unix: without a path".to_owned()),
                path => Ok(Self::Unix(path.into())),
            };
        }
        let expected = "the address must be HOST:PORT or unix:PATH";
        match text.rsplit_once(':') {
            Some((host, port)) if port.parse::<u16>().is_ok() => match host {
                "" => Err(format!(
                    "{expected}, got {text:?}; for this machine 127.0.0.1{text}"
                )),
                _ => Ok(Self::Tcp(text.to_owned())),
            },
            Some((_, port))
                if !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit()) =>
            {
                Err(format!(
                    "the port must be a whole number from 0 to 65535, got {port}"
                ))
            }
            None if text.parse::<u16>().is_ok() => Err(format!(
                "{expected}, got {text:?}; for this machine 127.0.0.1:{text}"
            )),
            _ => Err(format!("{expected}, such as 127.0.0.1:7475, got {text:?}")),
        }
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Tcp(address) => f.write_str(address),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

/// Why the daemon does not listen.
#[derive(Debug, Error)]
pub enum ListenError {
    /// The address cannot be had.
    #[error("cannot listen on {address}: {}", refusal(source))]
    Bind {
        /// The address.
        address: String,
        /// The system's answer.
        source: io::Error,
    },
    /// Others than this machine could connect, and nothing tells friend from foe.
    #[error(
        "{address} is reachable from other machines; configure security.token_file, or tls with client_ca, or listen on 127.0.0.1"
    )]
    Unguarded {
        /// The address bound.
        address: SocketAddr,
    },
}

/// The system's answer, and what to do about it.
fn refusal(error: &io::Error) -> String {
    let advice = match error.kind() {
        io::ErrorKind::AddrInUse => {
            "it is in use, very likely by another uwguide; end that one, or choose another address with \
             --listen (port 0 takes a free port)"
        }
        io::ErrorKind::PermissionDenied => {
            "not allowed; ports below 1024 are for the administrator, and a socket's folder must be writable"
        }
        io::ErrorKind::AddrNotAvailable => {
            "this machine has no such address; 127.0.0.1 is for this machine only, 0.0.0.0 for all networks"
        }
        _ => return error.to_string(),
    };
    format!("{advice} ({error})")
}

/// A bound socket.
#[derive(Debug)]
pub(super) enum Listener {
    Tcp(TcpListener),
    #[cfg(unix)]
    Unix(UnixListener, Option<SocketFile>),
}

/// Takes the socket's file away with the listener.
#[derive(Debug)]
pub(super) struct SocketFile(PathBuf);

impl Drop for SocketFile {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A connection accepted.
pub(super) enum Stream {
    Tcp(TcpStream),
    #[cfg(unix)]
    Unix(UnixStream),
}

impl Listener {
    /// Binds; port 0 takes a free one. TCP beyond this machine needs a guard: a token, or client
    /// certificates.
    pub async fn bind(address: &Address, guarded: bool) -> Result<Self, ListenError> {
        let failed = |source| ListenError::Bind {
            address: address.to_string(),
            source,
        };
        match address {
            Address::Tcp(text) => {
                let listener = TcpListener::bind(text).await.map_err(failed)?;
                Self::tcp(listener, guarded, address)
            }
            #[cfg(unix)]
            Address::Unix(path) => bind_unix(path).map_err(failed),
            #[cfg(not(unix))]
            Address::Unix(_) => Err(failed(io::Error::from(io::ErrorKind::Unsupported))),
        }
    }

    fn tcp(listener: TcpListener, guarded: bool, address: &Address) -> Result<Self, ListenError> {
        let bound = listener.local_addr().map_err(|source| ListenError::Bind {
            address: address.to_string(),
            source,
        })?;
        if bound.ip().is_loopback() || guarded {
            Ok(Self::Tcp(listener))
        } else {
            Err(ListenError::Unguarded { address: bound })
        }
    }

    /// Sockets that the service manager hands over (socket activation); none without one.
    pub fn activated(guarded: bool) -> Result<Vec<Self>, ListenError> {
        let mut handed = listenfd::ListenFd::from_env();
        let mut listeners = Vec::new();
        for k in 0..handed.len() {
            let name = Address::Tcp(format!("activated socket {k}"));
            let failed = |source| ListenError::Bind {
                address: name.to_string(),
                source,
            };
            #[cfg(unix)]
            if let Ok(Some(unix)) = handed.take_unix_listener(k) {
                unix.set_nonblocking(true).map_err(failed)?;
                let listener = UnixListener::from_std(unix).map_err(failed)?;
                listeners.push(Self::Unix(listener, None));
                continue;
            }
            if let Some(tcp) = handed.take_tcp_listener(k).map_err(failed)? {
                tcp.set_nonblocking(true).map_err(failed)?;
                let listener = TcpListener::from_std(tcp).map_err(failed)?;
                listeners.push(Self::tcp(listener, guarded, &name)?);
            }
        }
        Ok(listeners)
    }

    pub async fn accept(&self) -> io::Result<(Stream, Peer)> {
        match self {
            Self::Tcp(listener) => {
                let (stream, address) = listener.accept().await?;
                // Without this a small reply may wait for the acknowledgement of the one before.
                let _ = stream.set_nodelay(true);
                Ok((Stream::Tcp(stream), Peer::tcp(address)))
            }
            #[cfg(unix)]
            Self::Unix(listener, _) => {
                let (stream, _) = listener.accept().await?;
                let peer = Peer::unix(&stream);
                Ok((Stream::Unix(stream), peer))
            }
        }
    }

    /// The address bound, for TCP.
    pub fn local_addr(&self) -> Option<SocketAddr> {
        match self {
            Self::Tcp(listener) => listener.local_addr().ok(),
            #[cfg(unix)]
            Self::Unix(..) => None,
        }
    }
}

impl std::fmt::Display for Listener {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Tcp(listener) => match listener.local_addr() {
                Ok(address) => address.fmt(f),
                Err(_) => f.write_str("a TCP socket"),
            },
            #[cfg(unix)]
            Self::Unix(_, Some(SocketFile(path))) => write!(f, "unix:{}", path.display()),
            #[cfg(unix)]
            Self::Unix(_, None) => f.write_str("an activated Unix socket"),
        }
    }
}

/// A socket file left by a daemon that was killed is replaced; one that answers is not. Only the daemon's
/// own user may connect.
#[cfg(unix)]
fn bind_unix(path: &std::path::Path) -> io::Result<Listener> {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    let left = std::fs::symlink_metadata(path).is_ok_and(|meta| meta.file_type().is_socket());
    if left {
        if std::os::unix::net::UnixStream::connect(path).is_ok() {
            return Err(io::Error::from(io::ErrorKind::AddrInUse));
        }
        std::fs::remove_file(path)?;
    }
    let listener = UnixListener::bind(path)?;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
    Ok(Listener::Unix(listener, Some(SocketFile(path.into()))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_or_refused() {
        let tcp = |text: &str| Ok(Address::Tcp(text.to_owned()));
        assert_eq!("127.0.0.1:7475".parse(), tcp("127.0.0.1:7475"));
        assert_eq!("[::1]:0".parse(), tcp("[::1]:0"));
        assert_eq!("unix:/run/x".parse(), Ok(Address::Unix("/run/x".into())));
        for text in ["7475", "localhost", ":7475", "host:99999", "unix:"] {
            assert!(text.parse::<Address>().is_err(), "{text}");
        }
        let message = |text: &str| text.parse::<Address>().unwrap_err();
        assert!(message("127.0.0.1:99999").contains("0 to 65535, got 99999"));
        assert!(message("7475").contains("for this machine 127.0.0.1:7475"));
        assert!(message(":7475").contains("for this machine 127.0.0.1:7475"));
    }
}
