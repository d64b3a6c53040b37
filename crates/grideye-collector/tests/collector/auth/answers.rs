//! Rate limits, and what responses, logs and figures reveal.

use crate::auth::server::{HTML, TokenServer, bearer};
use crate::batches::{batch, frame, part};
use axum::http::{HeaderMap, Method, header};
use grideye_collector::Limits;
use grideye_collector::auth::{Scope, Token};
use serde_json::{Value, json};
use std::time::Duration;

#[tokio::test]
async fn more_requests_than_a_token_may_make_wait_as_long_as_they_are_told() {
    let limits = Limits {
        requests_per_second_max: 2,
        requests_burst_max: 5,
        ..Limits::default()
    };
    let server = TokenServer::with(limits).await;
    let (one, other) = (
        server.add("one", Scope::Read),
        server.add("other", Scope::Read),
    );
    let mut statuses = Vec::new();
    for _ in 0..7 {
        statuses.push(server.get_as(&one, "/v1/sensors").await.status);
    }
    assert_eq!(statuses, [200, 200, 200, 200, 200, 429, 429]);
    let refused = server.get_as(&one, "/v1/sensors").await;
    assert_eq!(refused.code(), (429, "too_many_requests".to_owned()));
    assert_eq!(refused.headers[header::RETRY_AFTER], "1");
    assert_eq!(
        server.get_as(&other, "/v1/sensors").await.status,
        200,
        "no other token is limited"
    );
    server.clock.pass(Duration::from_millis(1000));
    let after = [(); 3].map(|()| server.get_as(&one, "/v1/sensors"));
    let mut statuses = Vec::new();
    for request in after {
        statuses.push(request.await.status);
    }
    assert_eq!(statuses, [200, 200, 429]);
}

#[tokio::test]
async fn guessing_is_rate_limited_and_valid_tokens_are_not() {
    let limits = Limits {
        unknown_requests_per_second_max: 1,
        unknown_requests_burst_max: 3,
        ..Limits::default()
    };
    let server = TokenServer::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let guess = || async {
        let shown = Token::random().unwrap();
        server.get_as(&shown, "/v1/sensors").await.status
    };
    assert_eq!([guess().await, guess().await, guess().await], [401; 3]);
    assert_eq!([guess().await, guess().await], [429; 2]);
    assert_eq!(server.login("x").await.status, 429);
    // Requests that need no token are counted apart from them.
    for status in [200, 200, 200, 429] {
        assert_eq!(server.get("/healthz", &[]).await.status, status);
    }
    // From the same address.
    assert_eq!(server.get_as(&token, "/v1/sensors").await.status, 200);
    assert_eq!(server.get_as(&token, "/healthz").await.status, 200);
    server.clock.pass(Duration::from_secs(1));
    assert_eq!([guess().await, guess().await], [401, 429]);
}

#[tokio::test]
async fn no_response_or_log_contains_a_secret() {
    let server = TokenServer::new().await;
    let (pi, ana) = (server.ingest(&["pi-1"]), server.add("ana", Scope::Admin));
    let cookie = server.login(&ana.reveal()).await.cookie();
    server.frames_as(&pi, "pi-2").await;
    server.get_as(&pi, "/v1/sensors").await;
    server.login(&pi.reveal()).await;
    server.get(&format!("/{}", ana.reveal()), &[]).await;
    server
        .get(
            "/v1/sensors",
            &[("authorization", &format!("{}x", bearer(&ana)))],
        )
        .await;
    server.folder.change(|book| book.revoke("ana", 2)).unwrap();
    server.notice();
    server.get("/v1/sensors", &[("cookie", &cookie)]).await;
    server.clock.pass(Duration::from_secs(1));
    let revoked = server.get_as(&ana, "/v1/sensors").await.json();
    assert_eq!(revoked["error"]["message"], "this token was revoked");
    let said = server.said.lock().unwrap().join("\n");
    assert!(
        said.contains("refused code=foreign_device") && said.contains("code=bad_token"),
        "{said}"
    );
    // The holder of a token is named by its number and name, also of one that was revoked; a guess names nobody.
    for (code, token, name) in [
        ("foreign_device", &pi, "pi-1"),
        ("wrong_scope", &pi, "pi-1"),
        ("bad_token", &ana, "ana"),
    ] {
        let line = format!("refused code={code} status=40");
        let by = format!(" token={} name={name}", token.id());
        let mut lines = said.lines().filter(|said| said.contains(&line));
        assert!(lines.any(|said| said.contains(&by)), "{by} in {said}");
    }
    let named = |said: &&str| said.contains("code=bad_token") && said.contains(" token=");
    assert_eq!(said.lines().filter(named).count(), 1, "{said}");
    let session = cookie.rsplit('.').next().unwrap().to_owned();
    for secret in [pi.reveal(), ana.reveal(), session] {
        let secret = secret.rsplit('-').next().unwrap();
        assert!(!said.contains(secret), "{said}");
    }
    for line in said.lines().filter(|line| line.starts_with('{')) {
        let json: Value = serde_json::from_str(line).unwrap();
        assert!(json["event"].is_string() && json["level"].is_string());
    }
}

