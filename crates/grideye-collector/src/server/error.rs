//! The errors of starting and stopping a collector.

use crate::auth::AccessError;
use crate::store::StoreError;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Why the collector did not start, or failed to stop cleanly. The message contains the cause, so there is no `source`.
#[derive(Debug, thiserror::Error)]
pub enum CollectorError {
    /// Another program listens on this port.
    #[error("cannot listen on {0}: the port is in use\nhint: stop the other program (`ss -ltnp 'sport = :{port}'` names it), or choose another port; port 0 takes a free one", port = .0.port())]
    AddressInUse(SocketAddr),
    /// Listening failed for another reason.
    #[error(
        "cannot listen on {address}: {reason}\nhint: the address must be one of this machine's own, and a port below 1024 needs root"
    )]
    Listen {
        /// The address requested.
        address: SocketAddr,
        /// The system's error.
        reason: io::Error,
    },
    /// Other machines can reach the address, and no token exists.
    #[error(
        "refusing to listen on {0}: every machine that reaches it could read frames and post some\nhint: create a token for each device (`grideye enroll DEVICE`) and start again, then tokens are required and TLS is on; or let everyone on this network do everything (`--trust-network`)"
    )]
    NoTokens(SocketAddr),
    /// The store was used with tokens, and the folder has none.
    #[error(
        "{} has no tokens, and this store was used with some: everyone who reaches the collector could do everything\nhint: name the folder that has them (`--access DIR`) or restore its tokens.json; to go on without tokens, `--forget-tokens`", .0.display()
    )]
    TokensGone(PathBuf),
    /// Other machines can reach the address, and TLS is off.
    #[error(
        "refusing to listen on {0} without TLS: tokens would travel in the clear\nhint: remove `--plain-http`, or declare that nobody listens on this network (`--trust-network`)"
    )]
    NoTls(SocketAddr),
    /// TLS with our own authority needs a folder for its key.
    #[error(
        "TLS needs a folder for the authority's key\nhint: name one with `--access`, or bring certificates (`--tls-cert`, `--tls-key`)"
    )]
    NoAuthority,
    /// A certificate or key file is unusable.
    #[error("{}: {what}\nhint: expected PEM files: the certificate followed by its chain, and its key without a password", .path.display())]
    TlsFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// TLS setup failed.
    #[error("cannot set up TLS: {0}")]
    Tls(String),
    /// The folder of tokens cannot be used.
    #[error("{0}")]
    Access(AccessError),
    /// The store cannot be opened.
    #[error("cannot open the store {}: {reason}", .path.display())]
    Store {
        /// The file requested.
        path: PathBuf,
        /// What is wrong with it.
        reason: StoreError,
    },
    /// The store failed while it was being closed.
    #[error("closing the store failed: {0}")]
    Close(StoreError),
    /// The listening socket failed.
    #[error("the listening socket failed: {0}")]
    Socket(io::Error),
}

impl From<AccessError> for CollectorError {
    fn from(error: AccessError) -> Self {
        Self::Access(error)
    }
}
