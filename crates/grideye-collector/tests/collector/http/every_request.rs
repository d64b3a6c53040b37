//! Rules for every request: hosts, origins, headers, unknown paths, and the page's files.

use crate::batches::numbered;
use crate::server::{Server, request};
use axum::body::Body;
use axum::http::{Method, StatusCode, header};
use grideye_collector::Limits;

#[tokio::test]
async fn only_bodies_of_frames_may_be_large() {
    let server = Server::with(Limits {
        small_body_bytes_max: 100,
        ..Limits::default()
    })
    .await;
    let named = |spaces| format!("{}{}", " ".repeat(spaces), r#"{"name":"x"}"#);
    let large = server.post("/v1/recordings", named(89)).await;
    assert_eq!(large.error(), (413, "body_too_large".to_owned(), None));
    assert!(
        large.json()["error"]["message"]
            .to_string()
            .contains("100 bytes")
    );
    let fits = server.post("/v1/recordings", named(88)).await;
    assert_eq!(fits.status, StatusCode::CREATED);
    assert_eq!(server.frames(&numbered(0..5)).await.status, StatusCode::OK);
}

#[tokio::test]
async fn unknown_paths_and_wrong_methods_get_json_errors() {
    let server = Server::new().await;
    for path in [
        "/nothing",
        "/v1",
        "/assets/none.js",
        "/assets/..%2fCargo.toml",
        "//",
    ] {
        assert_eq!(server.get(path).await.error().0, 404, "{path}");
    }
    let wrong = server.get("/v1/frames").await;
    assert_eq!(wrong.error(), (405, "wrong_method".to_owned(), None));
    assert_eq!(wrong.headers[header::ALLOW], "POST");
    assert_eq!(server.post("/healthz", "").await.error().0, 405);
}

#[tokio::test]
async fn every_answer_has_the_security_headers() {
    let server = Server::new().await;
    for path in [
        "/",
        "/assets/main.js",
        "/v1/sensors",
        "/nothing",
        "/v1/frames",
        "/v1/recordings/1.csv",
    ] {
        let headers = server.get(path).await.headers;
        let policy = headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
        assert_eq!(
            policy,
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        );
        assert_eq!(headers[header::X_CONTENT_TYPE_OPTIONS], "nosniff", "{path}");
        assert_eq!(headers[header::REFERRER_POLICY], "no-referrer", "{path}");
        assert!(headers.contains_key(header::CACHE_CONTROL), "{path}");
        assert!(
            !headers
                .keys()
                .any(|name| name.as_str().starts_with("access-control")),
            "{path}"
        );
    }
}

/// It is for programs, and short: it allows nothing and is never cached. A person may look at an error, which gets all
/// headers.
#[tokio::test]
async fn an_acknowledgment_has_the_short_headers() {
    let server = Server::new().await;
    let good = server
        .post("/v1/frames", numbered(0..5).to_json().unwrap())
        .await;
    let values: Vec<(&str, &str)> = good
        .headers
        .iter()
        .map(|(name, value)| (name.as_str(), value.to_str().unwrap()))
        .collect();
    assert_eq!(
        values,
        [
            ("content-type", "application/json"),
            ("cache-control", "no-store"),
            ("x-content-type-options", "nosniff"),
            (
                "content-security-policy",
                "default-src 'none'; frame-ancestors 'none'"
            ),
        ]
    );
    let refused = server.post("/v1/frames", "[]").await;
    assert_eq!(refused.status, 422);
    assert_eq!(refused.headers[header::X_FRAME_OPTIONS], "DENY");
}

#[tokio::test]
async fn other_names_for_this_host_are_refused() {
    let server = Server::new().await;
    let with_host = |host: Option<&str>| {
        let mut request = request(Method::GET, "/v1/sensors", Body::empty());
        request.headers_mut().remove(header::HOST);
        if let Some(host) = host {
            request
                .headers_mut()
                .insert(header::HOST, host.parse().unwrap());
        }
        request
    };
    assert_eq!(
        server.send(with_host(Some("localhost:8080"))).await.status,
        StatusCode::OK
    );
    let rebound = server.send(with_host(Some("evil.example:8080"))).await;
    assert_eq!(
        rebound.error(),
        (403, "unknown_host".to_owned(), Some("host".to_owned()))
    );
    let hint = rebound.json()["error"]["hint"].to_string();
    assert!(hint.contains("--host-name"), "{hint}");
    assert_eq!(server.send(with_host(None)).await.error().0, 400);
    let mut two = with_host(Some("localhost"));
    two.headers_mut()
        .append(header::HOST, "localhost".parse().unwrap());
    assert_eq!(server.send(two).await.error().0, 400);
    let mut other_target = request(Method::GET, "http://evil.example/v1/sensors", Body::empty());
    other_target
        .headers_mut()
        .insert(header::HOST, "localhost".parse().unwrap());
    assert_eq!(server.send(other_target).await.error().0, 400);
}

#[tokio::test]
async fn pages_of_other_sites_cannot_write() {
    let server = Server::new().await;
    let from = |origin: &str| {
        let mut request = request(
            Method::POST,
            "/v1/recordings",
            Body::from(r#"{"name":"mine"}"#),
        );
        request
            .headers_mut()
            .insert(header::ORIGIN, origin.parse().unwrap());
        request
    };
    for foreign in [
        "http://evil.example",
        "null",
        "http://127.0.0.1:9999",
        "https://127.0.0.1:8080",
    ] {
        let refused = server.send(from(foreign)).await;
        assert_eq!(
            refused.error(),
            (403, "foreign_origin".to_owned(), Some("origin".to_owned())),
            "{foreign}"
        );
    }
    assert_eq!(
        server.send(from("http://127.0.0.1:8080")).await.status,
        StatusCode::CREATED
    );
}

/// A proxy might check the first and this server the second.
#[tokio::test]
async fn a_request_that_names_two_origins_is_refused_whichever_they_are() {
    let server = Server::new().await;
    for method in [Method::GET, Method::POST] {
        for second in ["http://127.0.0.1:8080", "http://evil.example"] {
            let body = Body::from(r#"{"name":"mine"}"#);
            let mut two = request(method.clone(), "/v1/recordings", body);
            for origin in ["http://127.0.0.1:8080", second] {
                let origin = origin.parse().unwrap();
                two.headers_mut().append(header::ORIGIN, origin);
            }
            let refused = server.send(two).await.error();
            let expected = (400, "two_origins".to_owned(), Some("origin".to_owned()));
            assert_eq!(refused, expected, "{method} {second}");
        }
    }
}

#[tokio::test]
async fn the_page_is_made_of_its_own_files_alone() {
    let server = Server::new().await;
    let page = server.get("/").await;
    assert_eq!(
        page.headers[header::CONTENT_TYPE],
        "text/html; charset=utf-8"
    );
    let html = std::str::from_utf8(&page.body).unwrap();
    for forbidden in [
        "<style",
        "style=",
        "onclick",
        "onload",
        "http://",
        "https://",
        "javascript:",
    ] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    assert_eq!(
        html.matches("<script").count(),
        html.matches("<script type=\"module\" src=\"/assets/")
            .count()
    );
    let mut parts: Vec<String> = html
        .split('"')
        .filter_map(|text| text.strip_prefix("/assets/"))
        .map(ToOwned::to_owned)
        .collect();
    let mut seen = 0;
    while let Some(name) = parts.get(seen).cloned() {
        seen += 1;
        let part = server.get(&format!("/assets/{name}")).await;
        assert_eq!(part.status, StatusCode::OK, "{name}");
        let expected = match name.rsplit_once('.').unwrap().1 {
            "js" => "text/javascript; charset=utf-8",
            "css" => "text/css; charset=utf-8",
            _ => "image/svg+xml",
        };
        assert_eq!(part.headers[header::CONTENT_TYPE], expected, "{name}");
        let text = std::str::from_utf8(&part.body).unwrap();
        let imports = text
            .split("from \"./")
            .skip(1)
            .filter_map(|rest| rest.split('"').next());
        for import in imports {
            if !parts.iter().any(|known| known == import) {
                parts.push(import.to_owned());
            }
        }
    }
    assert!(parts.len() >= 9, "{parts:?}");
}
