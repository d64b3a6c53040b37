//! What the server knows of a request besides the request itself; it travels in its extensions.

use crate::alarm::Alarm;
use crate::connections::Connection;
use crate::peer::Peer;
use axum::extract::Request;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;

/// Who sent a request, and by which connection.
#[derive(Clone)]
pub(crate) struct Client {
    pub(crate) peer: Peer,
    /// The connection's timer.
    pub(crate) alarm: Alarm,
    /// None without a server.
    pub(crate) connection: Option<Arc<Connection>>,
}

impl Client {
    /// As the server attached it; without a server, from nowhere.
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
