//! Sends generated requests through the router while a device delivers.

use crate::made_up::{self, Dice, METHODS};
use crate::{ALONE, collector_process, from_environment};
use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, Response, header};
use grideye_collector::Routes;
use grideye_collector::auth::{AccessFolder, Scope, Token};
use grideye_collector::{AppState, Limits, Log, SqliteStore, StoreLocation, SystemClock, app};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use tower::ServiceExt as _;

/// All allowed status codes; a failure of the collector itself is not among them.
const ANSWERS: [u16; 18] = [
    200, 201, 204, 303, 400, 401, 403, 404, 405, 408, 409, 413, 415, 422, 429, 431, 503, 507,
];
/// One good batch per this many generated requests.
const GOOD_EVERY: u64 = 500;
/// Memory growth that caches and the allocator explain.
const GROWTH_MAX_KIB: u64 = 48 * 1024;

struct Scene {
    router: Routes,
    /// The good device's token.
    good: Token,
    /// The attackers' tokens: for a device, for reading, for recordings, and none.
    attackers: Vec<Option<Token>>,
    _around: tempfile::TempDir,
}

impl Scene {
    async fn new() -> Self {
        let around = tempfile::tempdir().unwrap();
        let folder = AccessFolder::new(around.path().join("access"));
        let add = |name: &str, scope| folder.change(|book| book.add(name, scope, 1)).unwrap();
        let device = |name: &str| Scope::Ingest {
            devices: BTreeSet::from([name.to_owned()]),
        };
        let good = add("pi-1", device("pi-1"));
        let attackers = vec![
            Some(add("pi-2", device("pi-2"))),
            Some(add("read", Scope::Read)),
            Some(add("admin", Scope::Admin)),
            None,
        ];
        // So that requests get as far as possible: rates have their own tests.
        let limits = Limits {
            requests_per_second_max: u32::MAX,
            requests_burst_max: u32::MAX,
            unknown_requests_per_second_max: u32::MAX,
            unknown_requests_burst_max: u32::MAX,
            sensors_max: 64,
            recordings_max: 16,
            ..Limits::default()
        };
        let file = StoreLocation::File(around.path().join("frames.sqlite"));
        let store = Arc::new(SqliteStore::open(&file, &limits).unwrap());
        let clock = Arc::new(SystemClock::new());
        let state = AppState::with_tokens(store, limits, clock, folder, Log::silent()).await;
        Self {
            router: app(state.unwrap()),
            good,
            attackers,
            _around: around,
        }
    }

    async fn send(&self, request: Request<Body>) -> Response<Body> {
        self.router.clone().oneshot(request).await.unwrap()
    }

    /// Posts the good device's next frame and checks the usual answer.
    async fn deliver(&self, seq: u64) {
        let frame = json!({
            "seq": seq, "t_boot_ns": seq, "t_utc_ns": 0, "clock": "synced",
            "thermistor_raw": seq % 4096, "pixels_raw": vec![seq % 2048; 64],
        });
        let body = json!({ "device": "pi-1", "boot": "b1", "sensors": [{ "sensor": "s1", "frames": [frame] }] });
        let request = Request::post("/v1/frames")
            .header(header::HOST, "127.0.0.1:8080")
            .header(
                header::AUTHORIZATION,
                format!("Bearer {}", self.good.reveal()),
            )
            .body(Body::from(body.to_string()))
            .unwrap();
        let answer = self.send(request).await;
        assert_eq!(answer.status(), 200);
        let body = to_bytes(answer.into_body(), 1 << 20).await.unwrap();
        let answer: Value = serde_json::from_slice(&body).unwrap();
        assert_eq!(
            answer,
            json!({ "durable_through": { "s1": seq }, "gaps": [] })
        );
    }

    async fn audit(&self) -> Value {
        let token = self.attackers[1].as_ref().unwrap().reveal();
        let request = Request::get("/v1/audit")
            .header(header::HOST, "127.0.0.1:8080")
            .header(header::AUTHORIZATION, format!("Bearer {token}"))
            .body(Body::empty())
            .unwrap();
        let answer = self.send(request).await;
        let body = to_bytes(answer.into_body(), 1 << 20).await.unwrap();
        serde_json::from_slice(&body).unwrap()
    }
}

/// Path, index of the right token among the attackers', and whether it is a POST.
const DOORS: [(&str, usize, bool); 11] = [
    ("/v1/frames", 0, true),
    ("/v1/frames", 0, true),
    ("/v1/frames", 0, true),
    ("/v1/recordings", 2, true),
    ("/v1/recordings/1/stop", 2, true),
    ("/v1/recordings/1/note", 2, true),
    ("/v1/recordings/1.csv", 1, false),
    ("/v1/recordings/1.frames", 1, false),
    ("/v1/audit", 1, false),
    ("/v1/login", 3, true),
    ("/v1/live", 1, false),
];

