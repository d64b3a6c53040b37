//! Who may do what, through the router: tokens, scopes, the page's cookie, and how often.

use crate::batches::{batch, frame, numbered, part};
use crate::http::HandClock;
use axum::Router;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Method, Request, StatusCode, header};
use grideye_collector::auth::{AccessFolder, Scope, Token};
use grideye_collector::store::StoreLocation;
use grideye_collector::{AppState, Limits, Log, SqliteStore, app};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tower::ServiceExt;

const HTML: (&str, &str) = ("accept", "text/html,application/xhtml+xml");
const ORIGIN: (&str, &str) = ("origin", "http://127.0.0.1:8080");

/// A collector with a folder of tokens, and everything that it said.
struct Guarded {
    router: Router,
    clock: Arc<HandClock>,
    folder: AccessFolder,
    said: Arc<Mutex<Vec<String>>>,
    _around: tempfile::TempDir,
}

struct Reply {
    status: u16,
    headers: HeaderMap,
    body: Bytes,
}

impl Reply {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_default()
    }

    fn code(&self) -> (u16, String) {
        let code = self.json()["error"]["code"].as_str().map(str::to_owned);
        (self.status, code.unwrap_or_default())
    }

    /// The cookie that it sets, as a browser sends it back.
    fn cookie(&self) -> String {
        let set = self.headers[header::SET_COOKIE].to_str().unwrap();
        set.split(';').next().unwrap().to_owned()
    }
}

impl Guarded {
    async fn new() -> Self {
        Self::with(Limits::default()).await
    }

