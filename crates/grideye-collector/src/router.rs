//! Every route, as a router that needs no socket.

use crate::alarm::Alarm;
use crate::connections::Connection;
use crate::http::audit;
use crate::http::authorize::Line;
use crate::http::devices;
use crate::http::events;
use crate::http::health;
use crate::http::ingest;
use crate::http::middleware;
use crate::http::recent;
use crate::http::recordings;
use crate::http::{Annex, AppState, Refusal, in_own_form};
use crate::openapi;
use crate::page::assets;
use crate::page::login;
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
use std::sync::Arc;
use tower::ServiceExt as _;

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
    let brought = brought.layer(map_response(in_own_form));
    let document = openapi::openapi(annexes);
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
            get(recordings::manage::list).post(recordings::manage::start),
        )
        .route("/v1/recordings/{id}", get(recordings::manage::one))
        .route("/v1/recordings/{id}/stop", post(recordings::manage::stop))
        .route("/v1/recordings/{id}/note", post(recordings::manage::note))
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
        .layer(from_fn_with_state(state.clone(), middleware::guard))
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
