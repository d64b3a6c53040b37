//! The HTTP interface, as a router that needs no socket.

mod answer;
mod assets;
mod audit;
mod bodies;
mod devices;
mod events;
mod gate;
mod guard;
mod health;
mod ingest;
mod login;
mod recent;
mod recordings;
mod small;

pub use answer::Refusal;
pub(crate) use gate::Line;
pub(crate) use guard::Hosts;
pub use recordings::attachment;

use crate::alarm::Alarm;
use crate::annex::{Annex, Inside};
use crate::app::bodies::Bodies;
use crate::auth::{AccessFolder, Authenticator, TOKENS_MAX, TokenId};
use crate::clock::{Clock, WallSteps};
use crate::connections::Connection;
use crate::counters::Counters;
use crate::limits::Limits;
use crate::live::{Event, Live, NewestFrames};
use crate::log::{Log, Seldom};
use crate::peer::AddressGroup;
use crate::rates::Rates;
use crate::store::{FrameStore, News, StoreError};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::DefaultBodyLimit;
use axum::http::{Method, Request, StatusCode, header};
use axum::middleware::{from_fn_with_state, map_response};
use axum::response::{IntoResponse as _, Json, Response};
use axum::routing::{delete, get, post};
use http_body_util::{Either, Full};
use hyper::body::Incoming;
use serde_json::json;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::{Semaphore, mpsc, watch};
use tower::ServiceExt as _;

/// What the handlers share.
#[derive(Clone)]
pub struct AppState(Arc<Shared>);

struct Shared {
    store: Arc<dyn FrameStore>,
    live: Arc<Live>,
    agents: devices::Agents,
    limits: Limits,
    clock: Arc<dyn Clock>,
    wall_steps: WallSteps,
    hosts: Hosts,
    authenticator: Authenticator,
    /// Of each good token.
    rates: Rates<TokenId>,
    /// Of each address from which somebody came without one.
    unknown_rates: Rates<AddressGroup>,
    counters: Arc<Counters>,
    seldom: Seldom,
    /// On the monotonic clock.
    started_at: Duration,
    bodies: Bodies,
    live_clients: Arc<Semaphore>,
    stopping: watch::Sender<bool>,
}

impl AppState {
    /// Takes up what the store holds. Requests must name a loopback host.
    ///
    /// # Errors
    /// [`StoreError`] if the store cannot be read.
    pub async fn new(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
    ) -> Result<Self, StoreError> {
        Self::with(store, limits, clock, Door::default()).await
    }

    /// The same, for those alone that the folder of tokens names, once it names somebody.
    ///
    /// # Errors
    /// [`StoreError`] if the store cannot be read, or with its message the folder.
    pub async fn guarded(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
        access: AccessFolder,
        log: Log,
    ) -> Result<Self, StoreError> {
        let authenticator = Authenticator::of(access, limits.tokens_reread_every)
            .map_err(|error| StoreError::Failed(error.to_string()))?;
        let door = Door {
            authenticator,
            log,
            ..Door::default()
        };
        Self::with(store, limits, clock, door).await
    }

    pub(crate) async fn with(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
        door: Door,
    ) -> Result<Self, StoreError> {
        let (streams, newest) = (store.streams().await?, store.newest().await?);
        let live = Arc::new(Live::new(Arc::clone(&clock), &limits, streams, newest));
        let (rate, burst) = (limits.requests_per_second_max, limits.requests_burst_max);
        let (unknown_rate, unknown_burst) = (
            limits.unknown_requests_per_second_max,
            limits.unknown_requests_burst_max,
        );
        let news = store.news();
        let state = Self(Arc::new(Shared {
            store,
            live,
            agents: devices::Agents::new(limits.sensors_max),
            hosts: door.hosts,
            authenticator: door.authenticator,
            rates: Rates::new(rate, burst, TOKENS_MAX),
            unknown_rates: Rates::new(unknown_rate, unknown_burst, limits.unknown_peers_max),
            counters: door.counters,
            seldom: Seldom::new(door.log, limits.log_every),
            started_at: clock.monotonic(),
            wall_steps: WallSteps::new(&*clock),
            clock,
            bodies: Bodies::new(&limits),
            live_clients: Arc::new(Semaphore::new(limits.live_clients_max)),
            stopping: watch::Sender::new(false),
            limits,
        }));
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

    fn inside(&self) -> Inside {
        Inside {
            store: Arc::clone(&self.0.store),
            recent: self.0.live.recent().clone(),
            newest: NewestFrames::new(Arc::clone(&self.0.live)),
            clock: self.clock(),
        }
    }
}

/// Who is let in, and who hears of it.
pub(crate) struct Door {
    pub(crate) hosts: Hosts,
    pub(crate) authenticator: Authenticator,
    pub(crate) log: Log,
    pub(crate) counters: Arc<Counters>,
}

impl Default for Door {
    /// Anyone on this machine, in silence.
    fn default() -> Self {
        Self {
            hosts: Hosts::new(IpAddr::V4(Ipv4Addr::LOCALHOST), &[]),
            authenticator: Authenticator::open(),
            log: Log::silent(),
            counters: Arc::default(),
        }
    }
}

/// Shows what other collectors keep in the same store, for as long as both are there.
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

/// An acknowledgement, which is most of them, or anything else.
pub(crate) type Answer = Response<Either<Full<Bytes>, Body>>;

/// The router, and beside it a shorter way for what nearly every request is.
pub(crate) struct Entrance {
    state: AppState,
    router: Router,
}

impl Entrance {
    pub(crate) fn new(state: AppState, annexes: &[Annex]) -> Self {
        let router = app_with(state.clone(), annexes);
        Self { state, router }
    }

