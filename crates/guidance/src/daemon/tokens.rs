//! Tries at the token: wrong ones are slow, and slower the more there were from the same address.
//!
//! A wrong try holds one of a few slots of its address for a while, also when the peer hangs up. Whoever
//! tries while a slot is free is told at once whether the token is right, so that a client with an old
//! token in its configuration does not keep its neighbours out; a flood of guesses gets a few in eight
//! seconds, however many connections it uses.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use super::peers::{Origin, Peer};
use crate::operations::throttle::Throttle;

/// Wrong tries of a connection before it is closed.
pub(super) const MAX_TRIES: u32 = 3;
/// Tries of an address that are in the making or in their delay at one time.
const SLOTS: usize = 4;
/// Delay of the answer to an address' first wrong try; doubled with each up to the longest.
const FIRST_DELAY: Duration = Duration::from_millis(250);
const LONGEST_DELAY: Duration = Duration::from_secs(8);
/// How long a try may wait for its slot.
const WAITING_TIME: Duration = Duration::from_secs(10);
/// Without a wrong try for this long an address is as good as new.
const FORGIVING_TIME: Duration = Duration::from_secs(300);
/// Addresses that are remembered at one time.
const MAX_ADDRESSES: usize = 1024;

/// The tries of all addresses.
#[derive(Debug, Default)]
pub(super) struct Tokens {
    addresses: Mutex<HashMap<Origin, Tries>>,
    log: Throttle,
}

#[derive(Debug)]
struct Tries {
    wrong: u32,
    /// When the last wrong one was, or the first of all.
    last: Instant,
    slots: Arc<Semaphore>,
}

impl Tries {
    fn new(now: Instant) -> Self {
        Self {
            wrong: 0,
            last: now,
            slots: Arc::new(Semaphore::new(SLOTS)),
        }
    }

    fn is_forgiven(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.last) > FORGIVING_TIME
    }

    fn delay(&self) -> Duration {
        let doubled = self.wrong.saturating_sub(1).min(16);
        (FIRST_DELAY * (1 << doubled)).min(LONGEST_DELAY)
    }
}

impl Tokens {
    /// Waits until a try of this origin may be looked at; `None` when that takes too long.
    pub async fn turn(&self, origin: Origin) -> Option<OwnedSemaphorePermit> {
        let slots = self.with(origin, Instant::now(), |tries| Arc::clone(&tries.slots));
        // The semaphore is never closed.
        timeout(WAITING_TIME, slots.acquire_owned())
            .await
            .ok()?
            .ok()
    }

    /// Counts and logs a wrong try; how long its slot is to be held.
    pub fn wrong(&self, peer: &Peer) -> Duration {
        let now = Instant::now();
        let (wrong, delay) = self.with(peer.origin, now, |tries| {
            tries.wrong = tries.wrong.saturating_add(1);
            tries.last = now;
            (tries.wrong, tries.delay())
        });
        if let Some(more) = self.log.take(now) {
            let peer = peer.name.as_str();
            tracing::warn!(peer, tries = wrong, not_logged = more, "wrong token");
        }
        delay
    }

    fn with<T>(&self, origin: Origin, now: Instant, what: impl FnOnce(&mut Tries) -> T) -> T {
        // Nothing panics while holding this lock.
        let mut addresses = self
            .addresses
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if addresses.len() >= MAX_ADDRESSES && !addresses.contains_key(&origin) {
            make_room(&mut addresses, now);
        }
        let tries = addresses.entry(origin).or_insert_with(|| Tries::new(now));
        if tries.is_forgiven(now) {
            tries.wrong = 0;
        }
        what(tries)
    }
}

/// Forgets who is forgiven, or at least the one not heard of for longest.
fn make_room(addresses: &mut HashMap<Origin, Tries>, now: Instant) {
    addresses.retain(|_, tries| tries.wrong > 0 && !tries.is_forgiven(now));
    if addresses.len() < MAX_ADDRESSES {
        return;
    }
    let oldest = addresses.iter().min_by_key(|(_, tries)| tries.last);
    if let Some(origin) = oldest.map(|(origin, _)| *origin) {
        addresses.remove(&origin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_grow_to_eight_seconds_and_are_forgiven() {
        let tokens = Tokens::default();
        let peer = Peer::tcp("10.0.0.1:5".parse().unwrap());
        let delays: Vec<u64> = (0..8)
            .map(|_| u64::try_from(tokens.wrong(&peer).as_millis()).unwrap())
            .collect();
        assert_eq!(delays, [250, 500, 1000, 2000, 4000, 8000, 8000, 8000]);
        let other = Peer::tcp("10.0.0.2:5".parse().unwrap());
        assert_eq!(tokens.wrong(&other), FIRST_DELAY);
        let later = Instant::now() + FORGIVING_TIME + Duration::from_secs(1);
        assert_eq!(tokens.with(peer.origin, later, |tries| tries.wrong), 0);
    }

    #[tokio::test]
    async fn an_address_has_a_few_tries_at_a_time_and_others_have_theirs() {
        let tokens = Tokens::default();
        let origin = |last: u8| Peer::tcp(([10, 0, 0, last], 5).into()).origin;
        let mut held = Vec::new();
        for _ in 0..SLOTS {
            held.push(tokens.turn(origin(1)).await.unwrap());
        }
        let fifth = timeout(Duration::from_millis(50), tokens.turn(origin(1))).await;
        assert!(fifth.is_err(), "a fifth try waits");
        assert!(tokens.turn(origin(2)).await.is_some());
        held.pop();
        assert!(tokens.turn(origin(1)).await.is_some());
    }

    #[test]
    fn no_more_addresses_are_remembered_than_there_is_room_for() {
        let tokens = Tokens::default();
        for k in 0..3 * u32::try_from(MAX_ADDRESSES).unwrap() {
            let address = std::net::Ipv4Addr::from_bits(k);
            tokens.wrong(&Peer::tcp((address, 5).into()));
        }
        assert!(tokens.addresses.lock().unwrap().len() <= MAX_ADDRESSES);
    }
}
