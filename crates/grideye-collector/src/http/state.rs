//! The state that the handlers share.

use crate::auth::{AccessFolder, Authenticator, TOKENS_MAX, TokenId};
use crate::clock::{Clock, WallSteps};
use crate::counters::Counters;
use crate::http::agents::Agents;
use crate::http::origin::HostNames;
use crate::limits::Limits;
use crate::live::{Counting, Event, Live};
use crate::log::{Level, Log, LogEvent, Seldom};
use crate::peer::AddressGroup;
use crate::rates::Rates;
use crate::shares::{Sender, Shares};
use crate::store::{FrameStore, News, StoreError};
use serde_json::json;
use std::collections::HashMap;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::{mpsc, watch};

/// The state that the handlers share.
#[derive(Clone)]
pub struct AppState(pub(crate) Arc<Shared>);

pub(crate) struct Shared {
    pub(crate) store: Arc<dyn FrameStore>,
    pub(crate) live: Arc<Live>,
    pub(crate) agents: Agents,
    pub(crate) limits: Limits,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) wall_steps: WallSteps,
    pub(crate) hosts: HostNames,
    pub(crate) authenticator: Authenticator,
    /// For each valid token.
    pub(crate) rates: Rates<TokenId>,
    /// For each address that sent no valid token.
    pub(crate) unknown_rates: Rates<(AddressGroup, bool)>,
    /// New streams of each sender.
    pub(crate) new_streams: Rates<Sender>,
    pub(crate) counters: Arc<Counters>,
    pub(crate) seldom: Seldom,
    pub(crate) started_at: Duration,
    /// Bytes of frames that arrived and are not yet on disk.
    pub(crate) bodies: Arc<Shares>,
    pub(crate) live_clients: Arc<Shares>,
    pub(crate) audits: Arc<Shares>,
    /// Requests to annexes.
    pub(crate) annexed: Arc<Shares>,
    pub(crate) stopping: watch::Sender<bool>,
}