/// Every second request is right except for its body, so that it reaches the body parsers; the others are wrong
/// everywhere. `None` if it is not even a valid request.
fn made_up_request(
    dice: &mut Dice,
    attackers: &[Option<Token>],
) -> Option<(Request<Body>, String)> {
    let mut request = Request::builder();
    let (path, token) = if dice.below(2) == 0 {
        let (path, holder, is_post) = *dice.of(&DOORS);
        let method = if is_post { Method::POST } else { Method::GET };
        request = request
            .method(method)
            .header(header::HOST, "127.0.0.1:8080");
        (path.to_owned(), &attackers[holder])
    } else {
        request = request.method(Method::from_bytes(dice.of(&METHODS).as_bytes()).unwrap());
        for (name, value) in made_up::headers(dice) {
            request = request.header(name, value);
        }
        (made_up::path(dice), dice.of(attackers))
    };
    if let Some(token) = token {
        request = request.header(header::AUTHORIZATION, format!("Bearer {}", token.reveal()));
    }
    let body = made_up::body(dice);
    let shown = String::from_utf8_lossy(&body)
        .chars()
        .take(200)
        .collect::<String>();
    let told = format!("{path} {shown:?}");
    Some((request.uri(&path).body(Body::from(body)).ok()?, told))
}

async fn check(answer: Response<Body>, told: &str, secrets: &[String]) -> u16 {
    let status = answer.status().as_u16();
    assert!(ANSWERS.contains(&status), "{status} for {told}");
    assert!(
        answer
            .headers()
            .contains_key(header::CONTENT_SECURITY_POLICY),
        "{told}"
    );
    let kind = answer.headers().get(header::CONTENT_TYPE);
    let is_endless = kind.is_some_and(|kind| kind == "text/event-stream");
    if is_endless {
        return status;
    }
    let body = to_bytes(answer.into_body(), 1 << 26).await.unwrap();
    let text = String::from_utf8_lossy(&body);
    assert!(
        !text.contains("root:x:") && !text.contains("[package]"),
        "{told}: {text}"
    );
    assert!(
        !secrets.iter().any(|secret| text.contains(secret.as_str())),
        "{told}: {text}"
    );
    if status >= 400 && !body.is_empty() {
        let error: Value = serde_json::from_slice(&body).unwrap_or_default();
        assert!(
            error["error"]["code"].is_string(),
            "{status} {told}: {text}"
        );
    }
    status
}

fn resident_kib() -> u64 {
    collector_process::resident_kib(Path::new("/proc/self/status"))
}

#[tokio::test]
async fn made_up_requests_do_no_harm_and_a_device_delivers_all_the_while() {
    let _beside = ALONE.read().await;
    let otherwise = if std::env::var_os("GRIDEYE_ALL_SEEDS").is_some() {
        1_000_000
    } else {
        20_000
    };
    let count = from_environment("GRIDEYE_ATTACK_REQUESTS", otherwise);
    let seed = from_environment("GRIDEYE_ATTACK_SEED", 1);
    let scene = Scene::new().await;
    let secrets: Vec<String> = [Some(scene.good.clone())]
        .iter()
        .chain(&scene.attackers)
        .flatten()
        .map(|token| token.reveal().rsplit('-').next().unwrap().to_owned())
        .collect();
    let mut dice = Dice::new(seed);
    let mut answers = BTreeMap::<u16, u64>::new();
    let (mut delivered, mut sent, mut before_kib) = (0, 0, 0);
    for number in 0..count {
        // One-time allocations are done by then.
        if number == count / 10 {
            before_kib = resident_kib();
        }
        if number % GOOD_EVERY == 0 {
            scene.deliver(delivered).await;
            delivered += 1;
        }
        if let Some((request, told)) = made_up_request(&mut dice, &scene.attackers) {
            let status = check(scene.send(request).await, &told, &secrets).await;
            *answers.entry(status).or_default() += 1;
            sent += 1;
        }
    }
    let after_kib = resident_kib();
    println!(
        "{sent} requests of seed {seed}: {answers:?}; {delivered} of {delivered} good posts taken; resident {before_kib} KiB after a tenth, {after_kib} KiB at the end"
    );
    assert!(
        after_kib < before_kib + GROWTH_MAX_KIB,
        "{before_kib} KiB, then {after_kib}"
    );
    // If all ended at the first check, the test would prove nothing.
    for reached in [200, 201, 400, 401, 403, 404, 405, 409, 413, 415, 422] {
        assert!(
            answers.contains_key(&reached),
            "nothing was answered {reached}: {answers:?}"
        );
    }
    let audit = scene.audit().await;
    for stream in audit["streams"].as_array().unwrap() {
        let device = stream["device"].as_str().unwrap();
        assert!(["pi-1", "pi-2"].contains(&device), "forged: {stream}");
        if device == "pi-1" {
            assert_eq!(
                (&stream["sensor"], &stream["boot"]),
                (&json!("s1"), &json!("b1"))
            );
            assert_eq!(stream["stored"], delivered);
        }
    }
}
