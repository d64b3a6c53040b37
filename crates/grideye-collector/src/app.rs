//! The HTTP interface, as a router that needs no socket.

mod answer;
mod assets;
mod audit;
mod events;
mod guard;
mod ingest;
mod recordings;

pub(crate) use guard::Hosts;

use crate::live::Live;
use crate::store::{FrameStore, StoreError};
use crate::{Clock, Limits};
use answer::Refusal;
use axum::Router;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Json, Response};
use axum::routing::{get, post};
use serde_json::json;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use tokio::sync::{Semaphore, watch};

/// What the handlers share.
#[derive(Clone)]
pub struct AppState(Arc<Shared>);

struct Shared {
    store: Arc<dyn FrameStore>,
    live: Live,
    limits: Limits,
    clock: Arc<dyn Clock>,
    hosts: Hosts,
    /// Room for bodies of frames, in units of [`ingest::BODY_UNIT`] bytes.
    bodies: Arc<Semaphore>,
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
        let hosts = Hosts::new(IpAddr::V4(Ipv4Addr::LOCALHOST), &[]);
        Self::with_hosts(store, limits, clock, hosts).await
    }

    pub(crate) async fn with_hosts(
        store: Arc<dyn FrameStore>,
        limits: Limits,
        clock: Arc<dyn Clock>,
        hosts: Hosts,
    ) -> Result<Self, StoreError> {
        let (streams, newest) = (store.streams().await?, store.newest().await?);
        let live = Live::new(Arc::clone(&clock), &limits, streams, newest);
        Ok(Self(Arc::new(Shared {
            store,
            live,
            clock,
            hosts,
            bodies: Arc::new(Semaphore::new(limits.bodies_bytes_max / ingest::BODY_UNIT)),
            live_clients: Arc::new(Semaphore::new(limits.live_clients_max)),
            stopping: watch::Sender::new(false),
            limits,
        })))
    }

    /// Ends the streams that would not end by themselves.
    pub(crate) fn stop(&self) {
        self.0.stopping.send_replace(true);
    }

    pub(crate) fn limits(&self) -> &Limits {
        &self.0.limits
    }

    pub(crate) fn store(&self) -> &dyn FrameStore {
        &*self.0.store
    }
}

/// Every route.
pub fn app(state: AppState) -> Router {
    let body_bytes_max = state.limits().body_bytes_max;
    let small_body_bytes_max = state.limits().small_body_bytes_max;
    Router::new()
        .route("/", get(assets::page))
        .route("/assets/{name}", get(assets::asset))
        .route("/healthz", get(health))
        .route(
            "/v1/frames",
            post(ingest::frames).layer(DefaultBodyLimit::max(body_bytes_max)),
        )
        .route("/v1/sensors", get(audit::sensors))
        .route("/v1/audit", get(audit::audit))
        .route("/v1/live", get(events::live))
        .route(
            "/v1/recordings",
            get(recordings::list).post(recordings::start),
        )
        .route("/v1/recordings/{id}", get(recordings::one))
        .route("/v1/recordings/{id}/stop", post(recordings::stop))
        .fallback(unknown_path)
        .method_not_allowed_fallback(wrong_method)
        .layer(DefaultBodyLimit::max(small_body_bytes_max))
        .layer(from_fn_with_state(state.clone(), guard::guard))
        .with_state(state)
}

/// Whether the store answers: what a supervisor asks.
async fn health(State(state): State<AppState>) -> Response {
    let version = env!("CARGO_PKG_VERSION");
    match state.store().ping().await {
        Ok(()) => Json(json!({ "status": "ok", "version": version })).into_response(),
        Err(error) => {
            let body =
                json!({ "status": "failing", "version": version, "store": error.to_string() });
            (StatusCode::SERVICE_UNAVAILABLE, Json(body)).into_response()
        }
    }
}

async fn unknown_path() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "unknown_path", "there is nothing at this path")
        .hint("POST /v1/frames, GET /v1/sensors, /v1/live, /v1/audit, /v1/recordings, /healthz, and / for people")
}

async fn wrong_method() -> Refusal {
    Refusal::new(
        StatusCode::METHOD_NOT_ALLOWED,
        "wrong_method",
        "this path does not take that method",
    )
    .hint("the header `allow` names those that it takes")
}