impl AppState {
    /// Loads the store's state. Requests must name a loopback host.
    ///
    /// # Errors
    /// [`StoreError`] if the store cannot be read.
    pub async fn new(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, StoreError> {
        Self::with(store, limits, clock, Options::default()).await
    }

    /// Like [`Self::new`], but admits only holders of the folder's tokens, once it has any.
    ///
    /// # Errors
    /// [`StoreError`] if the store cannot be read, or if the folder cannot, with its message.
    pub async fn with_tokens(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
        access: AccessFolder,
        log: Log,
    ) -> Result<Self, StoreError> {
        let authenticator = Authenticator::of(access, limits.tokens_reread_every)
            .map_err(|error| StoreError::Failed(error.to_string()))?;
        let options = Options {
            authenticator,
            log,
            ..Options::default()
        };
        Self::with(store, limits, clock, options).await
    }

    pub(crate) async fn with(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
        options: Options,
    ) -> Result<Self, StoreError> {
        let (streams, newest) = (store.streams().await?, store.newest().await?);
        let live = Arc::new(Live::new(
            Arc::clone(&clock),
            &limits,
            options.counting,
            streams,
            newest,
        ));
        let (rate, burst) = (limits.requests_per_second_max, limits.requests_burst_max);
        let (unknown_rate, unknown_burst) = (
            limits.unknown_requests_per_second_max,
            limits.unknown_requests_burst_max,
        );
        let news = store.news();
        let state = Self(Arc::new(Shared {
            store,
            live,
            agents: Agents::new(limits.sensors_max),
            hosts: options.hosts,
            authenticator: options.authenticator,
            rates: Rates::new(rate, burst, TOKENS_MAX),
            unknown_rates: Rates::new(unknown_rate, unknown_burst, limits.unknown_peers_max),
            new_streams: Rates::new(
                limits.new_streams_per_second_max,
                limits.new_streams_burst_max,
                TOKENS_MAX,
            ),
            counters: options.counters,
            seldom: Seldom::new(options.log, limits.log_every),
            started_at: clock.monotonic(),
            wall_steps: WallSteps::new(&*clock),
            clock,
            bodies: Shares::new(limits.bodies_bytes_max, limits.bodies_bytes_per_sender_max),
            live_clients: Shares::new(limits.live_clients_max, usize::MAX),
            audits: Shares::new(limits.audits_max, usize::MAX),
            annexed: Shares::new(
                limits.annex_requests_max,
                limits.annex_requests_per_sender_max,
            ),
            stopping: watch::Sender::new(false),
            limits,
        }));
        tokio::spawn(end_abandoned(Arc::downgrade(&state.0)));
        if let Some(news) = news {
            tokio::spawn(show_news(Arc::downgrade(&state.0), news));
        }
        Ok(state)
    }

    /// Ends the streams that would not end by themselves.
    pub(crate) fn stop(&self) {
        self.0.stopping.send_replace(true);
    }

    pub(crate) fn limits(&self) -> &Limits {
        &self.0.limits
    }

    pub(crate) fn clock(&self) -> Arc<dyn Clock> {
        Arc::clone(&self.0.clock)
    }

    pub(crate) fn store(&self) -> &dyn FrameStore {
        &*self.0.store
    }
}

/// Accepted hosts, who is admitted, and where events are logged.
pub(crate) struct Options {
    pub(crate) hosts: HostNames,
    pub(crate) authenticator: Authenticator,
    pub(crate) log: Log,
    pub(crate) counters: Arc<Counters>,
    /// Whether people are counted, and how.
    pub(crate) counting: Option<Counting>,
}

impl Default for Options {
    /// Admits anyone on this machine, and logs nothing.
    fn default() -> Self {
        Self {
            hosts: HostNames::new(IpAddr::V4(Ipv4Addr::LOCALHOST), &[]),
            authenticator: Authenticator::open(),
            log: Log::silent(),
            counters: Arc::default(),
            counting: None,
        }
    }
}

/// Shows what other collectors store in the same database, while both exist.
async fn show_news(shared: Weak<Shared>, mut news: mpsc::Receiver<News>) {
    while let Some(news) = news.recv().await {
        let Some(shared) = shared.upgrade() else {
            return;
        };
        match news {
            News::Frames(elsewhere) => shared.live.take_elsewhere(*elsewhere),
            News::Recordings => shared.live.tell(Event::new("recordings", &json!({}))),
        }
    }
}

/// Pause between two looks at the leases of recordings.
const LEASES_READ_EVERY: Duration = Duration::from_secs(2);

/// Ends recordings that nobody renews any more, while the collector exists. A lease runs on this collector's monotonic
/// clock, from when it first saw a renewal: no step of a wall clock and no outage of collector or store ends a recording.
async fn end_abandoned(shared: Weak<Shared>) {
    let mut renewed = HashMap::new();
    loop {
        tokio::time::sleep(LEASES_READ_EVERY).await;
        let Some(shared) = shared.upgrade() else {
            return;
        };
        let leases = shared.store.leases().await.unwrap_or_default();
        let now = shared.clock.monotonic();
        let before = std::mem::take(&mut renewed);
        for (id, renewals) in leases {
            let seen = before.get(&id).filter(|(known, _)| *known == renewals);
            let (_, since) = *seen.unwrap_or(&(renewals, now));
            if now.saturating_sub(since) < shared.limits.recording_lease {
                renewed.insert(id, (renewals, since));
                continue;
            }
            // If it is not running, another collector or a person has ended it.
            let stopped = shared.store.stop_recording(id, shared.clock.utc_ns());
            if let Ok(recording) = stopped.await {
                let event = LogEvent::new(Level::Warning, "recording_abandoned");
                let event = event.with("id", id).with("name", recording.name);
                shared.seldom.say("", now, event);
                shared.live.tell(Event::new("recordings", &json!({})));
            }
        }
    }
}
