//! The collector on real sockets: start, limits on connections and time, shutdown.

use crate::batches::numbered;
use grideye_collector::{Collector, CollectorError, Config, Limits, StoreLocation, SystemClock};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// Longer than anything here takes, so that a hang fails the test.
pub(crate) const PATIENCE: Duration = crate::patience::WAIT_MAX;

pub(crate) fn anywhere() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}

/// For this machine alone, with its clocks.
pub(crate) fn at(address: SocketAddr, store: StoreLocation) -> Config {
    Config::new(address, store, Arc::new(SystemClock::new()))
}

pub(crate) fn config(limits: Limits) -> Config {
    Config {
        limits,
        ..at(anywhere(), StoreLocation::Memory)
    }
}

/// A collector that runs until told to stop.
pub(crate) struct Running {
    pub(crate) address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    served: JoinHandle<Result<(), CollectorError>>,
}

impl Running {
    pub(crate) async fn new(config: Config) -> Self {
        let collector = Collector::bind(config).await.unwrap();
        let address = collector.local_addr();
        let (stop, stopped) = oneshot::channel::<()>();
        let served = tokio::spawn(collector.serve(async {
            let _ = stopped.await;
        }));
        Self {
            address,
            stop: Some(stop),
            served,
        }
    }

    pub(crate) async fn connect(&self) -> TcpStream {
        TcpStream::connect(self.address).await.unwrap()
    }

    fn ask_to_stop(&mut self) {
        self.stop.take().unwrap().send(()).unwrap();
    }

    pub(crate) async fn stop(mut self) {
        self.ask_to_stop();
        tokio::time::timeout(PATIENCE, self.served)
            .await
            .unwrap()
            .unwrap()
            .unwrap();
    }
}

/// Connects from another address of this machine.
pub(crate) async fn connect_from(from: [u8; 4], server: &Running) -> TcpStream {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(SocketAddr::from((from, 0))).unwrap();
    socket.connect(server.address).await.unwrap()
}

pub(crate) async fn send(stream: &mut TcpStream, text: &str) {
    stream.write_all(text.as_bytes()).await.unwrap();
}

/// Everything until the other side closes. A reset counts as the end.
pub(crate) async fn until_closed(stream: &mut TcpStream) -> String {
    let mut answer = Vec::new();
    let read = async {
        let mut piece = [0; 4096];
        while let Ok(count @ 1..) = stream.read(&mut piece).await {
            answer.extend_from_slice(&piece[..count]);
        }
    };
    tokio::time::timeout(PATIENCE, read)
        .await
        .expect("the connection stays open");
    String::from_utf8(answer).unwrap()
}

/// One response on a persistent connection, by its content-length.
pub(crate) async fn one_answer(stream: &mut TcpStream) -> String {
    let mut text = String::new();
    let read = async {
        let mut piece = [0; 4096];
        loop {
            let count = stream.read(&mut piece).await.unwrap();
            assert!(count > 0, "closed after {text:?}");
            text.push_str(std::str::from_utf8(&piece[..count]).unwrap());
            if let Some((head, body)) = text.split_once("\r\n\r\n") {
                let length = head
                    .lines()
                    .find_map(|line| line.strip_prefix("content-length: "));
                if body.len() >= length.unwrap().parse().unwrap() {
                    return;
                }
            }
        }
    };
    tokio::time::timeout(PATIENCE, read)
        .await
        .expect("no answer");
    text
}

pub(crate) fn get(path: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n")
}

fn post_frames(seqs: std::ops::Range<u64>) -> (String, String) {
    let body = String::from_utf8(numbered(seqs).to_json().unwrap()).unwrap();
    let head = format!(
        "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
        body.len()
    );
    (head, body)
}

#[tokio::test]
async fn one_connection_carries_many_requests() {
    let server = Running::new(config(Limits::default())).await;
    let mut stream = server.connect().await;
    for first in [0, 5, 10] {
        let (head, body) = post_frames(first..first + 5);
        send(&mut stream, &(head + &body)).await;
        let answer = one_answer(&mut stream).await;
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
        assert!(
            answer.ends_with(&format!(
                r#"{{"durable_through":{{"s1":{}}},"gaps":[]}}"#,
                first + 4
            )),
            "{answer}"
        );
    }
    server.stop().await;
}

