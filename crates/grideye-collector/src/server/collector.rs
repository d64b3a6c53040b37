//! [`Collector`]: binds the address, opens the store, accepts connections, and closes both in order.

use crate::auth::{AccessFolder, Authenticator};
use crate::clock::Clock;
use crate::connections::Connections;
use crate::counters::Counters;
use crate::http::{Annex, AppState, HostNames, Options};
use crate::limits::Limits;
use crate::log::{Level, Log, LogEvent, Seldom};
use crate::peer::TrustedProxies;
use crate::router::{Routes, app_with};
use crate::server::config::Config;
use crate::server::error::CollectorError;
use crate::server::serving::{Serving, stall_limited};
use crate::server::tls::Acceptors;
use crate::store;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::future::Future;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use std::{fmt, io};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// A collector with its socket and its store.
pub struct Collector {
    listener: TcpListener,
    local_addr: SocketAddr,
    state: AppState,
    acceptors: Option<Arc<Acceptors>>,
    counters: Arc<Counters>,
    trusted_proxies: TrustedProxies,
    log: Log,
    annexes: Vec<Annex>,
}

impl Collector {
    /// Binds the address and opens the store.
    ///
    /// # Errors
    /// [`CollectorError`] if the address or the store is not available; then neither is held.
    pub async fn bind(mut config: Config) -> Result<Self, CollectorError> {
        fit_to_descriptors(&mut config);
        let address = config.listen;
        let limits = &config.limits;
        let authenticator = match &config.access {
            Some(access) => Authenticator::of(access.clone(), limits.tokens_reread_every)?,
            None => Authenticator::open(),
        };
        let asks_for_tokens = authenticator.asks_for_tokens(config.clock.monotonic());
        check_exposure(&config, asks_for_tokens)?;
        let acceptors = config
            .tls
            .as_ref()
            .map(|tls| Acceptors::new(tls, config.access.as_ref(), &config.host_names))
            .transpose()?;
        let listener =
            listen(address, config.limits.connections_max).map_err(|reason| {
                match reason.kind() {
                    io::ErrorKind::AddrInUse => CollectorError::AddressInUse(address),
                    _ => CollectorError::Listen { address, reason },
                }
            })?;
        let local_addr = listener.local_addr().map_err(CollectorError::Socket)?;
        let counters = Arc::<Counters>::default();
        let options = Options {
            hosts: HostNames::new(local_addr.ip(), &config.host_names),
            authenticator,
            log: config.log.clone(),
            counters: Arc::clone(&counters),
            counting: config.counting,
        };
        let state = open(&config, options).await.map_err(|reason| {
            let path = PathBuf::from(config.store.to_string());
            CollectorError::Store { path, reason }
        })?;
        check_tokens(&config, &state, asks_for_tokens).await?;
        for path in config.access.iter().flat_map(AccessFolder::exposed) {
            let hint = format!("chmod 600 {}", path.display());
            config.log.say(
                &LogEvent::new(Level::Warning, "readable_by_others")
                    .with("file", path.display())
                    .with("hint", hint),
            );
        }
        let access = config.access.as_ref();
        let access = access.map_or("-".to_owned(), |access| access.path().display().to_string());
        let pin = acceptors.as_ref().and_then(Acceptors::pin);
        config.log.say(
            &LogEvent::new(Level::Info, "listening")
                .with("address", local_addr)
                .with("tls", acceptors.is_some())
                .with("authority", pin.unwrap_or_else(|| "-".to_owned()))
                .with("asks_for_tokens", asks_for_tokens)
                .with("access", access),
        );
        Ok(Self {
            listener,
            local_addr,
            state,
            acceptors: acceptors.map(Arc::new),
            counters,
            trusted_proxies: TrustedProxies::new(&config.trusted_proxies),
            log: config.log,
            annexes: config.annexes,
        })
    }

    /// The bound address, with the actual port.
    #[must_use]
    pub fn local_addr(&self) -> SocketAddr {
        self.local_addr
    }

