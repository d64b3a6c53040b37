//! The program's own routes, behind the collector's router and middleware.

use crate::batches::numbered;
use crate::server::HandClock;
use axum::Router;
use axum::body::Body;
use axum::http::{Method, Request, StatusCode, header};
use axum::response::Json;
use axum::routing::{get, post};
use grideye_collector::Routes;
use grideye_collector::auth::{AccessFolder, Scope};
use grideye_collector::store::StoreLocation;
use grideye_collector::{
    Annex, AppState, Asset, Inside, Limits, Log, Refusal, SqliteStore, app, app_with,
};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;
use tower::ServiceExt;

/// Routes for a sensor's recent frames, the store, an error, and a write.
fn annex() -> Annex {
    Annex::new("test", |inside: &Inside| {
        let inside = inside.clone();
        let recent = inside.recent.clone();
        let seqs = move || async move {
            let found = recent.of("pi-1", "s1");
            let seqs = found.map(|(stream, records)| {
                let seqs: Vec<u64> = records.iter().map(|record| record.seq).collect();
                json!({ "boot": stream.boot, "seqs": seqs })
            });
            Json(seqs)
        };
        let streams = move || async move {
            let streams = inside.store.streams().await.map_or(0, |all| all.len());
            Json(json!(streams))
        };
        let newest = inside.newest.clone();
        let newest = move || async move {
            let newest = newest.look();
            let told = newest.iter().map(|newest| {
                let age_ms = u64::try_from(newest.age.as_millis()).unwrap();
                json!({ "sensor": newest.stream.sensor, "seq": newest.record.seq, "age_ms": age_ms })
            });
            Json(told.collect::<Value>())
        };
        let refused = || async { Refusal::new(StatusCode::CONFLICT, "test_refused", "not now") };
        let own = [(header::CONTENT_SECURITY_POLICY, "sandbox")];
        Router::new()
            .route("/v1/test/policy", get(move || async move { (own, "own") }))
            .route("/v1/test/recent", get(seqs))
            .route("/v1/test/newest", get(newest))
            .route("/v1/test/streams", get(streams))
            .route("/v1/test/refused", get(refused))
            .route("/v1/test/write", post(|| async { "written" }))
    })
}

async fn send(
    router: &Routes,
    method: Method,
    path: &str,
    token: Option<&str>,
    body: Option<Vec<u8>>,
) -> (u16, axum::http::HeaderMap, Value) {
    let mut request = Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "127.0.0.1:8080");
    if let Some(token) = token {
        request = request.header(header::AUTHORIZATION, format!("Bearer {token}"));
    }
    let body = body.map_or_else(Body::empty, Body::from);
    let request = request.body(body).unwrap();
    let response = router.clone().oneshot(request).await.unwrap();
    let (head, body) = response.into_parts();
    let bytes = axum::body::to_bytes(body, 1 << 20).await.unwrap();
    let json = serde_json::from_slice(&bytes).unwrap_or_default();
    (head.status.as_u16(), head.headers, json)
}

async fn open() -> (AppState, Routes, Arc<HandClock>) {
    let limits = Limits::default();
    let store = Arc::new(SqliteStore::open(&StoreLocation::Memory, &limits).unwrap());
    let clock = Arc::new(HandClock::default());
    let state = AppState::new(store, limits, clock.clone()).await.unwrap();
    (state.clone(), app_with(state, &[annex()]), clock)
}

#[tokio::test]
async fn files_that_are_brought_along_are_served_and_the_page_loads_them_before_its_own() {
    const FILES: [Asset; 1] = [Asset {
        name: "test.js",
        kind: "text/javascript; charset=utf-8",
        text: "brought();",
    }];
    let (state, ..) = open().await;
    let script = "<script type=\"module\" src=\"/assets/test.js\"></script>";
    let brought = annex().with_assets(&FILES).on_the_page(script);
    let router = app_with(state, &[brought]);
    let text = async |path: &str| {
        let request = Request::get(path).header(header::HOST, "127.0.0.1:8080");
        let request = request.body(Body::empty()).unwrap();
        let (head, body) = router.clone().oneshot(request).await.unwrap().into_parts();
        assert_eq!(head.headers[header::CACHE_CONTROL], "no-cache");
        let bytes = axum::body::to_bytes(body, 1 << 20).await.unwrap();
        String::from_utf8(bytes.to_vec()).unwrap()
    };
    assert_eq!(text("/assets/test.js").await, "brought();");
    let page = text("/").await;
    let (ours, its_own) = (page.find(script), page.find("/assets/main.js"));
    assert!(ours.is_some() && ours < its_own, "{page}");
}

