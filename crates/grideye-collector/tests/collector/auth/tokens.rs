//! What a token allows, and for how long.

use crate::auth::server::{TokenServer, bearer};
use crate::batches::numbered;
use crate::patience::WAIT_MAX;
use axum::http::{Method, StatusCode, header};
use grideye_collector::Limits;
use grideye_collector::auth::{Scope, Token};
use serde_json::json;
use std::time::Duration;
use tokio_stream::StreamExt;

#[tokio::test]
async fn without_a_token_ever_made_everything_is_open() {
    let server = TokenServer::new().await;
    assert_eq!(server.get("/v1/sensors", &[]).await.status, 200);
    assert_eq!(
        server.get("/v1/whoami", &[]).await.json(),
        json!({ "scope": "open" })
    );
    let frames = numbered(0..1).to_json().unwrap();
    let posted = server.send(Method::POST, "/v1/frames", &[], frames).await;
    assert_eq!(posted.status, 200);
}

#[tokio::test]
async fn with_a_token_only_liveness_and_sign_in_stay_open() {
    let server = TokenServer::new().await;
    server.add("page", Scope::Read);
    for (method, path) in [
        (Method::GET, "/"),
        (Method::GET, "/v1/sensors"),
        (Method::GET, "/v1/audit"),
        (Method::GET, "/v1/devices/pi-1"),
        (Method::GET, "/v1/live"),
        (Method::GET, "/v1/health"),
        (Method::GET, "/metrics"),
        (Method::GET, "/v1/whoami"),
        (Method::GET, "/v1/recordings"),
        (Method::GET, "/v1/recordings/1.csv"),
        (Method::GET, "/v1/recordings/1.frames"),
        (Method::GET, "/nowhere"),
        (Method::GET, "/assets/../v1/sensors"),
        (Method::GET, "//v1/sensors"),
        (Method::GET, "/v1//sensors"),
        (Method::GET, "/v1/%73ensors"),
        (Method::GET, "/V1/SENSORS"),
        (Method::GET, "/v1/sensors/"),
        (Method::GET, "/login/../v1/sensors"),
        (Method::GET, "/healthz/"),
        (Method::OPTIONS, "/v1/sensors"),
        (Method::HEAD, "/v1/sensors"),
        (Method::POST, "/v1/frames"),
        (Method::POST, "/v1/recordings"),
        (Method::POST, "/v1/recordings/1/stop"),
        (Method::POST, "/v1/recordings/1/note"),
        (Method::DELETE, "/v1/recordings/1"),
        (Method::PUT, "/healthz/x"),
    ] {
        server.notice();
        let reply = server.send(method.clone(), path, &[], "{}").await;
        assert_eq!(reply.status, 401, "{method} {path}");
        assert_eq!(reply.headers[header::WWW_AUTHENTICATE], "Bearer");
        if method != Method::HEAD {
            assert_eq!(reply.code().1, "no_token", "{path}");
        }
    }
    for path in [
        "/healthz",
        "/login",
        "/assets/login.js",
        "/assets/style.css",
    ] {
        server.notice();
        assert_eq!(server.get(path, &[]).await.status, 200, "{path}");
    }
}

#[tokio::test]
async fn each_scope_opens_its_own_routes() {
    let server = TokenServer::new().await;
    let (pi, read, admin) = (
        server.ingest(&["pi-1"]),
        server.add("read", Scope::Read),
        server.add("admin", Scope::Admin),
    );
    for path in [
        "/",
        "/v1/sensors",
        "/v1/audit",
        "/v1/health",
        "/metrics",
        "/v1/recordings",
    ] {
        let statuses = [
            server.get_as(&pi, path).await.status,
            server.get_as(&read, path).await.status,
            server.get_as(&admin, path).await.status,
        ];
        assert_eq!(statuses, [403, 200, 200], "{path}");
    }
    for (token, status) in [(&pi, 403), (&read, 403), (&admin, 201)] {
        let headers = [("authorization", &*bearer(token))];
        let name = json!({ "name": "kitchen" }).to_string();
        let reply = server
            .send(Method::POST, "/v1/recordings", &headers, name)
            .await;
        assert_eq!(reply.status, status);
    }
    let frames = [
        server.frames_as(&pi, "pi-1").await.code(),
        server.frames_as(&read, "pi-1").await.code(),
        server.frames_as(&admin, "pi-1").await.code(),
    ];
    let wrong = (403, "wrong_scope".to_owned());
    assert_eq!(frames, [(200, String::new()), wrong.clone(), wrong]);
    for (token, scope) in [(&pi, "ingest"), (&read, "read"), (&admin, "admin")] {
        assert_eq!(
            server.get_as(token, "/v1/whoami").await.json()["scope"],
            scope
        );
    }
    let who = server.get_as(&pi, "/v1/whoami").await.json();
    assert_eq!(
        (&who["devices"], &who["signed_in"]),
        (&json!(["pi-1"]), &json!(false))
    );
}

