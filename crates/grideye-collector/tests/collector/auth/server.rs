//! A collector with a folder of tokens, behind its router.

use crate::batches::{batch, frame, part};
use crate::server::HandClock;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Method, Request, header};
use axum::response::Response;
use grideye_collector::Routes;
use grideye_collector::auth::{AccessFolder, Scope, Token};
use grideye_collector::store::StoreLocation;
use grideye_collector::{AppState, Limits, Log, SqliteStore, app};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tower::ServiceExt;

pub(super) const HTML: (&str, &str) = ("accept", "text/html,application/xhtml+xml");
pub(super) const ORIGIN: (&str, &str) = ("origin", "http://127.0.0.1:8080");

/// A collector with a folder of tokens, and its log.
pub(super) struct TokenServer {
    pub(super) router: Routes,
    pub(super) clock: Arc<HandClock>,
    pub(super) folder: AccessFolder,
    pub(super) said: Arc<Mutex<Vec<String>>>,
    _around: tempfile::TempDir,
}

pub(super) struct Reply {
    pub(super) status: u16,
    pub(super) headers: HeaderMap,
    pub(super) body: Bytes,
}

impl Reply {
    pub(super) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_default()
    }

    pub(super) fn code(&self) -> (u16, String) {
        let code = self.json()["error"]["code"].as_str().map(str::to_owned);
        (self.status, code.unwrap_or_default())
    }

    /// The cookie it sets, as a browser returns it.
    pub(super) fn cookie(&self) -> String {
        let set = self.headers[header::SET_COOKIE].to_str().unwrap();
        set.split(';').next().unwrap().to_owned()
    }
}

impl TokenServer {
    pub(super) async fn new() -> Self {
        Self::with(Limits::default()).await
    }

    pub(super) async fn with(limits: Limits) -> Self {
        let around = tempfile::tempdir().unwrap();
        let folder = AccessFolder::new(around.path().join("access"));
        let said = Arc::new(Mutex::new(Vec::new()));
        let sink = Arc::clone(&said);
        let log = Log::new(move |event| {
            let lines = [event.to_string(), event.to_json()];
            sink.lock().unwrap().extend(lines);
        });
        let clock = Arc::new(HandClock::default());
        let store = Arc::new(SqliteStore::open(&StoreLocation::Memory, &limits).unwrap());
        let state = AppState::with_tokens(store, limits, clock.clone(), folder.clone(), log)
            .await
            .unwrap();
        Self {
            router: app(state),
            clock,
            folder,
            said,
            _around: around,
        }
    }

    pub(super) fn add(&self, name: &str, scope: Scope) -> Token {
        let token = self.folder.change(|book| book.add(name, scope, 1)).unwrap();
        self.notice();
        token
    }

    pub(super) fn ingest(&self, devices: &[&str]) -> Token {
        let all = devices.iter().map(|device| (*device).to_owned()).collect();
        self.add(devices[0], Scope::Ingest { devices: all })
    }

    /// Lets enough time pass for the token list to be reread and for all rate limits to recover.
    pub(super) fn notice(&self) {
        self.clock.pass(Duration::from_secs(60));
    }

    pub(super) async fn send(
        &self,
        method: Method,
        path: &str,
        headers: &[(&str, &str)],
        body: impl Into<Body>,
    ) -> Reply {
        let (parts, body) = self.open(method, path, headers, body).await.into_parts();
        Reply {
            status: parts.status.as_u16(),
            headers: parts.headers,
            body: axum::body::to_bytes(body, 1 << 26).await.unwrap(),
        }
    }

    /// The answer before its body has ended.
    pub(super) async fn open(
        &self,
        method: Method,
        path: &str,
        headers: &[(&str, &str)],
        body: impl Into<Body>,
    ) -> Response {
        let mut request = Request::builder()
            .method(method)
            .uri(path)
            .header(header::HOST, "127.0.0.1:8080");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(body.into()).unwrap();
        self.router.clone().oneshot(request).await.unwrap()
    }

    pub(super) async fn get(&self, path: &str, headers: &[(&str, &str)]) -> Reply {
        self.send(Method::GET, path, headers, Body::empty()).await
    }

    pub(super) async fn get_as(&self, token: &Token, path: &str) -> Reply {
        self.get(path, &[("authorization", &bearer(token))]).await
    }

    pub(super) async fn frames_as(&self, token: &Token, device: &str) -> Reply {
        let frames = batch(device, "b1", vec![part("s1", vec![frame(1)])]);
        let headers = [("authorization", &*bearer(token))];
        self.send(
            Method::POST,
            "/v1/frames",
            &headers,
            frames.to_json().unwrap(),
        )
        .await
    }

    pub(super) async fn login(&self, token: &str) -> Reply {
        let body = json!({ "token": token }).to_string();
        self.send(Method::POST, "/v1/login", &[ORIGIN], body).await
    }
}

pub(super) fn bearer(token: &Token) -> String {
    format!("Bearer {}", token.reveal())
}