#[tokio::test]
async fn routes_that_are_brought_along_see_the_store_and_what_has_just_come() {
    let (_state, router, clock) = open().await;
    let get = |path: &'static str| send(&router, Method::GET, path, None, None);
    assert_eq!(get("/v1/annexes").await.2, json!({ "annexes": ["test"] }));
    assert_eq!(get("/v1/test/recent").await.2, Value::Null);
    let frames = Some(numbered(0..3).to_json().unwrap());
    let (status, ..) = send(&router, Method::POST, "/v1/frames", None, frames).await;
    assert_eq!(status, 200);
    let (_, _, recent) = get("/v1/test/recent").await;
    assert_eq!(recent, json!({ "boot": "b1", "seqs": [0, 1, 2] }));
    let newest = async || get("/v1/test/newest").await.2[0].clone();
    let first = newest().await;
    assert_eq!((&first["sensor"], &first["seq"]), (&json!("s1"), &json!(2)));
    clock.pass(Duration::from_secs(7));
    let later = newest().await;
    let age_ms = |newest: &Value| newest["age_ms"].as_u64().unwrap();
    assert_eq!(age_ms(&later), age_ms(&first) + 7_000);
    assert_eq!(get("/v1/test/streams").await.2, json!(1));
    // Without an annex the page gets an empty list.
    let (state, ..) = open().await;
    let (_, _, none) = send(&app(state), Method::GET, "/v1/annexes", None, None).await;
    assert_eq!(none, json!({ "annexes": [] }));
}

#[tokio::test]
async fn annex_routes_pass_the_same_middleware() {
    let around = tempfile::tempdir().unwrap();
    let folder = AccessFolder::new(around.path().join("access"));
    let limits = Limits::default();
    let store = Arc::new(SqliteStore::open(&StoreLocation::Memory, &limits).unwrap());
    let clock = Arc::new(HandClock::default());
    let state = AppState::with_tokens(store, limits, clock.clone(), folder.clone(), Log::silent());
    let router = app_with(state.await.unwrap(), &[annex()]);
    let token = |name: &str, scope: Scope| {
        let token = folder.change(|book| book.add(name, scope, 1)).unwrap();
        clock.pass(Duration::from_secs(60));
        token.reveal()
    };
    let (reader, admin) = (token("ana", Scope::Read), token("bo", Scope::Admin));
    let ask = |method: Method, path: &'static str, token: Option<String>| {
        let router = router.clone();
        async move { send(&router, method, path, token.as_deref(), None).await }
    };
    let streams = "/v1/test/streams";
    assert_eq!(ask(Method::GET, streams, None).await.0, 401);
    let (status, headers, _) = ask(Method::GET, streams, Some(reader.clone())).await;
    assert_eq!(status, 200);
    assert!(headers.contains_key(header::CONTENT_SECURITY_POLICY));
    assert_eq!(headers[header::CACHE_CONTROL], "no-store");
    // Setting its own policy does not skip the other headers.
    let (_, headers, _) = ask(Method::GET, "/v1/test/policy", Some(reader.clone())).await;
    assert_eq!(headers[header::CONTENT_SECURITY_POLICY], "sandbox");
    assert_eq!(headers[header::X_CONTENT_TYPE_OPTIONS], "nosniff");
    assert_eq!(headers[header::X_FRAME_OPTIONS], "DENY");
    let write = "/v1/test/write";
    assert_eq!(ask(Method::POST, write, Some(reader.clone())).await.0, 403);
    assert_eq!(ask(Method::POST, write, Some(admin)).await.0, 200);
    let (status, _, refused) = ask(Method::GET, "/v1/test/refused", Some(reader)).await;
    assert_eq!(
        (status, &refused["error"]["code"]),
        (409, &json!("test_refused"))
    );
}

/// Answers after so many seconds.
fn after(name: &'static str, path: &'static str, seconds: u64) -> Annex {
    let wait = move || async move {
        tokio::time::sleep(Duration::from_secs(seconds)).await;
        "done"
    };
    Annex::new(name, move |_inside| Router::new().route(path, get(wait)))
}

#[tokio::test(start_paused = true)]
async fn a_slow_annex_has_more_time_but_not_for_ever() {
    let (state, ..) = open().await;
    let annexes = [
        after("usual", "/v1/usual", 25),
        after("slow", "/v1/slow", 290),
        after("stuck", "/v1/stuck", 310),
    ];
    let [usual, slow, stuck] = annexes;
    let router = app_with(state, &[usual, slow.slow(), stuck.slow()]);
    let ask = async |method, path| {
        let began = tokio::time::Instant::now();
        let (status, headers, json) = send(&router, method, path, None, None).await;
        assert_eq!(headers[header::X_CONTENT_TYPE_OPTIONS], "nosniff");
        let code = json["error"]["code"].as_str().unwrap_or_default();
        let hint = json["error"]["hint"].as_str().unwrap_or_default();
        let hints = hint.contains("download the CSV and run `grideye convert`");
        (began.elapsed().as_secs(), status, code.to_owned(), hints)
    };
    let too_slow = |seconds| (seconds, 504, "too_slow".to_owned(), true);
    assert_eq!(ask(Method::GET, "/v1/usual").await, too_slow(20));
    let done = (290, 200, String::new(), false);
    assert_eq!(ask(Method::GET, "/v1/slow").await, done);
    assert_eq!(ask(Method::GET, "/v1/stuck").await, too_slow(300));
    let wrong = (0, 405, "wrong_method".to_owned(), false);
    assert_eq!(ask(Method::POST, "/v1/slow").await, wrong);
}
