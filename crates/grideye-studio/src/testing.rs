//! For tests: the collector's own router with these annexes, without a socket.

use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, header};
use grideye_collector::Routes;
use grideye_collector::{Annex, AppState, Clock, Limits, SqliteStore, StoreLocation, app_with};
use serde_json::Value;
use std::sync::Arc;
use tower::ServiceExt as _;

pub(crate) async fn app(annexes: &[Annex], clock: Arc<dyn Clock>) -> Routes {
    let limits = Limits::default();
    let store = SqliteStore::open(&StoreLocation::Memory, &limits).unwrap();
    let state = AppState::new(Arc::new(store), limits, clock).await;
    app_with(state.unwrap(), annexes)
}

/// The status, and the body as JSON, or else as text.
pub(crate) async fn ask(
    app: &Routes,
    method: Method,
    path: &str,
    body: Option<&Value>,
) -> (u16, Value) {
    let request = Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "127.0.0.1:8833")
        .header(header::CONTENT_TYPE, "application/json")
        .body(body.map_or(Body::empty(), |body| Body::from(body.to_string())))
        .unwrap();
    let response = app.clone().oneshot(request).await.unwrap();
    let status = response.status().as_u16();
    let bytes = to_bytes(response.into_body(), 16 << 20).await.unwrap();
    let text = || String::from_utf8_lossy(&bytes).into_owned();
    (
        status,
        serde_json::from_slice(&bytes).unwrap_or_else(|_| text().into()),
    )
}

/// Asserts that an answer's text contains these words.
pub(crate) fn says(said: &Value, words: &str) {
    let said = said.as_str().unwrap();
    assert!(said.contains(words), "{words}: {said}");
}
