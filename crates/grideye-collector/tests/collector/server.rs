//! A collector behind its router, without a socket, and a clock under the test's control.

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Method, Request, StatusCode, header};
use grideye_collector::Routes;
use grideye_collector::store::StoreLocation;
use grideye_collector::{AppState, Clock, Limits, SqliteStore, app};
use grideye_recording::wire::Batch;
use serde_json::Value;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tower::ServiceExt;

/// The start of the tests: 2021-07-01 18:07:27 UTC, by the frames' wall clocks.
pub(crate) const START_UTC_NS: i64 = 1_625_163_247_000_000_000;

/// A clock that stands still unless advanced.
#[derive(Default)]
pub(crate) struct HandClock(AtomicU64);

impl HandClock {
    pub(crate) fn pass(&self, time: Duration) {
        let ms = u64::try_from(time.as_millis()).unwrap();
        self.0.fetch_add(ms, Ordering::SeqCst);
    }
}

impl Clock for HandClock {
    fn utc_ns(&self) -> i64 {
        START_UTC_NS + i64::try_from(self.monotonic().as_nanos()).unwrap()
    }

    fn monotonic(&self) -> Duration {
        Duration::from_millis(self.0.load(Ordering::SeqCst))
    }
}

pub(crate) struct Server {
    pub(crate) router: Routes,
    pub(crate) clock: Arc<HandClock>,
    pub(crate) store: Arc<SqliteStore>,
}

pub(crate) struct Reply {
    pub(crate) status: StatusCode,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Bytes,
}

impl Reply {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    /// Status, code and field of an error, after checking its form.
    #[track_caller]
    pub(crate) fn error(&self) -> (u16, String, Option<String>) {
        let json = self.json();
        let error = json["error"].as_object().unwrap();
        let keys: Vec<_> = error.keys().map(String::as_str).collect();
        assert_eq!(keys, ["code", "field", "hint", "message"]);
        let message = error["message"].as_str().unwrap();
        assert!(
            !message.is_empty() && !message.contains("hint: "),
            "{message}"
        );
        let text = |key: &str| error[key].as_str().map(ToOwned::to_owned);
        (self.status.as_u16(), text("code").unwrap(), text("field"))
    }
}

impl Server {
    pub(crate) async fn new() -> Self {
        Self::with(Limits::default()).await
    }

    pub(crate) async fn with(limits: Limits) -> Self {
        let store = Arc::new(SqliteStore::open(&StoreLocation::Memory, &limits).unwrap());
        Self::on(store, limits).await
    }

    pub(crate) async fn on(store: Arc<SqliteStore>, limits: Limits) -> Self {
        let clock = Arc::new(HandClock::default());
        let state = AppState::new(store.clone(), limits, clock.clone())
            .await
            .unwrap();
        Self {
            router: app(state),
            clock,
            store,
        }
    }

    pub(crate) async fn send(&self, request: Request<Body>) -> Reply {
        let response = self.router.clone().oneshot(request).await.unwrap();
        let (parts, body) = response.into_parts();
        let body = axum::body::to_bytes(body, 1 << 26).await.unwrap();
        Reply {
            status: parts.status,
            headers: parts.headers,
            body,
        }
    }

    pub(crate) async fn get(&self, path: &str) -> Reply {
        self.send(request(Method::GET, path, Body::empty())).await
    }

    pub(crate) async fn post(&self, path: &str, body: impl Into<Body>) -> Reply {
        self.send(request(Method::POST, path, body.into())).await
    }

    pub(crate) async fn delete(&self, path: &str) -> Reply {
        self.send(request(Method::DELETE, path, Body::empty()))
            .await
    }

    pub(crate) async fn frames(&self, batch: &Batch) -> Reply {
        self.post("/v1/frames", batch.to_json().unwrap()).await
    }

    /// The only sensor.
    pub(crate) async fn sensor(&self) -> Value {
        self.get("/v1/sensors").await.json()["sensors"][0].clone()
    }

    pub(crate) async fn streams(&self) -> usize {
        self.get("/v1/audit").await.json()["streams"]
            .as_array()
            .unwrap()
            .len()
    }
}

pub(crate) fn request(method: Method, path: &str, body: Body) -> Request<Body> {
    Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "127.0.0.1:8080")
        .header(header::CONTENT_TYPE, "application/json")
        .body(body)
        .unwrap()
}