    async fn with(limits: Limits) -> Self {
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
        let state = AppState::guarded(store, limits, clock.clone(), folder.clone(), log)
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

    fn add(&self, name: &str, scope: Scope) -> Token {
        let token = self.folder.change(|book| book.add(name, scope, 1)).unwrap();
        self.notice();
        token
    }

    fn ingest(&self, devices: &[&str]) -> Token {
        let all = devices.iter().map(|device| (*device).to_owned()).collect();
        self.add(devices[0], Scope::Ingest { devices: all })
    }

    /// Lets the time pass after which the list of tokens is read again, and full buckets are full again.
    fn notice(&self) {
        self.clock.pass(Duration::from_secs(60));
    }

    async fn send(
        &self,
        method: Method,
        path: &str,
        headers: &[(&str, &str)],
        body: impl Into<Body>,
    ) -> Reply {
        let mut request = Request::builder()
            .method(method)
            .uri(path)
            .header(header::HOST, "127.0.0.1:8080");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(body.into()).unwrap();
        let response = self.router.clone().oneshot(request).await.unwrap();
        let (parts, body) = response.into_parts();
        Reply {
            status: parts.status.as_u16(),
            headers: parts.headers,
            body: axum::body::to_bytes(body, 1 << 26).await.unwrap(),
        }
    }

    async fn get(&self, path: &str, headers: &[(&str, &str)]) -> Reply {
        self.send(Method::GET, path, headers, Body::empty()).await
    }

    async fn get_as(&self, token: &Token, path: &str) -> Reply {
        self.get(path, &[("authorization", &bearer(token))]).await
    }

    async fn frames_as(&self, token: &Token, device: &str) -> Reply {
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

    async fn login(&self, token: &str) -> Reply {
        let body = json!({ "token": token }).to_string();
        self.send(Method::POST, "/v1/login", &[ORIGIN], body).await
    }
}

fn bearer(token: &Token) -> String {
    format!("Bearer {}", token.reveal())
}

#[tokio::test]
async fn without_a_token_ever_made_everything_is_open() {
    let server = Guarded::new().await;
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
async fn with_the_first_token_nothing_is_open_but_life_and_the_door() {
    let server = Guarded::new().await;
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
async fn each_scope_opens_its_own_doors() {
    let server = Guarded::new().await;
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
    let server = Guarded::new().await;
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
    let server = Guarded::with(limits).await;
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
    let server = Guarded::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let follow = async {
        let reply = server.get_as(&token, "/v1/live").await;
        assert!(String::from_utf8_lossy(&reply.body).contains("event: alive"));
    };
    let revoke = async {
        tokio::time::sleep(Duration::from_millis(200)).await;
        server.folder.change(|book| book.revoke("ana", 2)).unwrap();
        server.notice();
    };
    let both = async { tokio::join!(follow, revoke) };
    tokio::time::timeout(Duration::from_secs(20), both)
        .await
        .expect("the stream goes on");
}

#[tokio::test]
async fn what_is_nearly_a_token_is_none() {
    let server = Guarded::new().await;
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
    // Not by the address, where logs and histories keep it.
    let path = format!("/v1/sensors?token={text}&access_token={text}");
    assert_eq!(server.get(&path, &[]).await.status, 401);
}

#[tokio::test]
async fn signing_in_gives_a_cookie_that_no_script_reads_and_no_other_site_sends() {
    let server = Guarded::new().await;
    let token = server.add("ana", Scope::Admin);
    let reply = server.login(&format!(" {} \n", token.reveal())).await;
    assert_eq!(reply.status, 204);
    let set = reply.headers[header::SET_COOKIE].to_str().unwrap();
    for part in ["Path=/", "HttpOnly", "SameSite=Strict", "Max-Age=43200"] {
        assert!(set.split("; ").any(|found| found == part), "{set}");
    }
    assert!(
        !set.contains("Secure") && !set.contains("Domain"),
        "plain HTTP here: {set}"
    );
    let secret = token.reveal().rsplit('-').next().unwrap().to_owned();
    assert!(!set.contains(&secret), "the cookie must not hold the token");
    let cookie = reply.cookie();
    let who = server
        .get("/v1/whoami", &[("cookie", &cookie)])
        .await
        .json();
    assert_eq!(
        (&who["scope"], &who["signed_in"]),
        (&json!("admin"), &json!(true))
    );
    assert_eq!(
        server.get("/", &[("cookie", &cookie), HTML]).await.status,
        200
    );

    let name = || json!({ "name": "evening" }).to_string();
    let post = |headers: Vec<(&'static str, String)>| {
        let (server, cookie) = (&server, cookie.clone());
        async move {
            let mut all = vec![("cookie", cookie)];
            all.extend(headers);
            let all: Vec<(&str, &str)> =
                all.iter().map(|(name, value)| (*name, &**value)).collect();
            server
                .send(Method::POST, "/v1/recordings", &all, name())
                .await
                .code()
        }
    };
    assert_eq!(post(vec![]).await, (403, "no_origin".to_owned()));
    let foreign = vec![("origin", "http://evil.example".to_owned())];
    assert_eq!(post(foreign).await, (403, "foreign_origin".to_owned()));
    let null = vec![("origin", "null".to_owned())];
    assert_eq!(post(null).await, (403, "foreign_origin".to_owned()));
    assert_eq!(post(vec![("origin", ORIGIN.1.to_owned())]).await.0, 201);

    let gone = server
        .send(
            Method::POST,
            "/v1/logout",
            &[("cookie", &cookie), ORIGIN],
            "",
        )
        .await;
    assert_eq!(gone.status, 204);
    let set = gone.headers[header::SET_COOKIE].to_str().unwrap();
    assert!(
        set.starts_with("grideye-session=;") && set.contains("Max-Age=0"),
        "{set}"
    );
}

#[tokio::test]
async fn a_cookie_ends_after_its_time() {
    let limits = Limits {
        session_time_max: Duration::from_secs(3600),
        ..Limits::default()
    };
    let server = Guarded::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let cookie = server.login(&token.reveal()).await.cookie();
    server.clock.pass(Duration::from_secs(3599));
    assert_eq!(
        server
            .get("/v1/sensors", &[("cookie", &cookie)])
            .await
            .status,
        200
    );
    server.clock.pass(Duration::from_secs(1));
    assert_eq!(
        server
            .get("/v1/sensors", &[("cookie", &cookie)])
            .await
            .status,
        401
    );
}

#[tokio::test]
async fn who_may_not_sign_in_is_told_why_and_gets_no_cookie() {
    let server = Guarded::new().await;
    let pi = server.ingest(&["pi-1"]);
    let bad = format!("{}0", pi.reveal());
    for (body, status, code) in [
        (
            json!({ "token": pi.reveal() }).to_string(),
            403,
            "wrong_scope",
        ),
        (json!({ "token": bad }).to_string(), 401, "bad_token"),
        (json!({ "token": "" }).to_string(), 401, "bad_token"),
        (json!({ "token": 1 }).to_string(), 422, "wrong_value"),
        (json!({}).to_string(), 422, "wrong_value"),
        (
            json!({ "token": "x", "next": "//evil" }).to_string(),
            422,
            "wrong_value",
        ),
        ("[1]".to_owned(), 422, "wrong_value"),
        ("{".to_owned(), 400, "not_json"),
        (format!("{{\"token\":{}", "[".repeat(9)), 400, "too_deep"),
    ] {
        server.notice();
        let reply = server
            .send(Method::POST, "/v1/login", &[ORIGIN], body.clone())
            .await;
        assert_eq!(reply.code(), (status, code.to_owned()), "{body}");
        assert!(reply.headers.get(header::SET_COOKIE).is_none());
        let secret = pi.reveal().rsplit('-').next().unwrap().to_owned();
        assert!(!String::from_utf8_lossy(&reply.body).contains(&secret));
    }
}

#[tokio::test]
async fn a_person_is_led_to_the_door_and_a_program_is_told() {
    let server = Guarded::new().await;
    server.add("ana", Scope::Read);
    let person = server.get("/", &[HTML]).await;
    assert_eq!(
        (person.status, person.headers[header::LOCATION].as_bytes()),
        (303, &b"/login"[..])
    );
    assert_eq!(server.get("/", &[("accept", "*/*")]).await.status, 401);
    let page = server.get("/login", &[HTML]).await;
    assert!(String::from_utf8_lossy(&page.body).contains("login.js"));
}

#[tokio::test]
async fn more_requests_than_a_token_may_make_wait_as_long_as_they_are_told() {
    let limits = Limits {
        requests_per_second_max: 2,
        requests_burst_max: 5,
        ..Limits::default()
    };
    let server = Guarded::with(limits).await;
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
        "nobody else is held back"
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
async fn who_guesses_is_held_back_and_who_knows_is_not() {
    let limits = Limits {
        unknown_requests_per_second_max: 1,
        unknown_requests_burst_max: 3,
        ..Limits::default()
    };
    let server = Guarded::with(limits).await;
    let token = server.add("ana", Scope::Read);
    let guess = || async {
        let shown = Token::random().unwrap();
        server.get_as(&shown, "/v1/sensors").await.status
    };
    assert_eq!([guess().await, guess().await, guess().await], [401; 3]);
    assert_eq!([guess().await, guess().await], [429; 2]);
    assert_eq!(server.login("x").await.status, 429);
    assert_eq!(server.get("/healthz", &[]).await.status, 429);
    // From the same address.
    assert_eq!(server.get_as(&token, "/v1/sensors").await.status, 200);
    assert_eq!(server.get_as(&token, "/healthz").await.status, 200);
    server.clock.pass(Duration::from_secs(1));
    assert_eq!([guess().await, guess().await], [401, 429]);
}

#[tokio::test]
async fn nothing_that_is_said_holds_a_secret() {
    let server = Guarded::new().await;
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
    let said = server.said.lock().unwrap().join("\n");
    assert!(
        said.contains("refused code=foreign_device") && said.contains("code=bad_token"),
        "{said}"
    );
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
    let server = Guarded::new().await;
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
    assert_headers(&server.get("/", &[HTML]).await.headers, "led to the door");
    assert_headers(&server.get("/login", &[]).await.headers, "the door");
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
    let server = Guarded::new().await;
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
async fn a_token_is_good_as_soon_as_it_is_made() {
    let server = Guarded::new().await;
    let first = server.add("ana", Scope::Read);
    assert_eq!(server.get_as(&first, "/v1/sensors").await.status, 200);
    // No time passes: whoever is to be refused is looked for in the list as it is at that moment.
    let second = server
        .folder
        .change(|book| book.add("ben", Scope::Read, 1))
        .unwrap();
    assert_eq!(server.get_as(&second, "/v1/sensors").await.status, 200);
    let stranger = Token::random().unwrap();
    assert_eq!(server.get_as(&stranger, "/v1/sensors").await.status, 401);
}

#[tokio::test]
async fn a_folder_that_breaks_while_the_collector_runs_keeps_the_door_shut_and_is_said() {
    let server = Guarded::new().await;
    // Whether the list was ever read before it broke, or not.
    let unread = Guarded::new().await;
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
