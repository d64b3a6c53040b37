//! What goes wrong below the router: slow, half-open, oversize and mangled, from three addresses at once.

use crate::made_up::{self, Dice};
use crate::{from_environment, resident_kib};
use grideye_collector::{Collector, Config, Limits, StoreLocation, SystemClock};
use serde_json::json;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpSocket, TcpStream};
use tokio::sync::watch;

/// How long a single attack waits before it gives up by itself.
const PATIENCE: Duration = Duration::from_secs(20);
/// Attacks that each address has open at once: more than it may have connections.
const AT_ONCE: u64 = 24;
const PER_PEER_MAX: usize = 16;

fn limits() -> Limits {
    Limits {
        connections_max: 128,
        connections_per_peer_max: PER_PEER_MAX,
        header_time_max: Duration::from_millis(300),
        body_time_max: Duration::from_millis(300),
        ..Limits::default()
    }
}

async fn connect(from: [u8; 4], to: SocketAddr) -> Option<TcpStream> {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(SocketAddr::from((from, 0))).unwrap();
    socket.connect(to).await.ok()
}

/// The bytes of an attack, and the pause between them.
fn attack(dice: &mut Dice) -> (Vec<u8>, Duration) {
    let head = "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\n";
    let whole = |text: String| (text.into_bytes(), Duration::ZERO);
    match dice.below(14) {
        0 => (
            b"GET / HTTP/1.1\r\nhost: localhost\r\nx: yyyyyyyyyyyyyyyyyyyyyyyy".to_vec(),
            Duration::from_millis(40),
        ),
        1 => (
            format!("{head}content-length: 900\r\n\r\n{{\"device\":\"").into_bytes(),
            Duration::from_millis(40),
        ),
        2 => (Vec::new(), Duration::ZERO),
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
        9 => (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec(), Duration::ZERO),
        10 => (vec![22, 3, 1, 2, 0, 1, 0, 1, 252, 3, 3], Duration::ZERO),
        11 => whole("GET /healthz HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(200)),
        12 => {
            let bytes = (0..dice.below(600)).map(|_| u8::try_from(dice.roll() & 255).unwrap());
            (bytes.collect(), Duration::ZERO)
        }
        _ => {
            let body = made_up::body(dice);
            let mut bytes = format!("{head}content-length: {}\r\n\r\n", body.len()).into_bytes();
            bytes.extend(body);
            (bytes, Duration::ZERO)
        }
    }
}

/// Sends, waits for what comes, and sometimes leaves without a word. Whether the collector ended it.
async fn run(from: [u8; 4], to: SocketAddr, mut dice: Dice) -> bool {
    let (bytes, pause) = attack(&mut dice);
    let leaves = dice.below(4) == 0;
    let attacked = async {
        let Some(mut stream) = connect(from, to).await else {
            return;
        };
        let piece = if pause.is_zero() {
            bytes.len().max(1)
        } else {
            1
        };
        for piece in bytes.chunks(piece) {
            if stream.write_all(piece).await.is_err() {
                return;
            }
            tokio::time::sleep(pause).await;
        }
        if leaves {
            return;
        }
        let mut answer = [0; 4096];
        while let Ok(1..) = stream.read(&mut answer).await {}
    };
    tokio::time::timeout(PATIENCE, attacked).await.is_ok()
}

/// Posts a frame every 20 ms on one connection until it is told to stop; how long each answer took.
async fn deliver(to: SocketAddr, stop: watch::Receiver<bool>) -> Vec<Duration> {
    let mut stream = TcpStream::connect(to).await.unwrap();
    let mut took = Vec::new();
    while !*stop.borrow() {
        let seq = took.len();
        let frame = json!({
            "seq": seq, "t_boot_ns": seq, "t_utc_ns": 0, "clock": "synced",
            "thermistor_raw": 400, "pixels_raw": vec![80; 64],
        });
        let body = json!({ "device": "good", "boot": "b1", "sensors": [{ "sensor": "s1", "frames": [frame] }] });
        let body = body.to_string();
        let request = format!(
            "POST /v1/frames HTTP/1.1\r\nhost: localhost\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        let began = Instant::now();
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        let expected = format!("{{\"durable_through\":{{\"s1\":{seq}}},\"gaps\":[]}}");
        while !answer.ends_with(&expected) {
            let mut piece = [0; 4096];
            let count = stream.read(&mut piece).await.unwrap();
            assert!(count > 0, "the device was cut off after {answer:?}");
            answer.push_str(std::str::from_utf8(&piece[..count]).unwrap());
            assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        }
        took.push(began.elapsed());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    took
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slow_half_open_and_mangled_connections_are_ended_and_a_device_is_not_hindered() {
    // Connections are dearer than requests: one for twenty of those that go through the router.
    let rounds = from_environment("GRIDEYE_ATTACK_REQUESTS", 20_000) / 20 / (3 * AT_ONCE) + 1;
    let seed = from_environment("GRIDEYE_ATTACK_SEED", 1);
    let around = tempfile::tempdir().unwrap();
    let store = StoreLocation::File(around.path().join("frames.sqlite"));
    let clock = Arc::new(SystemClock::new());
    let config = Config {
        limits: limits(),
        ..Config::new(([127, 0, 0, 1], 0).into(), store, clock)
    };
    let collector = Collector::bind(config).await.unwrap();
    let to = collector.local_addr();
    let (stop, stopped) = watch::channel(false);
    let (end, mut ended) = watch::channel(false);
    let served = tokio::spawn(collector.serve(async move {
        let _ = ended.wait_for(|ended| *ended).await;
    }));
    let device = tokio::spawn(deliver(to, stopped));
    let (mut dice, mut attacks, mut before_kib) = (Dice::new(seed), 0, 0);
    for round in 0..rounds {
        let mut open = tokio::task::JoinSet::new();
        for peer in 2..5 {
            for _ in 0..AT_ONCE {
                open.spawn(run([127, 0, 0, peer], to, Dice::new(dice.roll())));
            }
        }
        while let Some(was_ended) = open.join_next().await {
            assert!(was_ended.unwrap(), "a connection was held for {PATIENCE:?}");
            attacks += 1;
        }
        if round == rounds / 10 {
            before_kib = resident_kib();
        }
    }
    let after_kib = resident_kib();
    stop.send_replace(true);
    let mut took = device.await.unwrap();
    took.sort();
    println!(
        "{attacks} connections of seed {seed} from 3 addresses; {} of {} good posts taken, median {:?}, slowest {:?}; resident {before_kib} KiB after a tenth, {after_kib} KiB at the end",
        took.len(),
        took.len(),
        took[took.len() / 2],
        took[took.len() - 1]
    );
    assert!(
        after_kib < before_kib + 32 * 1024,
        "{before_kib} KiB, then {after_kib}"
    );
    end.send_replace(true);
    served.await.unwrap().unwrap();
}