#[tokio::test]
async fn every_answer_has_the_headers_that_browsers_hold_to() {
    let server = TokenServer::new().await;
    let token = server.add("ana", Scope::Read);
    for (path, status) in [
        ("/", 200),
        ("/v1/sensors", 200),
        ("/nowhere", 404),
        ("/metrics", 200),
        ("/assets/main.js", 200),
    ] {
        let reply = server.get_as(&token, path).await;
        assert_eq!(reply.status, status);
        assert_headers(&reply.headers, path);
    }
    assert_headers(&server.get("/v1/sensors", &[]).await.headers, "refused");
    assert_headers(&server.get("/", &[HTML]).await.headers, "sent to sign in");
    assert_headers(
        &server.get("/login", &[]).await.headers,
        "the page for signing in",
    );
}

fn assert_headers(headers: &HeaderMap, what: &str) {
    let policy = headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
    assert!(policy.starts_with("default-src 'none';"), "{what}");
    assert!(
        !policy.contains("unsafe-inline") && !policy.contains('*'),
        "{what}: {policy}"
    );
    for (name, value) in [
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("x-frame-options", "DENY"),
        ("cross-origin-resource-policy", "same-origin"),
        ("cross-origin-opener-policy", "same-origin"),
    ] {
        assert_eq!(headers[name], value, "{what}");
    }
    assert!(headers.contains_key(header::CACHE_CONTROL), "{what}");
    assert!(
        !headers.contains_key(header::ACCESS_CONTROL_ALLOW_ORIGIN),
        "{what}"
    );
    assert!(!headers.contains_key(header::SERVER), "{what}");
}

#[tokio::test]
async fn health_and_metrics_count_what_happened_and_name_no_secret() {
    let server = TokenServer::new().await;
    let (pi, read) = (server.ingest(&["pi-1"]), server.add("ana", Scope::Read));
    server.frames_as(&pi, "pi-1").await;
    server.frames_as(&pi, "pi-1").await;
    server.frames_as(&pi, "pi-9").await;
    let health = server.get_as(&read, "/v1/health").await;
    assert_eq!(health.status, 200);
    let json = health.json();
    assert_eq!(json["status"], "ok");
    assert_eq!(json["frames"], json!({ "stored": 1, "again": 1 }));
    assert_eq!(json["refused"], json!({ "foreign_device": 1 }));
    assert_eq!(
        (&json["sensors"], &json["live_clients"]),
        (&json!(1), &json!(0))
    );
    assert_eq!(
        json["access"],
        json!({ "asks_for_tokens": true, "fault": null })
    );
    assert!(json["store"]["bytes"].as_u64().unwrap() > 0);
    let metrics = server.get_as(&read, "/metrics").await;
    assert_eq!(
        metrics.headers[header::CONTENT_TYPE],
        "text/plain; version=0.0.4; charset=utf-8"
    );
    let text = String::from_utf8(metrics.body.to_vec()).unwrap();
    for line in [
        "grideye_frames_stored_total 1",
        "grideye_frames_again_total 1",
        "grideye_refused_total{code=\"foreign_device\"} 1",
        "grideye_sensor_stored_total{device=\"pi-1\",sensor=\"s1\"} 1",
        "grideye_asks_for_tokens 1",
        "grideye_store_up 1",
    ] {
        assert!(text.lines().any(|found| found == line), "{line} in\n{text}");
    }
    for token in [&pi, &read] {
        assert!(!text.contains(&token.id().to_string()));
    }
}

#[tokio::test]
async fn too_many_boots_of_one_token_cost_no_other_one_anything() {
    let server = TokenServer::new().await;
    let (hostile, good) = (server.ingest(&["pi-1"]), server.ingest(&["pi-2"]));
    let post = async |token: &Token, device: &str, boot: usize| {
        let sensors = (0..32).map(|sensor| part(&format!("s{sensor}"), vec![frame(0)]));
        let batch = batch(device, &format!("b{boot}"), sensors.collect());
        let bearer = format!("Bearer {}", token.reveal());
        let headers = [("authorization", &*bearer)];
        let body = batch.to_json().unwrap();
        server
            .send(Method::POST, "/v1/frames", &headers, body)
            .await
            .code()
    };
    for boot in 0..128 {
        assert_eq!(post(&hostile, "pi-1", boot).await.0, 200, "{boot}");
    }
    let refused = post(&hostile, "pi-1", 128).await;
    assert_eq!(refused, (429, "too_many_boots".to_owned()));
    assert_eq!(post(&good, "pi-2", 0).await.0, 200);
}

#[tokio::test]
async fn live_pages_of_one_token_leave_room_for_those_of_others() {
    let server = TokenServer::new().await;
    let (hostile, good) = (server.add("a", Scope::Read), server.add("b", Scope::Read));
    let follow = async |token: &Token| {
        server.clock.pass(Duration::from_millis(10));
        let bearer = bearer(token);
        let headers = [("authorization", &*bearer)];
        server.open(Method::GET, "/v1/live", &headers, "").await
    };
    let mut open = Vec::new();
    let refused = loop {
        let answer = follow(&hostile).await;
        if answer.status() != 200 {
            break answer.status();
        }
        open.push(answer);
        assert!(open.len() <= 64);
    };
    assert_eq!((open.len(), refused.as_u16()), (64, 503));
    for _ in 0..10 {
        let answer = follow(&good).await;
        assert_eq!(answer.status(), 200);
        open.push(answer);
    }
}