    pub(crate) async fn answer(
        &self,
        line: Line,
        alarm: &Alarm,
        connection: &Arc<Connection>,
        request: Request<Incoming>,
    ) -> Answer {
        if request.method() == Method::POST && request.uri().path() == "/v1/frames" {
            return ingest::guarded_frames(&self.state, line, alarm, connection, request).await;
        }
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(line);
        request.extensions_mut().insert(Arc::clone(connection));
        // In a box, so that what a post takes along stays small.
        let routed = Box::pin(self.router.clone().oneshot(request));
        routed.await.into_response().map(Either::Right)
    }
}

/// Every route of the collector.
pub fn app(state: AppState) -> Router {
    app_with(state, &[])
}

/// Every route of the collector, and those that the program brings along.
///
/// # Panics
/// When an annex has a path of the collector or of another annex, or is described by what is no OpenAPI.
pub fn app_with(state: AppState, annexes: &[Annex]) -> Router {
    let inside = state.inside();
    let brought = annexes.iter().map(|annex| annex.routes(&inside));
    let brought = brought.fold(Router::new(), Router::merge);
    let brought = brought.layer(map_response(answer::in_own_form));
    let document = assets::openapi(annexes);
    let document = ([(header::CONTENT_TYPE, "application/json")], document);
    let names: Vec<&str> = annexes.iter().map(Annex::name).collect();
    let names = Json(json!({ "annexes": names }));
    let small_body_bytes_max = state.limits().small_body_bytes_max;
    Router::new()
        .route("/", get(assets::page))
        .route("/editor", get(assets::editor))
        .route("/assets/{name}", get(assets::asset))
        .route("/login", get(login::page))
        .route("/healthz", get(health::alive))
        .route("/metrics", get(health::metrics))
        .route("/v1/health", get(health::health))
        .route("/v1/openapi.json", get(|| async move { document }))
        .route("/v1/login", post(login::login))
        .route("/v1/logout", post(login::logout))
        .route("/v1/whoami", get(login::whoami))
        .route("/v1/annexes", get(|| async move { names }))
        .route("/v1/frames", post(ingest::frames))
        .route("/v1/sensors", get(audit::sensors))
        .route("/v1/recent", get(recent::recent))
        .route("/v1/devices", get(devices::devices))
        .route("/v1/devices/{device}", get(devices::device))
        .route("/v1/audit", get(audit::audit))
        .route("/v1/live", get(events::live))
        .route(
            "/v1/recordings",
            get(recordings::list).post(recordings::start),
        )
        .route("/v1/recordings/{id}", get(recordings::one))
        .route("/v1/recordings/{id}/stop", post(recordings::stop))
        .route("/v1/recordings/{id}/note", post(recordings::note))
        .route(
            "/v1/recordings/{id}/labels",
            get(recordings::labels::list).post(recordings::labels::add),
        )
        .route(
            "/v1/recordings/{id}/labels.csv",
            get(recordings::labels::csv),
        )
        .route(
            "/v1/recordings/{id}/labels/{number}",
            delete(recordings::labels::remove),
        )
        .merge(brought.with_state(()))
        .fallback(unknown_path)
        .method_not_allowed_fallback(wrong_method)
        .layer(DefaultBodyLimit::max(small_body_bytes_max))
        .layer(from_fn_with_state(state.clone(), guard::guard))
        .with_state(state)
}

async fn unknown_path() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "unknown_path", "there is nothing at this path")
        .hint("POST /v1/frames, GET /v1/sensors, /v1/devices, /v1/live, /v1/audit, /v1/recordings, /v1/health, /metrics, /healthz, and / for people")
}

async fn wrong_method() -> Refusal {
    Refusal::new(
        StatusCode::METHOD_NOT_ALLOWED,
        "wrong_method",
        "this path does not take that method",
    )
    .hint("the header `allow` names those that it takes")
}
