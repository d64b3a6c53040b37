//! Every route, as one service that needs no socket: server and tests use it alike.

use crate::http::authorize::Need;
use crate::http::client::Client;
use crate::http::{
    Annex, AppState, Inside, Refusal, audit, devices, events, health, in_own_form, ingest,
    middleware, recent, recordings,
};
use crate::openapi;
use crate::page::{assets, login};
use axum::Router;
use axum::extract::{DefaultBodyLimit, Path, Request};
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::{from_fn_with_state, map_response};
use axum::response::{IntoResponse as _, Json, Response};
use axum::routing::{delete, get, post};
use serde_json::json;
use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};
use tower::Service;

/// Every route of the collector, behind one middleware.
#[derive(Clone)]
pub struct Routes {
    state: AppState,
    router: Router,
}

impl Routes {
    /// A batch of frames bypasses the router, whose boxes and copies would cost a sixth more CPU.
    pub(crate) async fn answer(&self, client: &Client, mut request: Request) -> Response {
        if request.method() == Method::POST && request.uri().path() == "/v1/frames" {
            return middleware::pass(
                &self.state,
                client,
                (Need::Ingest, self.state.limits().handler_time_max),
                request,
                |caller, request| ingest::frames(&self.state, client, caller, request),
            )
            .await;
        }
        request.extensions_mut().insert(client.clone());
        let answered = self.router.clone().call(request).await;
        answered.unwrap_or_else(|never| match never {})
    }
}

impl Service<Request> for Routes {
    type Response = Response;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response, Infallible>> + Send>>;

    fn poll_ready(&mut self, _context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: Request) -> Self::Future {
        let routes = self.clone();
        Box::pin(async move { Ok(routes.answer(&Client::of(&request), request).await) })
    }
}

/// Every route of the collector.
#[must_use]
pub fn app(state: AppState) -> Routes {
    app_with(state, &[])
}

/// Every route of the collector and of the annexes.
///
/// # Panics
/// If an annex has a path of the collector or another annex, or its description is not OpenAPI.
pub fn app_with(state: AppState, annexes: &[Annex]) -> Routes {
    let limits = state.limits();
    let around = |time_max| from_fn_with_state((state.clone(), time_max), middleware::around);
    let slow = brought(&state, annexes.iter().filter(|annex| annex.is_slow));
    let slow = slow
        .method_not_allowed_fallback(wrong_method)
        .layer(around(limits.slow_handler_time_max));
    let quick = brought(&state, annexes.iter().filter(|annex| !annex.is_slow));
    let document = openapi::openapi(annexes);
    let document = ([(header::CONTENT_TYPE, "application/json")], document);
    let (page, parts) = (assets::page(annexes), assets::parts(annexes));
    let names: Vec<&str> = annexes.iter().map(Annex::name).collect();
    let names = Json(json!({ "annexes": names }));
    let router = Router::new()
        .route("/", get(|| async move { page }))
        .route(
            "/assets/{name}",
            get(|Path(name): Path<String>| async move { assets::asset(&parts, &name) }),
        )
        .route("/login", get(login::page))
        .route("/healthz", get(health::alive))
        .route("/metrics", get(health::metrics))
        .route("/v1/health", get(health::health))
        .route("/v1/openapi.json", get(|| async move { document }))
        .route("/v1/login", post(login::login))
        .route("/v1/logout", post(login::logout))
        .route("/v1/whoami", get(login::whoami))
        .route("/v1/annexes", get(|| async move { names }))
        // Posts are answered before the router: this handles the other methods.
        .route("/v1/frames", post(wrong_method))
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
        .route(
            "/v1/recordings/{id}",
            get(recordings::manage::one).delete(recordings::manage::delete),
        )
        .route("/v1/recordings/{id}/renew", post(recordings::manage::renew))
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
        .merge(quick)
        .fallback(unknown_path)
        .method_not_allowed_fallback(wrong_method)
        .layer(around(limits.handler_time_max))
        .merge(slow)
        .with_state(state.clone());
    Routes { state, router }
}

/// The routes of annexes.
fn brought<'a>(state: &AppState, annexes: impl Iterator<Item = &'a Annex>) -> Router<AppState> {
    let inside = Inside::of(state);
    let routes = annexes.map(|annex| annex.routes(&inside));
    let small_body_bytes_max = state.limits().small_body_bytes_max;
    routes
        .fold(Router::new(), Router::merge)
        .layer(DefaultBodyLimit::max(small_body_bytes_max))
        .layer(map_response(in_own_form))
        .layer(from_fn_with_state(state.clone(), middleware::in_shares))
        .with_state(())
}

async fn unknown_path() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "unknown_path", "there is nothing at this path")
        .hint("POST /v1/frames, GET /v1/sensors, /v1/devices, /v1/live, /v1/audit, /v1/recordings, /v1/health, /metrics, /healthz, and / for people")
}

async fn wrong_method(path: Uri) -> Response {
    let mut response = Refusal::new(
        StatusCode::METHOD_NOT_ALLOWED,
        "wrong_method",
        "this path does not take that method",
    )
    .hint("the header `allow` lists the methods it takes")
    .into_response();
    // The route of a recording serves its files too, and they cannot be deleted.
    if path.path().ends_with(".csv") || path.path().ends_with(".frames") {
        let allow = HeaderValue::from_static("GET,HEAD");
        response.headers_mut().insert(header::ALLOW, allow);
    }
    response
}
