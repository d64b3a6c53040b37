//! Memory for incoming frames: counts bytes that arrived and are not yet on disk, in total and per sender.

use crate::auth::Caller;
use crate::http::refusal::Refusal;
use crate::limits::Limits;
use crate::lock::lock;
use crate::sender::Sender;
use axum::http::StatusCode;
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Bodies up to this size, which nearly all are, count in the total but not for their sender, which would need a lock.
const SMALL: usize = 4096;

/// When a sender that used up its share should retry.
const SHARE_RETRY: Duration = Duration::from_secs(1);

pub(crate) struct Bodies {
    bytes_max: usize,
    per_sender_max: usize,
    bytes: AtomicUsize,
    of_senders: Mutex<HashMap<Sender, usize>>,
}

impl Bodies {
    pub(crate) fn new(limits: &Limits) -> Self {
        Self {
            bytes_max: limits.bodies_bytes_max,
            per_sender_max: limits.bodies_bytes_per_sender_max,
            bytes: AtomicUsize::new(0),
            of_senders: Mutex::default(),
        }
    }

    /// A reservation for one body, empty at first.
    pub(crate) fn room<'b>(&'b self, caller: Option<&'b Caller>, peer: IpAddr) -> Room<'b> {
        Room {
            bodies: self,
            caller,
            peer,
            bytes: 0,
            of_sender: 0,
        }
    }

    fn take(&self, more: usize) -> Result<(), Refusal> {
        let fits = |bytes: usize| {
            let bytes = bytes.checked_add(more)?;
            (bytes <= self.bytes_max).then_some(bytes)
        };
        let taken = self
            .bytes
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits);
        taken.map(|_before| ()).map_err(|_before| {
            let what = "the memory for incoming frames is used up";
            Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what)
                .hint("retry in a second; nothing of this request was stored")
        })
    }
}

/// The reservation of one body; freed on drop.
pub(crate) struct Room<'b> {
    bodies: &'b Bodies,
    caller: Option<&'b Caller>,
    peer: IpAddr,
    bytes: usize,
    /// The part of `bytes` that counts for the sender.
    of_sender: usize,
}

impl Room<'_> {
    /// Reserves memory for bytes that arrived.
    pub(crate) fn grow(&mut self, more: usize) -> Result<(), Refusal> {
        self.bodies.take(more)?;
        self.bytes += more;
        if self.bytes > SMALL {
            self.count_for_sender()?;
        }
        Ok(())
    }

    fn count_for_sender(&mut self) -> Result<(), Refusal> {
        let most = self.bodies.per_sender_max;
        let mut of_senders = lock(&self.bodies.of_senders);
        let of_all = of_senders.entry(self.sender()).or_default();
        let bytes = *of_all + self.bytes - self.of_sender;
        if bytes > most {
            let whose = match self.caller {
                Some(Caller::Holder { .. }) => "token",
                _ => "address",
            };
            let what = format!("this {whose} is sending more than {most} bytes of frames at once");
            return Err(
                Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too_much_at_once", what)
                    .hint("send fewer or smaller batches at once, and retry this one in a second; nothing of it was stored")
                    .retry_after(SHARE_RETRY),
            );
        }
        *of_all = bytes;
        self.of_sender = self.bytes;
        Ok(())
    }

    pub(crate) fn sender(&self) -> Sender {
        Sender::of(self.caller, self.peer)
    }
}

impl Drop for Room<'_> {
    fn drop(&mut self) {
        self.bodies.bytes.fetch_sub(self.bytes, Ordering::Relaxed);
        if self.bytes <= SMALL {
            return;
        }
        let mut of_senders = lock(&self.bodies.of_senders);
        let sender = self.sender();
        let left = of_senders
            .get(&sender)
            .map_or(0, |bytes| bytes.saturating_sub(self.of_sender));
        if left == 0 {
            of_senders.remove(&sender);
        } else {
            of_senders.insert(sender, left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    const A: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 1));
    const B: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2));

    #[test]
    fn shares_and_the_total_are_limited_and_freed() {
        let bodies = Bodies::new(&Limits {
            bodies_bytes_max: 25_000,
            bodies_bytes_per_sender_max: 10_000,
            ..Limits::default()
        });
        let grown = |peer, bytes| {
            let mut room = bodies.room(None, peer);
            (room.grow(bytes).is_ok(), room)
        };
        let kept = [grown(A, 6000), grown(A, 4000), grown(B, 10_000)];
        assert!(kept.iter().all(|(is_kept, _)| *is_kept));
        // Small bodies count in the total, but not for a share.
        let (is_kept, mut growing) = grown(A, SMALL);
        assert!(is_kept);
        assert!(growing.grow(1).is_err(), "A's share is used up");
        drop(growing);
        assert!(!grown(Ipv4Addr::LOCALHOST.into(), 5001).0, "all is used up");
        assert!(grown(Ipv4Addr::LOCALHOST.into(), 5000).0);
        drop(kept);
        assert_eq!(bodies.bytes.load(Ordering::Relaxed), 0);
        assert!(bodies.of_senders.lock().unwrap().is_empty());
        assert!(grown(A, 10_000).0);
    }

    #[test]
    fn small_bodies_on_all_connections_use_at_most_a_quarter() {
        let limits = Limits::default();
        assert!(4 * limits.connections_max * SMALL <= limits.bodies_bytes_max);
    }
}
