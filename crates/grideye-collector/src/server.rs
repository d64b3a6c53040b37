//! The socket: an accept loop of our own, because `axum::serve` waits for slow peers for ever.

mod admission;
mod stall;

use crate::app::{AppState, Hosts, app};
use crate::store::{SqliteStore, StoreLocation};
use crate::{Clock, CollectorError, Limits};
use admission::{Admission, Doorkeeper};
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use stall::StallGuard;
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

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
    /// Whether an address may be listened on that other machines reach. There is no login yet.
    pub network_trusted: bool,
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
            network_trusted: false,
        }
    }
}

/// A collector that holds its socket and its store.
pub struct Collector {
    listener: TcpListener,
    local_addr: SocketAddr,
    state: AppState,
}

impl Collector {
    /// Takes the address and opens the store.
    ///
    /// # Errors
    /// [`CollectorError`] when the address or the store cannot be had; neither is held then.
    pub async fn bind(config: Config) -> Result<Self, CollectorError> {
        let address = config.listen;
        if !address.ip().is_loopback() && !config.network_trusted {
            return Err(CollectorError::NetworkNotTrusted { address });
        }
        let listener = TcpListener::bind(address)
            .await
            .map_err(|reason| match reason.kind() {
                io::ErrorKind::AddrInUse => CollectorError::AddressInUse { address },
                _ => CollectorError::Listen { address, reason },
            })?;
        let local_addr = listener
            .local_addr()
            .map_err(|reason| CollectorError::Socket { reason })?;
        let state = open(&config, local_addr).await.map_err(|reason| {
            let path = PathBuf::from(config.store.to_string());
            CollectorError::Store { path, reason }
        })?;
        Ok(Self {
            listener,
            local_addr,
            state,
        })
    }

    /// The address listened on, with the port that was taken.
    #[must_use]
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// Serves until `shutdown` is ready; then lets open requests finish, commits, and closes the store.
    ///
    /// # Errors
    /// [`CollectorError::Close`] if the store does not close well.
    pub async fn serve(
        self,
        shutdown: impl Future<Output = ()> + Send,
    ) -> Result<(), CollectorError> {
        let limits = self.state.limits().clone();
        let server = Server {
            router: app(self.state.clone()),
            doorkeeper: Doorkeeper::new(&limits),
            stopping: watch::Sender::new(false),
            limits,
        };
        let mut connections = JoinSet::new();
        let mut shutdown = pin!(shutdown);
        loop {
            tokio::select! {
                () = &mut shutdown => break,
                accepted = self.listener.accept() => server.accept(accepted, &mut connections).await,
                Some(_ended) = connections.join_next() => {}
            }
        }
        drop(self.listener);
        self.state.stop();
        server.stopping.send_replace(true);
        let finished = async { while connections.join_next().await.is_some() {} };
        // Who does not finish in time is cut off when the set is dropped.
        let _ = tokio::time::timeout(server.limits.shutdown_time_max, finished).await;
        connections.shutdown().await;
        let closed = self.state.store().close().await;
        closed.map_err(|reason| CollectorError::Close { reason })
    }
}

async fn open(config: &Config, local_addr: SocketAddr) -> Result<AppState, crate::StoreError> {
    let store = SqliteStore::open(&config.store, &config.limits)?;
    let hosts = Hosts::new(local_addr.ip(), &config.host_names);
    let clock = Arc::clone(&config.clock);
    AppState::with_hosts(Arc::new(store), config.limits.clone(), clock, hosts).await
}

/// A pause after the system could not hand over a connection, for example for want of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

struct Server {
    router: Router,
    doorkeeper: Doorkeeper,
    stopping: watch::Sender<bool>,
    limits: Limits,
}

impl Server {
    async fn accept(
        &self,
        accepted: io::Result<(TcpStream, SocketAddr)>,
        connections: &mut JoinSet<()>,
    ) {
        let Ok((stream, peer)) = accepted else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            return;
        };
        match self.doorkeeper.admit(peer.ip()) {
            Some(admission) => {
                connections.spawn(self.connection(stream, admission));
            }
            None => admission::turn_away(&stream),
        }
    }

    fn connection(
        &self,
        stream: TcpStream,
        admission: Admission,
    ) -> impl Future<Output = ()> + use<> {
        // Small answers go out at once; that it may fail on a dead socket is found at the next read.
        let _ = stream.set_nodelay(true);
        let mut builder = http1::Builder::new();
        builder
            .timer(TokioTimer::new())
            .header_read_timeout(self.limits.header_time_max)
            .max_header_size(self.limits.header_bytes_max);
        let io = TokioIo::new(StallGuard::new(stream, self.limits.write_stall_max));
        let service = TowerToHyperService::new(self.router.clone());
        let mut stopping = self.stopping.subscribe();
        async move {
            let _admission = admission;
            let mut connection = pin!(builder.serve_connection(io, service));
            // How a connection ended is the peer's business: it sees the same end.
            tokio::select! {
                _ended = connection.as_mut() => return,
                _stop = stopping.wait_for(|stopping| *stopping) => {}
            }
            connection.as_mut().graceful_shutdown();
            let _ended = connection.await;
        }
    }
}
