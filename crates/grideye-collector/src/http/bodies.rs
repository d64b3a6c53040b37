//! Memory for incoming frames: bytes that arrived and are not yet on disk.

use crate::auth::Caller;
use crate::http::refusal::Refusal;
use crate::shares::{Denied, Sender, Share, Shares};
use axum::http::StatusCode;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

/// Bodies up to this size, which nearly all are, do not count, because counting needs a lock. The number of connections
/// limits them.
const SMALL: usize = 4096;

/// When a sender that used up its share should retry.
const SHARE_RETRY: Duration = Duration::from_secs(1);

/// The reservation of one body; freed on drop.
pub(crate) struct Room<'b> {
    bodies: &'b Arc<Shares>,
    caller: Option<&'b Caller>,
    peer: IpAddr,
    bytes: usize,
    share: Option<Share>,
}

impl<'b> Room<'b> {
    /// Empty at first.
    pub(crate) fn new(bodies: &'b Arc<Shares>, caller: Option<&'b Caller>, peer: IpAddr) -> Self {
        Self {
            bodies,
            caller,
            peer,
            bytes: 0,
            share: None,
        }
    }

    /// Reserves memory for bytes that arrived.
    pub(crate) fn grow(&mut self, more: usize) -> Result<(), Refusal> {
        self.bytes += more;
        if self.bytes <= SMALL {
            return Ok(());
        }
        let grown = match &mut self.share {
            Some(share) => share.grow(more),
            None => self
                .bodies
                .take(self.sender(), self.bytes)
                .map(|share| self.share = Some(share)),
        };
        grown.map_err(too_much)
    }

    pub(crate) fn sender(&self) -> Sender {
        Sender::of(self.caller, self.peer)
    }
}

fn too_much(denied: Denied) -> Refusal {
    match denied {
        Denied::All => {
            let what = "the memory for incoming frames is used up";
            Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "busy", what)
                .hint("retry in a second; nothing of this request was stored")
        }
        Denied::Own(bytes) => {
            let what =
                format!("{bytes} bytes of frames of this token or address are already arriving");
            Refusal::new(StatusCode::TOO_MANY_REQUESTS, "too_much_at_once", what)
                .hint("send fewer or smaller batches at once, and retry this one in a second; nothing of it was stored")
                .retry_after(SHARE_RETRY)
        }
    }
}
