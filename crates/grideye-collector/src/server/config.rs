//! The configuration of a collector, and its threads.

use crate::auth::AccessFolder;
use crate::clock::Clock;
use crate::http::Annex;
use crate::limits::Limits;
use crate::live::Counting;
use crate::log::Log;
use crate::server::tls::Tls;
use crate::store::StoreLocation;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::num::NonZero;
use std::sync::Arc;
use tokio::runtime::Runtime;

/// One thread per core except one, which is left to the store's writer and its disk.
///
/// # Errors
/// If the system gives no more threads.
pub fn runtime() -> io::Result<Runtime> {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(cores.saturating_sub(1).max(1))
        .enable_all()
        .build()
}

/// A collector's configuration.
#[derive(Clone)]
pub struct Config {
    /// Address to listen on; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Where frames are stored.
    pub store: StoreLocation,
    /// All limits.
    pub limits: Limits,
    /// The collector's clock.
    pub clock: Arc<dyn Clock>,
    /// Accepted host names besides loopback and the listening address, for example `pi.local`.
    pub host_names: Vec<String>,
    /// Tokens and keys. `None`: anyone who reaches the address may do everything.
    pub access: Option<AccessFolder>,
    /// Encryption of connections. `None`: plain HTTP.
    pub tls: Option<Tls>,
    /// Allows listening on a network without a token or TLS. Existing tokens are still required.
    pub network_trusted: bool,
    /// Starts although the store was used with tokens and there are none now: anyone who reaches the address may then do
    /// everything.
    pub tokens_forgotten: bool,
    /// Proxies whose `x-forwarded-for` counts as the sender's address; from others that header is ignored.
    pub trusted_proxies: Vec<IpAddr>,
    /// Where events are logged.
    pub log: Log,
    /// Counts people in the frames. `None`: nobody is counted, at no cost.
    pub counting: Option<Counting>,
    /// The program's own routes, behind the same middleware.
    pub annexes: Vec<Annex>,
}

impl Config {
    /// Default limits, for this machine alone. A program passes [`SystemClock`](crate::SystemClock).
    #[must_use]
    pub fn new(listen: SocketAddr, store: StoreLocation, clock: Arc<dyn Clock>) -> Self {
        Self {
            listen,
            store,
            limits: Limits::default(),
            clock,
            host_names: Vec::new(),
            access: None,
            tls: None,
            network_trusted: false,
            tokens_forgotten: false,
            trusted_proxies: Vec::new(),
            log: Log::silent(),
            counting: None,
            annexes: Vec::new(),
        }
    }
}