    /// `http` or `https`.
    #[must_use]
    pub fn scheme(&self) -> &'static str {
        if self.acceptors.is_some() {
            "https"
        } else {
            "http"
        }
    }

    /// Serves until `shutdown` is ready; then lets open requests finish, commits, and closes the store.
    ///
    /// # Errors
    /// [`CollectorError::Close`] if closing the store fails.
    pub async fn serve(
        self,
        shutdown: impl Future<Output = ()> + Send,
    ) -> Result<(), CollectorError> {
        let limits = self.state.limits().clone();
        let server = Server {
            routes: app_with(self.state.clone(), &self.annexes),
            open: Arc::new(Connections::new(&limits, self.counters)),
            proxies: Arc::new(self.trusted_proxies),
            acceptors: self.acceptors,
            seldom: Seldom::new(self.log.clone(), limits.log_every),
            clock: self.state.clock(),
            stopping: watch::Sender::new(false),
            limits,
        };
        // A displaced connection holds its descriptor until its task ends: with [`LEAVING_MAX`] of those, accepting
        // pauses.
        let tasks_max = server.limits.connections_max + LEAVING_MAX;
        let mut connections = JoinSet::new();
        let mut shutdown = pin!(shutdown);
        loop {
            tokio::select! {
                () = &mut shutdown => break,
                accepted = self.listener.accept(), if connections.len() < tasks_max => {
                    server.accept(accepted, &mut connections).await;
                }
                Some(_ended) = connections.join_next() => {}
            }
        }
        drop(self.listener);
        self.state.stop();
        server.stopping.send_replace(true);
        let finished = async { while connections.join_next().await.is_some() {} };
        // Requests that do not finish in time are aborted when the set is shut down.
        let _ = tokio::time::timeout(server.limits.shutdown_time_max, finished).await;
        connections.shutdown().await;
        let now = self.state.clock().monotonic();
        if self.state.0.authenticator.asks_for_tokens_now(now) {
            // Tokens may have been made meanwhile.
            let _ = self.state.store().asked_for_tokens(true).await;
        }
        let closed = self.state.store().close().await;
        self.log.say(&LogEvent::new(Level::Info, "stopped"));
        closed.map_err(CollectorError::Close)
    }
}

/// The queue is as long as the connection limit: if the default of 128 overflows, clients believe they are connected.
fn listen(address: SocketAddr, queue: usize) -> io::Result<TcpListener> {
    let socket = match address {
        SocketAddr::V4(_) => TcpSocket::new_v4()?,
        SocketAddr::V6(_) => TcpSocket::new_v6()?,
    };
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(u32::from(u16::try_from(queue).unwrap_or(u16::MAX)))
}

/// Raises this process's limit on open files. If that is still too low, reduces the connections and logs it.
fn fit_to_descriptors(config: &mut Config) {
    let Some(descriptors) = raise(&config.limits) else {
        return;
    };
    let Some(fitted) = fit(&config.limits, descriptors) else {
        return;
    };
    config.log.say(
        &LogEvent::new(Level::Warning, "few_descriptors")
            .with("open_files_max", descriptors)
            .with("connections_wanted", config.limits.connections_max)
            .with("connections_max", fitted.connections_max),
    );
    config.limits = fitted;
}

/// Beyond loopback, requires tokens and TLS unless the user opted out.
fn check_exposure(config: &Config, asks_for_tokens: bool) -> Result<(), CollectorError> {
    let address = config.listen;
    if address.ip().to_canonical().is_loopback() || config.network_trusted {
        return Ok(());
    }
    if !asks_for_tokens {
        return Err(CollectorError::NoTokens(address));
    }
    match config.tls {
        Some(_) => Ok(()),
        None => Err(CollectorError::NoTls(address)),
    }
}

/// Refuses to admit everyone to a store that was used with tokens, unless the user said so.
async fn check_tokens(
    config: &Config,
    state: &AppState,
    is_asking: bool,
) -> Result<(), CollectorError> {
    let asked_before = state.store().asked_for_tokens(is_asking).await;
    let refused = match (&config.access, asked_before) {
        (Some(access), Ok(true)) if !is_asking && !config.tokens_forgotten => {
            CollectorError::TokensGone(access.path().to_owned())
        }
        (Some(_), Err(reason)) if !is_asking => CollectorError::Store {
            path: PathBuf::from(config.store.to_string()),
            reason,
        },
        _ => return Ok(()),
    };
    state.store().close().await.map_err(CollectorError::Close)?;
    Err(refused)
}

async fn open(config: &Config, options: Options) -> Result<AppState, crate::store::StoreError> {
    let clock = Arc::clone(&config.clock);
    let store = store::open(&config.store, &config.limits, &clock, &config.log).await?;
    AppState::with(store, config.limits.clone(), clock, options).await
}

/// Pause after a failed accept, for example for lack of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

