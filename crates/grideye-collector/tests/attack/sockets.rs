//! Faults below the router: slow, half-open, oversized and mangled connections from three addresses at once, with
//! default limits.

use crate::agent::{Agent, connect, quantile};
use crate::collector_process::{Attacked, Folder, Metrics};
use crate::made_up::{self, Dice};
use crate::patience::WAIT_MAX;
use crate::{ALONE, from_environment};
use grideye_collector::Limits;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// The attackers' addresses.
const PEERS: [[u8; 4]; 3] = [[127, 0, 0, 2], [127, 0, 0, 3], [127, 0, 0, 4]];
/// Attacks open at once.
const AT_ONCE: u64 = 1000;
/// Maximum memory of one open attack: the buffers of its connection and its header.
const OPEN_MAX_KIB: u64 = 32;
/// Memory that caches and the allocator keep afterwards.
const LEFT_MAX_KIB: u64 = 32 * 1024;
/// Slow enough that neither header nor body finishes in time.
const DRIP_EVERY: Duration = Duration::from_millis(400);
const POST_EVERY: Duration = Duration::from_millis(20);

/// What an attack sends at once, and what it then sends byte by byte.
fn attack(dice: &mut Dice) -> (Vec<u8>, &'static [u8]) {
    let head = "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\n";
    let whole = |text: String| (text.into_bytes(), &b""[..]);
    match dice.below(14) {
        0 => (
            Vec::new(),
            b"GET / HTTP/1.1\r\nhost: localhost\r\nx: yyyyyyyy",
        ),
        1 => {
            let announced = format!("{head}content-length: 900\r\n\r\n");
            (
                announced.into_bytes(),
                b"{\"device\":\"pi-2\",\"boot\":\"b1\",\"sensors\":[",
            )
        }
        2 => whole(String::new()),
        3 => whole(format!(
            "GET / HTTP/1.1\r\nhost: localhost\r\nx: {}\r\n\r\n",
            "y".repeat(40_000)
        )),
        4 => whole(format!(
            "GET /{} HTTP/1.1\r\nhost: localhost\r\n\r\n",
            "a".repeat(40_000)
        )),
        5 => whole(format!("{head}content-length: 99999999999\r\n\r\n")),
        6 => whole(format!(
            "{head}content-length: 4\r\ntransfer-encoding: chunked\r\n\r\n0\r\n\r\nGET /healthz HTTP/1.1\r\nhost: localhost\r\n\r\n"
        )),
        7 => whole(format!(
            "{head}transfer-encoding: chunked\r\n\r\nffffffffffffffff\r\n{{"
        )),
        8 => whole(format!(
            "{head}transfer-encoding: chunked\r\n\r\n{}",
            "1\r\nx\r\n".repeat(2000)
        )),
        9 => whole("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_owned()),
        10 => (vec![22, 3, 1, 2, 0, 1, 0, 1, 252, 3, 3], b""),
        11 => whole("GET /healthz HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(50)),
        12 => {
            let bytes = (0..dice.below(600)).map(|_| u8::try_from(dice.roll() & 255).unwrap());
            (bytes.collect(), b"")
        }
        _ => {
            let body = made_up::body(dice);
            let mut bytes = format!("{head}content-length: {}\r\n\r\n", body.len()).into_bytes();
            bytes.extend(body);
            (bytes, b"")
        }
    }
}

/// Sends, and waits for the end; sometimes disconnects silently.
async fn run(from: [u8; 4], to: SocketAddr, mut dice: Dice, time_max: Duration) {
    let (at_once, dripped) = attack(&mut dice);
    let leaves = dice.below(4) == 0;
    let mut stream = connect(from, to).await.unwrap();
    let attacked = async {
        if stream.write_all(&at_once).await.is_err() {
            return;
        }
        for byte in dripped {
            tokio::time::sleep(DRIP_EVERY).await;
            if stream.write_all(&[*byte]).await.is_err() {
                return;
            }
        }
        if leaves {
            return;
        }
        let mut answer = [0; 4096];
        while let Ok(1..) = stream.read(&mut answer).await {}
    };
    let ended = tokio::time::timeout(time_max, attacked).await;
    let told = String::from_utf8_lossy(&at_once[..at_once.len().min(200)]);
    assert!(ended.is_ok(), "held for {time_max:?}: {told:?}");
}

/// Posts until told to stop; returns the time of each answer.
async fn deliver(to: SocketAddr, stop: watch::Receiver<bool>) -> Vec<Duration> {
    let mut agent = Agent::new("good", None, [127, 0, 0, 1], to);
    let mut took = Vec::new();
    while !*stop.borrow() {
        took.push(agent.post().await);
        tokio::time::sleep(POST_EVERY).await;
    }
    took
}

/// Runs all attacks of a round at once; returns the collector's peak memory.
async fn round(collector: &Attacked, dice: &mut Dice, time_max: Duration) -> u64 {
    let mut open = JoinSet::new();
    for from in PEERS
        .into_iter()
        .cycle()
        .take(usize::try_from(AT_ONCE).unwrap())
    {
        let dice = Dice::new(dice.roll());
        open.spawn(run(from, collector.address, dice, time_max));
    }
    let mut most_kib = 0;
    while !open.is_empty() {
        most_kib = collector.resident_kib().max(most_kib);
        let _ = tokio::time::timeout(POST_EVERY, async {
            while let Some(ended) = open.join_next().await {
                ended.unwrap();
            }
        })
        .await;
    }
    most_kib
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_half_open_and_mangled_connections_are_ended_and_a_device_is_not_hindered() {
    let _beside = ALONE.read().await;
    // Connections cost more than requests: one per twenty requests through the router.
    let rounds = (from_environment("GRIDEYE_ATTACK_REQUESTS", 20_000) / 20 / AT_ONCE).max(1);
    let seed = from_environment("GRIDEYE_ATTACK_SEED", 1);
    let limits = Limits::default();
    // Each waits for one thing that never comes: a header, the next header, or a body.
    let time_max = limits.header_time_max.max(limits.body_time_max) + WAIT_MAX;
    let collector = Folder::new().start();
    let (stop, stopped) = watch::channel(false);
    let device = tokio::spawn(deliver(collector.address, stopped));
    let before_kib = collector.resident_kib();
    let (mut dice, mut most_kib) = (Dice::new(seed), 0);
    for _ in 0..rounds {
        most_kib = round(&collector, &mut dice, time_max).await.max(most_kib);
    }
    let after_kib = collector.resident_kib();
    stop.send_replace(true);
    let mut took = device.await.unwrap();
    let metrics = collector.metrics(None).await;
    println!(
        "{} connections of seed {seed} from 3 addresses; {} of {} good posts taken, median {:?}, slowest {:?}; resident {before_kib} KiB before, {most_kib} KiB at most, {after_kib} KiB at the end",
        rounds * AT_ONCE,
        took.len(),
        took.len(),
        quantile(&mut took, 50),
        quantile(&mut took, 100),
    );
    check_counters(&metrics, rounds * AT_ONCE, took.len());
    assert!(most_kib < before_kib + AT_ONCE * OPEN_MAX_KIB);
    assert!(after_kib < before_kib + LEFT_MAX_KIB);
}

/// Checks that every connection, request and refusal is counted once.
fn check_counters(metrics: &Metrics, attacks: u64, posts: usize) {
    let of = |name: &str| metrics.of(name);
    // The attacks, the device and the metrics request; only the last is still open.
    assert_eq!(of("grideye_connections_total"), attacks + 2);
    assert_eq!(of("grideye_connections_open"), 1);
    for none in ["displaced", "turned_away"] {
        assert_eq!(of(&format!("grideye_connections_{none}_total")), 0);
    }
    let answered = metrics.sum("grideye_http_requests_total");
    assert_eq!(answered, of("grideye_http_request_seconds_count"));
    let of_class = |class| of(&format!("grideye_http_requests_total{{class=\"{class}\"}}"));
    assert_eq!(
        of_class("4xx") + of_class("5xx"),
        metrics.sum("grideye_refused_total")
    );
    assert_eq!(of_class("5xx"), 0);
    assert_eq!(metrics.refused("busy"), 0);
    let good = "grideye_sensor_stored_total{device=\"good\",sensor=\"s1\"}";
    assert_eq!(of(good), u64::try_from(posts).unwrap());
    let refusals = [
        "body_too_slow",
        "body_too_large",
        "body_cut",
        "not_json",
        "wrong_value",
    ];
    for reached in refusals {
        assert!(metrics.refused(reached) > 0, "{reached} was not reached");
    }
}
