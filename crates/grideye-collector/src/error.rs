use crate::store::StoreError;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Why the collector does not start, or did not end well.
///
/// Each message is whole: the reason stands in it, before its hint, and is therefore not given as `source` as well, or
/// a program that prints the chain would say it twice.
#[derive(Debug, thiserror::Error)]
pub enum CollectorError {
    /// Another program listens there.
    #[error("cannot listen on {address}: the port is in use\nhint: stop the other program (`ss -ltnp 'sport = :{port}'` names it), or choose another port; port 0 takes a free one", port = .address.port())]
    AddressInUse {
        /// The address asked for.
        address: SocketAddr,
    },
    /// The address cannot be listened on for another reason.
    #[error(
        "cannot listen on {address}: {reason}\nhint: the address must be one of this machine's own, and a port below 1024 needs root"
    )]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// What the system said.
        reason: io::Error,
    },
    /// The address can be reached from other machines, and nobody said that this is meant.
    #[error(
        "refusing to listen on {address}: every machine that reaches it could post and read frames, since there is no login yet\nhint: listen on 127.0.0.1 and forward the port with ssh, or say that the network is trusted (`--trust-network`)"
    )]
    NetworkNotTrusted {
        /// The address asked for.
        address: SocketAddr,
    },
    /// The store cannot be opened.
    #[error("cannot open the store {}: {reason}", .path.display())]
    Store {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with it.
        reason: StoreError,
    },
    /// The store failed while it was being closed.
    #[error("the store did not close well: {reason}")]
    Close {
        /// What went wrong.
        reason: StoreError,
    },
    /// The listening socket failed.
    #[error("the listening socket failed: {reason}")]
    Socket {
        /// What the system said.
        reason: io::Error,
    },
}