#[tokio::test]
async fn a_token_speaks_for_its_devices_and_for_no_other() {
    let server = TokenServer::new().await;
    let token = server.ingest(&["pi-1", "pi-2"]);
    for device in ["pi-1", "pi-2"] {
        assert_eq!(server.frames_as(&token, device).await.status, 200);
    }
    for device in ["pi-3", "pi-10", "PI-1", "pi-1.x"] {
        let reply = server.frames_as(&token, device).await;
        assert_eq!(reply.code(), (403, "foreign_device".to_owned()), "{device}");
        assert_eq!(reply.json()["error"]["field"], "device");
    }
    let own = server.get_as(&token, "/v1/devices/pi-1").await;
    assert_eq!(
        (own.status, &own.json()["device"]),
        (200, &json!("pi-1")),
        "its own state"
    );
    let another = server.ingest(&["pi-9"]);
    for device in ["pi-1", "pi-7"] {
        let path = format!("/v1/devices/{device}");
        let reply = server.get_as(&another, &path).await;
        assert_eq!(reply.code(), (403, "foreign_device".to_owned()), "{device}");
    }
    let read = server.add("read", Scope::Read);
    assert_eq!(
        server.get_as(&read, "/v1/devices/pi-1").await.json()["device"],
        "pi-1"
    );
    let admin = server.add("admin", Scope::Admin);
    let streams = server.get_as(&admin, "/v1/audit").await.json();
    assert_eq!(streams["streams"].as_array().unwrap().len(), 2);
}

#[tokio::test]
async fn a_revoked_token_ends_within_the_time_that_the_limits_name() {
    let limits = Limits {
        tokens_reread_every: Duration::from_secs(1),
        ..Limits::default()
    };
    let server = TokenServer::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let cookie = server.login(&token.reveal()).await.cookie();
    assert_eq!(server.get_as(&token, "/v1/sensors").await.status, 200);
    server.folder.change(|book| book.revoke("ana", 2)).unwrap();
    server.clock.pass(Duration::from_secs(1));
    assert_eq!(
        server.get_as(&token, "/v1/sensors").await.code(),
        (401, "bad_token".to_owned())
    );
    let by_cookie = server.get("/v1/sensors", &[("cookie", &cookie)]).await;
    assert_eq!(by_cookie.code(), (401, "signed_out".to_owned()));
}

#[tokio::test]
async fn a_stream_of_events_ends_with_its_token() {
    let limits = Limits {
        live_keep_alive: Duration::from_millis(20),
        ..Limits::default()
    };
    let server = TokenServer::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let bearer = bearer(&token);
    let headers = [("authorization", &*bearer)];
    let follow = async {
        let live = server.open(Method::GET, "/v1/live", &headers, "").await;
        let mut events = live.into_body().into_data_stream();
        let mut text = Vec::new();
        // However late a busy host is, the token ends after the first event.
        while !String::from_utf8_lossy(&text).contains("event: alive") {
            text.extend(events.next().await.expect("an event").unwrap());
        }
        server.folder.change(|book| book.revoke("ana", 2)).unwrap();
        server.notice();
        while events.next().await.is_some() {}
    };
    tokio::time::timeout(WAIT_MAX, follow)
        .await
        .expect("the stream goes on");
}

#[tokio::test]
async fn a_nearly_valid_token_is_rejected() {
    let server = TokenServer::new().await;
    let token = server.add("ana", Scope::Read);
    let text = token.reveal();
    let refused = [
        format!("Basic {text}"),
        text.clone(),
        "Bearer".to_owned(),
        "Bearer ".to_owned(),
        format!("Bearer {}", text.to_uppercase()),
        format!("Bearer {text}0"),
        format!("Bearer {}", &text[..text.len() - 1]),
        format!("Bearer {text}, {text}"),
        format!("Bearer grideye-{}-{}", token.id(), "0".repeat(64)),
    ];
    for shown in &refused {
        server.notice();
        let reply = server.get("/v1/sensors", &[("authorization", shown)]).await;
        assert_eq!(reply.code(), (401, "bad_token".to_owned()), "{shown}");
    }
    let both = [
        ("authorization", &*bearer(&token)),
        ("authorization", "Bearer x"),
    ];
    assert_eq!(server.get("/v1/sensors", &both).await.status, 401);
    for good in [
        bearer(&token),
        format!("bearer {text}"),
        format!("BEARER  {text}"),
    ] {
        assert_eq!(
            server
                .get("/v1/sensors", &[("authorization", &good)])
                .await
                .status,
            200
        );
    }
    // Not in the URL, which ends up in logs and histories.
    let path = format!("/v1/sensors?token={text}&access_token={text}");
    assert_eq!(server.get(&path, &[]).await.status, 401);
}

#[tokio::test]
async fn a_token_is_good_as_soon_as_it_is_made() {
    let server = TokenServer::new().await;
    let first = server.add("ana", Scope::Read);
    assert_eq!(server.get_as(&first, "/v1/sensors").await.status, 200);
    // No time passes: before rejecting a caller, the collector rereads the list.
    let second = server
        .folder
        .change(|book| book.add("ben", Scope::Read, 1))
        .unwrap();
    assert_eq!(server.get_as(&second, "/v1/sensors").await.status, 200);
    let stranger = Token::random().unwrap();
    assert_eq!(server.get_as(&stranger, "/v1/sensors").await.status, 401);
}

#[tokio::test]
async fn a_folder_that_breaks_admits_nobody_new_and_is_reported() {
    let server = TokenServer::new().await;
    // Whether or not the list was read before it broke.
    let unread = TokenServer::new().await;
    unread.add("ana", Scope::Read);
    std::fs::write(unread.folder.path().join("tokens.json"), b"{}").unwrap();
    assert_eq!(unread.get("/v1/sensors", &[]).await.status, 401);
    let token = server.add("ana", Scope::Read);
    assert_eq!(server.get_as(&token, "/v1/sensors").await.status, 200);
    std::fs::write(server.folder.path().join("tokens.json"), b"{}").unwrap();
    server.notice();
    assert_eq!(
        server.get("/v1/sensors", &[]).await.status,
        StatusCode::UNAUTHORIZED
    );
    let health = server.get_as(&token, "/v1/health").await.json();
    let fault = health["access"]["fault"].as_str().unwrap();
    assert!(fault.contains("tokens.json: "), "{fault}");
}
