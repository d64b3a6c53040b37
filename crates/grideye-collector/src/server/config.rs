//! What a collector is started with.

use crate::auth::AccessFolder;
use crate::clock::Clock;
use crate::http::Annex;
use crate::limits::Limits;
use crate::log::Log;
use crate::server::tls::Tls;
use crate::store::StoreLocation;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::num::NonZero;
use std::sync::Arc;
use tokio::runtime::Runtime;

/// Threads for a collector: one for each core but one, which the store's writer and its disk take.
///
/// # Errors
/// Where the system gives no more threads.
pub fn runtime() -> io::Result<Runtime> {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(cores.saturating_sub(1).max(1))
        .enable_all()
        .build()
}

/// What a collector is started with.
#[derive(Clone)]
pub struct Config {
    /// Where to listen; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Where to keep frames.
    pub store: StoreLocation,
    /// Every bound.
    pub limits: Limits,
    /// What time it is.
    pub clock: Arc<dyn Clock>,
    /// Host names to answer for beside loopback and the address listened on, for example `pi.local`.
    pub host_names: Vec<String>,
    /// Tokens and keys. `None`: anyone who reaches the address may do everything.
    pub access: Option<AccessFolder>,
    /// How connections are encrypted. `None`: not at all.
    pub tls: Option<Tls>,
    /// Whether to listen where other machines reach without a token or TLS. Tokens that exist are asked for all the same.
    pub network_trusted: bool,
    /// Proxies whose `x-forwarded-for` counts as the sender's address; from anyone else that header is ignored.
    pub trusted_proxies: Vec<IpAddr>,
    /// Who hears what happens.
    pub log: Log,
    /// Routes that the program brings along, behind the same middleware.
    pub annexes: Vec<Annex>,
}

impl Config {
    /// With the default limits, and for this machine alone. A program hands in [`SystemClock`](crate::SystemClock).
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
            trusted_proxies: Vec::new(),
            log: Log::silent(),
            annexes: Vec::new(),
        }
    }
}
