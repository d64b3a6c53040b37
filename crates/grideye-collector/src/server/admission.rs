//! How many connections there may be.

use crate::Limits;
use crate::counters::{Counters, add};
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::net::TcpStream;

/// Counts the open connections.
pub(super) struct Doorkeeper {
    open: Arc<Mutex<Open>>,
    counters: Arc<Counters>,
    connections_max: usize,
    per_peer_max: usize,
}

#[derive(Default)]
struct Open {
    all: usize,
    by_peer: HashMap<IpAddr, usize>,
}

impl Doorkeeper {
    pub(super) fn new(limits: &Limits, counters: Arc<Counters>) -> Self {
        Self {
            open: Arc::default(),
            counters,
            connections_max: limits.connections_max,
            per_peer_max: limits.connections_per_peer_max,
        }
    }

    /// A place for one connection, given back when it is dropped; `None` when there is none left.
    pub(super) fn admit(&self, peer: IpAddr) -> Option<Admission> {
        let peer = peer.to_canonical();
        let mut open = lock(&self.open);
        let from_peer = open.by_peer.get(&peer).copied().unwrap_or(0);
        if open.all >= self.connections_max || from_peer >= self.per_peer_max {
            add(&self.counters.turned_away, 1);
            return None;
        }
        add(&self.counters.connections, 1);
        add(&self.counters.connections_open, 1);
        open.all += 1;
        open.by_peer.insert(peer, from_peer + 1);
        Some(Admission {
            open: Arc::clone(&self.open),
            counters: Arc::clone(&self.counters),
            peer,
        })
    }
}

/// A place among the open connections.
pub(super) struct Admission {
    open: Arc<Mutex<Open>>,
    counters: Arc<Counters>,
    peer: IpAddr,
}

impl Admission {
    /// Counts that this connection ended before TLS was agreed on.
    pub(super) fn tls_failed(&self) {
        add(&self.counters.tls_failed, 1);
    }
}

impl Drop for Admission {
    fn drop(&mut self) {
        self.counters
            .connections_open
            .fetch_sub(1, Ordering::Relaxed);
        let mut open = lock(&self.open);
        open.all = open.all.saturating_sub(1);
        let left = open
            .by_peer
            .get(&self.peer)
            .map_or(0, |count| count.saturating_sub(1));
        if left == 0 {
            open.by_peer.remove(&self.peer);
        } else {
            open.by_peer.insert(self.peer, left);
        }
    }
}

fn lock(open: &Mutex<Open>) -> MutexGuard<'_, Open> {
    open.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says why, without waiting for anything, and lets the connection go.
pub(super) fn turn_away(stream: &TcpStream) {
    const BODY: &str = r#"{"error":{"code":"too_many_connections","message":"too many connections are open","field":null,"hint":"close some, or come again in a second"}}"#;
    let answer = format!(
        "HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/json\r\ncontent-length: {}\r\nretry-after: 1\r\nconnection: close\r\n\r\n{BODY}",
        BODY.len()
    );
    // A new socket has room for this; if not, the closed connection says enough.
    let _ = stream.try_write(answer.as_bytes());
}
