//! The page's cookie: who gets one, what it allows, when it ends.

use crate::auth::server::{HTML, ORIGIN, TokenServer};
use axum::http::{Method, header};
use grideye_collector::Limits;
use grideye_collector::auth::Scope;
use serde_json::json;
use std::time::Duration;

#[tokio::test]
async fn signing_in_gives_a_cookie_that_no_script_reads_and_no_other_site_sends() {
    let server = TokenServer::new().await;
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
    let server = TokenServer::with(limits).await;
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
async fn a_rejected_sign_in_gets_the_reason_and_no_cookie() {
    let server = TokenServer::new().await;
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
        (format!("{{\"token\":{}", "[".repeat(9000)), 400, "not_json"),
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
async fn a_person_is_redirected_to_sign_in_and_a_program_gets_an_error() {
    let server = TokenServer::new().await;
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
async fn bad_sign_ins_from_an_address_do_not_keep_good_ones_out() {
    let server = TokenServer::new().await;
    let token = server.add("ana", Scope::Read);
    let sign_in = async |token: &str| {
        let body = json!({ "token": token }).to_string();
        server
            .send(Method::POST, "/v1/login", &[ORIGIN], body)
            .await
    };
    let bad = "grideye-000000000000-".to_owned() + &"0".repeat(64);
    let burst = Limits::default().unknown_requests_burst_max;
    for _ in 0..burst {
        assert_eq!(sign_in(&bad).await.code(), (401, "bad_token".to_owned()));
    }
    for _ in 0..100 {
        let reply = sign_in(&bad).await;
        assert_eq!(reply.code(), (429, "too_many_requests".to_owned()));
    }
    // A person at the same address gets to the page, its parts, and in.
    assert_eq!(server.get("/", &[HTML]).await.status, 303);
    for path in ["/login", "/assets/login.js", "/healthz"] {
        assert_eq!(server.get(path, &[]).await.status, 200, "{path}");
    }
    let reply = sign_in(&token.reveal()).await;
    assert_eq!(reply.status, 204, "{:?}", reply.json());
    let cookie = reply.cookie();
    let page = server.get("/", &[HTML, ("cookie", &*cookie)]).await;
    assert_eq!(page.status, 200);
}