struct Server {
    routes: Routes,
    open: Arc<Connections>,
    proxies: Arc<TrustedProxies>,
    acceptors: Option<Arc<Acceptors>>,
    seldom: Seldom,
    clock: Arc<dyn Clock>,
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
        let is_proxy = self.proxies.contains(peer.ip());
        let Some((connection, displaced)) = self.open.admit(peer.ip(), is_proxy) else {
            self.log("turned_away", peer.ip());
            // A client waiting for TLS would not understand this text; closing the connection tells it enough.
            if self.acceptors.is_none() {
                turn_away(&stream);
            }
            return;
        };
        if let Some(group) = displaced {
            self.log("displaced", group);
        }
        // Small responses go out at once. On a dead socket this may fail, which the next read will notice.
        let _ = stream.set_nodelay(true);
        let number = connection.number();
        let serving = Serving {
            peer: peer.ip().to_canonical(),
            proxies: is_proxy.then(|| Arc::clone(&self.proxies)),
            routes: self.routes.clone(),
            limits: self.limits.clone(),
            stopping: self.stopping.subscribe(),
            connection,
        };
        let task = match self.acceptors.clone() {
            None => {
                let limited = stall_limited(stream, self.limits.write_stall_max);
                connections.spawn(serving.run(limited, false))
            }
            Some(acceptors) => connections.spawn(async move {
                if let Some(stream) = serving.encrypt(&acceptors, stream).await {
                    serving.run(stream, true).await;
                }
            }),
        };
        self.open.serve_by(number, task);
    }

    fn log(&self, event: &'static str, peer: impl fmt::Display) {
        let event = LogEvent::new(Level::Warning, event).with("peer", peer);
        self.seldom.say("", self.clock.monotonic(), event);
    }
}

/// Sends the reason without waiting; the connection is closed afterwards.
fn turn_away(stream: &TcpStream) {
    const BODY: &str = r#"{"error":{"code":"too_many_connections","message":"too many connections are open","field":null,"hint":"close some, or come again in a second"}}"#;
    let answer = format!(
        "HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/json\r\ncontent-length: {}\r\nretry-after: 1\r\nconnection: close\r\n\r\n{BODY}",
        BODY.len()
    );
    // A new socket has room for this; if not, closing it says enough.
    let _ = stream.try_write(answer.as_bytes());
}

/// Descriptors for everything else: the store and its readers, files of the annexes, the runtime.
const OTHERS_MAX: usize = 128;
/// Displaced connections that are not closed yet.
const LEAVING_MAX: usize = 128;

/// Raises the soft limit to what the connections need, if the hard limit allows. Returns the resulting limit; `None`
/// for unlimited.
fn raise(limits: &Limits) -> Option<usize> {
    let needed = u64::try_from(limits.connections_max + LEAVING_MAX + OTHERS_MAX).ok()?;
    let limit = getrlimit(Resource::Nofile);
    let current = limit.current?;
    let wanted = limit.maximum.map_or(needed, |most| most.min(needed));
    let raised = Rlimit {
        current: Some(wanted),
        maximum: limit.maximum,
    };
    let is_raised = wanted > current && setrlimit(Resource::Nofile, raised).is_ok();
    let now = if is_raised { wanted } else { current };
    usize::try_from(now).ok()
}

/// Limits with fewer connections if descriptors are short; the limit per address shrinks in proportion.
fn fit(limits: &Limits, descriptors: usize) -> Option<Limits> {
    let available = descriptors.saturating_sub(LEAVING_MAX + OTHERS_MAX).max(1);
    if available >= limits.connections_max {
        return None;
    }
    let per_peer = limits.connections_per_peer_max.min(limits.connections_max);
    Some(Limits {
        connections_max: available,
        connections_per_peer_max: (per_peer * available / limits.connections_max).max(1),
        ..limits.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_fit_the_descriptors_and_the_limit_per_address_shrinks_with_them() {
        let limits = Limits {
            connections_max: 4096,
            connections_per_peer_max: 2560,
            ..Limits::default()
        };
        assert_eq!(fit(&limits, 4096 + 256), None);
        let fitted = |descriptors| {
            let fitted = fit(&limits, descriptors).unwrap();
            (fitted.connections_max, fitted.connections_per_peer_max)
        };
        assert_eq!(fitted(4096 + 255), (4095, 2559));
        assert_eq!(fitted(1024), (768, 480));
        assert_eq!(fitted(100), (1, 1));
    }
}
