//! Who is on the other side, and how many slots one address holds.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};

/// What counts as one address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Origin {
    /// An IPv4 address, or an IPv6 network of 64 bits, as one machine can have all addresses of it.
    Ip(IpAddr),
    /// A user on the other side of a Unix socket.
    User(u32),
    /// Standard streams, or a socket that does not tell.
    Unknown,
}

/// The other side of a connection.
#[derive(Clone, Debug)]
pub(super) struct Peer {
    pub origin: Origin,
    /// For logs: address and port, or the user.
    pub name: String,
}

impl Peer {
    pub fn unknown(name: &str) -> Self {
        Self {
            origin: Origin::Unknown,
            name: name.to_owned(),
        }
    }

    pub fn tcp(address: SocketAddr) -> Self {
        Self {
            origin: Origin::Ip(network(address.ip())),
            name: address.to_string(),
        }
    }

    #[cfg(unix)]
    pub fn unix(stream: &tokio::net::UnixStream) -> Self {
        match stream.peer_cred() {
            Ok(owner) => Self {
                origin: Origin::User(owner.uid()),
                name: format!("user {}", owner.uid()),
            },
            Err(_) => Self::unknown("a Unix socket"),
        }
    }
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Ip(address @ IpAddr::V6(v6)) if !v6.is_loopback() => write!(f, "{address}/64"),
            Self::Ip(address) => address.fmt(f),
            Self::User(id) => write!(f, "user {id}"),
            Self::Unknown => f.write_str("this peer"),
        }
    }
}

fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) if !v6.is_loopback() => {
            let network = v6.to_bits() >> 64 << 64;
            Ipv6Addr::from_bits(network).into()
        }
        other => other,
    }
}

/// Places held by origin.
#[derive(Debug, Default)]
pub(super) struct Shares(Mutex<HashMap<Origin, usize>>);

/// One slot of an origin's share, given back when dropped.
#[derive(Debug)]
pub(super) struct Share {
    shares: Arc<Shares>,
    origin: Origin,
}

impl Shares {
    /// A slot, unless the origin holds `most` already.
    pub fn take(self: &Arc<Self>, origin: Origin, most: usize) -> Option<Share> {
        let mut held = self.lock();
        let count = held.get(&origin).copied().unwrap_or(0);
        if count >= most {
            return None;
        }
        held.insert(origin, count + 1);
        Some(Share {
            shares: Arc::clone(self),
            origin,
        })
    }

    // Nothing panics while holding this lock.
    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<Origin, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut held = self.shares.lock();
        match held.get_mut(&self.origin) {
            Some(count) if *count > 1 => *count -= 1,
            _ => {
                held.remove(&self.origin);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin(address: &str) -> Origin {
        Peer::tcp(address.parse().unwrap()).origin
    }

    #[test]
    fn a_share_is_bounded_and_given_back() {
        let shares = Arc::new(Shares::default());
        let (one, other) = (origin("10.0.0.1:5"), origin("10.0.0.2:5"));
        let held: Vec<Share> = (0..2).filter_map(|_| shares.take(one, 2)).collect();
        assert_eq!(held.len(), 2);
        assert!(shares.take(one, 2).is_none());
        assert!(shares.take(other, 2).is_some());
        drop(held);
        assert!(shares.take(one, 2).is_some());
        assert!(shares.lock().is_empty(), "nothing is kept of who has left");
    }

    #[test]
    fn a_network_of_one_machine_is_one_origin() {
        assert_eq!(origin("10.0.0.1:5"), origin("[::ffff:10.0.0.1]:6"));
        assert_eq!(origin("[2001:db8::1]:5"), origin("[2001:db8::ffff:2]:5"));
        assert_ne!(origin("[2001:db8::1]:5"), origin("[2001:db8:0:1::1]:5"));
        assert_eq!(origin("[2001:db8::1]:5").to_string(), "2001:db8::/64");
        assert_eq!(origin("[::1]:5").to_string(), "::1");
    }
}
