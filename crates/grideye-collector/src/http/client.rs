//! What the server knows about a request's sender, stored in the request's extensions.

use crate::alarm::Alarm;
use crate::connections::Connection;
use crate::peer::Peer;
use axum::extract::Request;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;

/// The sender of a request, and its connection.
#[derive(Clone)]
pub(crate) struct Client {
    pub(crate) peer: Peer,
    pub(crate) alarm: Alarm,
    /// `None` without a server.
    pub(crate) connection: Option<Arc<Connection>>,
}

impl Client {
    /// As attached by the server; without one, an unspecified address.
    pub(crate) fn of(request: &Request) -> Self {
        request.extensions().get().cloned().unwrap_or_else(|| Self {
            peer: Peer {
                address: IpAddr::V4(Ipv4Addr::UNSPECIFIED),
                is_encrypted: false,
            },
            alarm: Alarm::default(),
            connection: None,
        })
    }
}