/// A batch bypasses the router, but gets the router's headers.
#[tokio::test]
async fn an_acknowledgement_has_the_headers_that_bind_it() {
    let server = Running::new(config(Limits::default())).await;
    let mut stream = server.connect().await;
    let (head, body) = post_frames(0..5);
    send(&mut stream, &(head + &body)).await;
    let answer = one_answer(&mut stream).await;
    let (head, _body) = answer.split_once("\r\n\r\n").unwrap();
    let mut fields: Vec<&str> = head.lines().skip(1).collect();
    fields.retain(|field| !field.starts_with("date: "));
    fields.sort_unstable();
    assert_eq!(
        fields,
        [
            "cache-control: no-store",
            "content-length: 38",
            "content-security-policy: default-src 'none'; frame-ancestors 'none'",
            "content-type: application/json",
            "x-content-type-options: nosniff",
        ]
    );
    let (head, _body) = post_frames(0..5);
    send(&mut stream, &head.replace("application/json", "text/html")).await;
    let refused = one_answer(&mut stream).await;
    assert!(refused.starts_with("HTTP/1.1 415 "), "{refused}");
    assert!(refused.contains("x-frame-options: DENY"), "{refused}");
    server.stop().await;
}

#[tokio::test]
async fn a_client_that_half_closes_after_a_batch_is_answered() {
    let around = tempfile::tempdir().unwrap();
    let file = around.path().join("frames.sqlite");
    let server = Running::new(at(anywhere(), StoreLocation::File(file.clone()))).await;
    // While another program locks the file no batch is answered, and the server sees the client's end first.
    let other = rusqlite::Connection::open(file).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let mut stream = server.connect().await;
    let (head, body) = post_frames(0..5);
    send(&mut stream, &(head + &body)).await;
    stream.shutdown().await.unwrap();
    tokio::time::sleep(Duration::from_millis(100)).await;
    other.execute_batch("ROLLBACK").unwrap();
    let answer = until_closed(&mut stream).await;
    assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer:?}");
    assert!(answer.ends_with(r#"{"durable_through":{"s1":4},"gaps":[]}"#));
    server.stop().await;
}

/// While answering, the server reads nothing: it notices a departed client at its next write.
#[tokio::test]
async fn a_page_that_disappears_frees_its_place() {
    let limits = Limits {
        live_clients_max: 1,
        live_keep_alive: Duration::from_millis(50),
        ..Limits::default()
    };
    let server = Running::new(config(limits)).await;
    let follow = async || {
        let mut page = server.connect().await;
        send(&mut page, &get("/v1/live")).await;
        let mut head = [0; 12];
        page.read_exact(&mut head).await.unwrap();
        (page, String::from_utf8(head.to_vec()).unwrap())
    };
    let (first, answered) = follow().await;
    assert_eq!(answered, "HTTP/1.1 200");
    let (_second, answered) = follow().await;
    assert_eq!(answered, "HTTP/1.1 503");
    drop(first);
    let seated = async {
        while follow().await.1 != "HTTP/1.1 200" {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(PATIENCE, seated)
        .await
        .expect("the place was not freed");
    server.stop().await;
}

#[tokio::test]
async fn headers_that_come_too_slowly_end_the_connection() {
    let header_time_max = Duration::from_millis(150);
    let server = Running::new(config(Limits {
        header_time_max,
        ..Limits::default()
    }))
    .await;
    let began = Instant::now();
    let mut half = server.connect().await;
    send(&mut half, "GET / HTTP/1.1\r\nhost: local").await;
    let mut silent = server.connect().await;
    let mut idle = server.connect().await;
    send(&mut idle, &get("/healthz")).await;
    one_answer(&mut idle).await;
    for stream in [&mut half, &mut silent, &mut idle] {
        until_closed(stream).await;
    }
    assert!(began.elapsed() >= header_time_max);
    server.stop().await;
}

#[tokio::test]
async fn headers_that_are_too_large_are_answered_431() {
    let server = Running::new(config(Limits {
        header_bytes_max: 8192,
        ..Limits::default()
    }))
    .await;
    let mut stream = server.connect().await;
    let fits = format!(
        "GET /healthz HTTP/1.1\r\nhost: localhost\r\nx: {}\r\n\r\n",
        "y".repeat(6000)
    );
    send(&mut stream, &fits).await;
    assert!(one_answer(&mut stream).await.starts_with("HTTP/1.1 200"));
    let too_large = format!(
        "GET /healthz HTTP/1.1\r\nhost: localhost\r\nx: {}\r\n\r\n",
        "y".repeat(9000)
    );
    send(&mut stream, &too_large).await;
    assert!(until_closed(&mut stream).await.starts_with("HTTP/1.1 431"));
    server.stop().await;
}

#[tokio::test]
async fn a_large_body_is_answered_before_it_is_sent() {
    let server = Running::new(config(Limits::default())).await;
    let mut stream = server.connect().await;
    send(&mut stream, "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: 99999999999\r\n\r\n").await;
    let answer = until_closed(&mut stream).await;
    assert!(
        answer.starts_with("HTTP/1.1 413") && answer.contains(r#""code":"body_too_large""#),
        "{answer}"
    );
    server.stop().await;
}

#[tokio::test]
async fn one_connection_too_many_is_turned_away_and_room_comes_back() {
    let server = Running::new(config(Limits {
        connections_max: 1,
        ..Limits::default()
    }))
    .await;
    let mut first = server.connect().await;
    send(&mut first, &get("/healthz")).await;
    one_answer(&mut first).await;
    let refused = until_closed(&mut server.connect().await).await;
    assert!(
        refused.starts_with("HTTP/1.1 503") && refused.contains("too_many_connections"),
        "{refused}"
    );
    let body = refused.split_once("\r\n\r\n").unwrap().1;
    assert!(refused.contains(&format!("content-length: {}\r\n", body.len())));
    drop(first);
    let admitted = async {
        loop {
            let mut stream = server.connect().await;
            // A rejected connection may close during this write.
            let _ = stream.write_all(get("/healthz").as_bytes()).await;
            let mut start = [0; 12];
            if stream.read_exact(&mut start).await.is_ok() && &start == b"HTTP/1.1 200" {
                return;
            }
        }
    };
    tokio::time::timeout(PATIENCE, admitted)
        .await
        .expect("the place was not freed");
    server.stop().await;
}

#[tokio::test]
async fn one_peer_cannot_take_every_connection() {
    let limits = Limits {
        connections_max: 10,
        connections_per_peer_max: 1,
        ..Limits::default()
    };
    let server = Running::new(config(limits)).await;
    let mut first = server.connect().await;
    send(&mut first, &get("/healthz")).await;
    one_answer(&mut first).await;
    assert!(
        until_closed(&mut server.connect().await)
            .await
            .starts_with("HTTP/1.1 503")
    );
    let mut other = connect_from([127, 0, 0, 2], &server).await;
    send(&mut other, &get("/healthz")).await;
    assert!(one_answer(&mut other).await.starts_with("HTTP/1.1 200"));
    server.stop().await;
}

#[tokio::test]
async fn a_port_in_use_is_reported_and_the_store_is_untouched() {
    let server = Running::new(config(Limits::default())).await;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let second = Collector::bind(at(server.address, StoreLocation::File(path.clone()))).await;
    let error = second.err().unwrap();
    let text = error.to_string();
    assert!(matches!(error, CollectorError::AddressInUse { .. }));
    assert!(
        text.contains(&server.address.to_string()) && text.contains("\nhint: "),
        "{text}"
    );
    assert!(!path.exists());
    server.stop().await;
}

#[tokio::test]
async fn an_unusable_store_is_reported_once_with_its_path() {
    let store = StoreLocation::File("/no/such/folder/frames.sqlite".into());
    let error = Collector::bind(at(anywhere(), store)).await.err().unwrap();
    let text = error.to_string();
    // A program that prints the chain of sources would print the reason and hint twice.
    assert!(std::error::Error::source(&error).is_none());
    assert!(
        text.contains("/no/such/folder/frames.sqlite") && text.contains("\nhint: "),
        "{text}"
    );
}

#[tokio::test]
async fn open_requests_finish_before_the_end_and_what_was_stored_is_there_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let mut server = Running::new(at(anywhere(), StoreLocation::File(path.clone()))).await;
    let address = server.address;
    let (head, body) = post_frames(0..5);
    let mut posting = server.connect().await;
    send(&mut posting, &head).await;
    send(&mut posting, &body[..100]).await;
    let mut watching = server.connect().await;
    send(&mut watching, &get("/v1/live")).await;
    let mut piece = [0; 16];
    watching.read_exact(&mut piece).await.unwrap();

    server.ask_to_stop();
    until_closed(&mut watching).await;
    send(&mut posting, &body[100..]).await;
    let answer = until_closed(&mut posting).await;
    assert!(
        answer.starts_with("HTTP/1.1 200") && answer.contains(r#""s1":4"#),
        "{answer}"
    );
    tokio::time::timeout(PATIENCE, server.served)
        .await
        .unwrap()
        .unwrap()
        .unwrap();
    assert!(
        !path.with_extension("sqlite-wal").exists(),
        "the log was written into the file"
    );

    // The same port and file, at once.
    let again = Running::new(at(address, StoreLocation::File(path))).await;
    let mut stream = again.connect().await;
    send(&mut stream, &get("/v1/sensors")).await;
    assert!(
        one_answer(&mut stream)
            .await
            .contains(r#""durable_through":4"#)
    );
    again.stop().await;
}

#[tokio::test]
async fn a_request_that_never_ends_does_not_keep_the_collector_from_stopping() {
    let limits = Limits {
        shutdown_time_max: Duration::from_millis(100),
        ..Limits::default()
    };
    let server = Running::new(config(limits)).await;
    let mut stuck = server.connect().await;
    send(&mut stuck, &post_frames(0..5).0).await;
    let began = Instant::now();
    server.stop().await;
    assert!(began.elapsed() < Limits::default().body_time_max);
    assert_eq!(until_closed(&mut stuck).await, "");
}
