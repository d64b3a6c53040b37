//! Which connection makes room for the next, and for whom a proxy speaks.

use crate::socket::{Running, anywhere, config, connect_from, get, one_answer, send, until_closed};
use crate::tls::{Place, ask, believing, get_once};
use grideye_collector::auth::{Scope, Token};
use grideye_collector::{Config, Limits, Log};
use std::net::IpAddr;
use std::sync::{Arc, Mutex};
use tokio::net::TcpStream;

/// Sends a request on a persistent connection; returns the status.
async fn asked(stream: &mut TcpStream, path: &str, more: &str) -> String {
    let request = get(path).replace("\r\n\r\n", &format!("\r\n{more}\r\n"));
    send(stream, &request).await;
    one_answer(stream).await[9..12].to_owned()
}

fn bearer(token: &Token) -> String {
    format!("authorization: Bearer {}\r\n", token.reveal())
}

fn places(connections_max: usize) -> Limits {
    Limits {
        connections_max,
        ..Limits::default()
    }
}

#[tokio::test]
async fn the_oldest_silent_connection_makes_room_and_who_asked_well_stays() {
    let server = Running::new(config(places(3))).await;
    let mut good = server.connect().await;
    assert_eq!(asked(&mut good, "/healthz", "").await, "200");
    let mut silent = server.connect().await;
    let mut half = server.connect().await;
    send(&mut half, "GET / HTTP/1.1\r\nhost: local").await;
    let mut newcomers = Vec::new();
    for makes_room in [&mut silent, &mut half] {
        let mut newcomer = server.connect().await;
        assert_eq!(asked(&mut newcomer, "/healthz", "").await, "200");
        assert_eq!(until_closed(makes_room).await, "");
        assert_eq!(asked(&mut good, "/healthz", "").await, "200");
        newcomers.push(newcomer);
    }
    // All have had a successful response now. Two of this address are established, and leave one place to others.
    let mut last = server.connect().await;
    assert_eq!(asked(&mut last, "/healthz", "").await, "200");
    assert_eq!(until_closed(&mut newcomers[1]).await, "");
    for stays in [&mut good, &mut newcomers[0]] {
        assert_eq!(asked(stays, "/healthz", "").await, "200");
    }
    server.stop().await;
}

#[tokio::test]
async fn where_tokens_are_asked_for_one_without_a_good_one_makes_room_whatever_it_asked() {
    let place = Place::new();
    let token = bearer(&place.token(Scope::Read));
    let limits = places(2);
    let server = Running::new(Config {
        limits,
        ..place.config(anywhere(), None)
    })
    .await;
    let mut good = server.connect().await;
    assert_eq!(asked(&mut good, "/v1/sensors", &token).await, "200");
    let mut nobody = server.connect().await;
    assert_eq!(asked(&mut nobody, "/healthz", "").await, "200");
    assert_eq!(asked(&mut nobody, "/v1/sensors", "").await, "401");
    let mut other = server.connect().await;
    assert_eq!(until_closed(&mut nobody).await, "");
    assert_eq!(asked(&mut other, "/v1/sensors", &token).await, "200");
    assert_eq!(asked(&mut good, "/v1/sensors", "").await, "401");
    // Of one token, at most half is established.
    let _newcomer = server.connect().await;
    assert_eq!(until_closed(&mut other).await, "");
    assert_eq!(asked(&mut good, "/v1/sensors", "").await, "401");
    server.stop().await;
}

#[tokio::test]
async fn a_connection_without_a_tls_handshake_makes_room() {
    let place = Place::new();
    let limits = places(1);
    let server = Running::new(Config {
        limits,
        ..place.encrypted()
    })
    .await;
    let mut silent = server.connect().await;
    let believing = believing(&place.authority());
    let request = get_once("/healthz", "");
    let answer = ask(server.address, believing, "127.0.0.1", &request).await;
    assert!(answer.unwrap().starts_with("HTTP/1.1 200"));
    assert_eq!(until_closed(&mut silent).await, "");
    server.stop().await;
}

#[tokio::test]
async fn a_trusted_proxy_speaks_for_others_and_nobody_else_does() {
    let place = Place::new();
    place.token(Scope::Read);
    let lines = Arc::new(Mutex::new(String::new()));
    let sink = Arc::clone(&lines);
    let limits = Limits {
        connections_per_peer_max: 1,
        unknown_requests_per_second_max: 1,
        unknown_requests_burst_max: 2,
        ..Limits::default()
    };
    let server = Running::new(Config {
        limits,
        trusted_proxies: vec![IpAddr::from([127, 0, 0, 2])],
        log: Log::new(move |event| sink.lock().unwrap().push_str(&format!("{event}\n"))),
        ..place.config(anywhere(), None)
    })
    .await;
    // It may have several connections, for its clients.
    let _idle = connect_from([127, 0, 0, 2], &server).await;
    let mut proxy = connect_from([127, 0, 0, 2], &server).await;
    let mut liar = connect_from([127, 0, 0, 3], &server).await;
    let forwarded = |hops: &str| format!("x-forwarded-for: {hops}\r\n");
    for (hops, status) in [
        ("192.0.2.1", "401"),
        ("192.0.2.9, 192.0.2.1", "401"),
        ("192.0.2.1", "429"),
        ("192.0.2.2", "401"),
        ("2001:db8::1", "401"),
        ("2001:db8::2", "401"),
        ("2001:db8::3", "429"),
    ] {
        let answer = asked(&mut proxy, "/v1/sensors", &forwarded(hops)).await;
        assert_eq!(answer, status, "{hops}");
    }
    for (hops, status) in [
        ("192.0.2.3", "401"),
        ("192.0.2.4", "401"),
        ("192.0.2.5", "429"),
    ] {
        let answer = asked(&mut liar, "/v1/sensors", &forwarded(hops)).await;
        assert_eq!(answer, status, "{hops}");
    }
    server.stop().await;
    let lines = lines.lock().unwrap();
    let expected = "refused code=no_token status=401 peer=192.0.2.1";
    assert!(lines.contains(expected), "{lines}");
    assert!(!lines.contains("peer=127.0.0.2"), "{lines}");
}

#[tokio::test]
async fn a_connection_that_made_room_is_counted() {
    let server = Running::new(config(places(1))).await;
    let mut silent = server.connect().await;
    let mut newcomer = server.connect().await;
    send(&mut newcomer, &get("/v1/health")).await;
    let health = one_answer(&mut newcomer).await;
    let expected =
        r#""connections":{"displaced":1,"max":1,"open":1,"tls_failed":0,"turned_away":0}"#;
    assert!(health.contains(expected), "{health}");
    assert_eq!(until_closed(&mut silent).await, "");
    server.stop().await;
}
