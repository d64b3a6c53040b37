//! Why the collector does not start, or did not end well.

use crate::auth::AccessError;
use crate::store::StoreError;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Why the collector does not start, or did not end well. The reason stands in the message, so it is no `source` as well.
#[derive(Debug, thiserror::Error)]
pub enum CollectorError {
    /// Another program listens there.
    #[error("cannot listen on {0}: the port is in use\nhint: stop the other program (`ss -ltnp 'sport = :{port}'` names it), or choose another port; port 0 takes a free one", port = .0.port())]
    AddressInUse(SocketAddr),
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
    /// The address can be reached from other machines, and there is no token.
    #[error(
        "refusing to listen on {0}: every machine that reaches it could read frames and post some\nhint: make a token for each device (`grideye enroll DEVICE`) and start again: tokens are then asked for and TLS is on; or say that everybody on this network may do everything (`--trust-network`)"
    )]
    NoTokens(SocketAddr),
    /// The address can be reached from other machines, and nothing would be encrypted.
    #[error(
        "refusing to listen on {0} without TLS: tokens would travel in the clear\nhint: leave `--plain-http` out, or say that nobody listens on this network (`--trust-network`)"
    )]
    NoTls(SocketAddr),
    /// TLS with an authority of our own needs a folder to keep it in.
    #[error(
        "TLS needs a folder for the authority's key\nhint: name one with `--access`, or bring certificates (`--tls-cert`, `--tls-key`)"
    )]
    NoAuthority,
    /// A file of certificates or keys cannot be used.
    #[error("{}: {what}\nhint: a PEM file is wanted: the certificate followed by its chain, and its key without a password", .path.display())]
    TlsFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// TLS cannot be set up.
    #[error("TLS cannot be set up: {0}")]
    Tls(String),
    /// The folder of tokens cannot be used.
    #[error("{0}")]
    Access(AccessError),
    /// The store cannot be opened.
    #[error("cannot open the store {}: {reason}", .path.display())]
    Store {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with it.
        reason: StoreError,
    },
    /// The store failed while it was being closed.
    #[error("the store did not close well: {0}")]
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
